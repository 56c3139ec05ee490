"""Tables that OptiTrack Motive exports: "Data Export: CSV", format versions 1.2 to 1.25 (Motive 1.10 to 3).

Sources: OptiTrack's documentation, page "Data Export: CSV" (docs.optitrack.com/motive/data-export/data-export-csv), and
files of these versions in public repositories. A first line of keys and values, an empty one, then rows that describe
the columns::

    Format Version,1.23,Take Name,walk,...,Export Frame Rate,120.000000,...,Length Units,Meters,Coordinate Space,Global

    ,Type,Marker,Marker,Marker,Bone,...
    ,Name,Ann:LSHO,Ann:LSHO,Ann:LSHO,Ann:LUArm,...
    ,ID,4CF0B31A,...
    ,Parent,...                                  since version 1.25
    ,,Position,Position,Position,Rotation,...
    Frame,Time (Seconds),X,Y,Z,X,...             version 1.24 may have a third column, TimeCode
    0,0.000000,0.1,1.4,...

The words Type, Name and ID are missing in older exports. An empty cell is a hidden marker.
"""
import csv
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.mocap.files.recording import MarkerRecording, unique_names
from openpose_ros_tools.mocap.files.text import metres_in, read_numbers

_FIRST_KEY = 'Format Version'


def is_motive_csv(text: str) -> bool:
    """Say whether a text starts as such a table does."""
    return text.startswith(_FIRST_KEY)


def read_motive_csv(path: Path, text: str) -> MarkerRecording:
    """Return the measured markers of a table; bones and rigid bodies, which Motive computes, are left out.

    Args:
        path: of the file, for errors.
        text: of the file.

    Raises:
        BadInputError: it is no such table; the text says what was expected.
        ValueError: its times or positions can not be; see `MarkerRecording`.
    """
    lines = text.split('\n')
    if lines[0].startswith(f'{_FIRST_KEY};'):
        raise BadInputError(f"{path} has columns separated by ';', expected ',', with '.' before decimals: as Motive "
                            'exports, before a spreadsheet saved it in its own way')
    if not is_motive_csv(text):
        raise BadInputError(f"{path} is no table of Motive: it starts with '{lines[0][:40]}', expected "
                            f"'{_FIRST_KEY},...'; export with 'Header Information' switched on")
    header = _cells(lines[0])
    values = dict(zip(header[0::2], header[1::2]))
    if 'Length Units' not in values:
        raise BadInputError(f"{path} does not tell 'Length Units' in its first line; there: {', '.join(values)}")
    scale = metres_in(path, values['Length Units'])
    first, markers = _markers(path, lines)
    used = [1, *(column + axis for column in markers for axis in range(3))]
    numbers = read_numbers(path, lines, first, ',', used)
    positions = numbers[:, 1:].reshape(len(numbers), len(markers), 3) * scale
    return MarkerRecording(tuple(unique_names(markers.values())), numbers[:, 0], positions)


def _cells(line: str) -> List[str]:
    return [cell.strip() for cell in next(csv.reader([line]), [])]


def _markers(path: Path, lines: Sequence[str]) -> Tuple[int, Dict[int, str]]:
    """Return the index of the first row of numbers, and the names of the markers by their first columns."""
    names_at = next((number for number, line in enumerate(lines) if line.startswith(('Frame,', '"Frame",'))), None)
    if names_at is None:
        raise BadInputError(f"{path} has no row 'Frame,Time (Seconds),X,Y,Z,...' above its numbers")
    axes = _cells(lines[names_at])
    if axes[1] != 'Time' and not axes[1].startswith('Time (Seconds'):
        raise BadInputError(f"{path}, line {names_at + 1}: the second column is '{axes[1]}', expected 'Time (Seconds)'")
    rows = [cells + [''] * (len(axes) - len(cells)) for cells in map(_cells, lines[1:names_at]) if any(cells)]
    if len(rows) < 3:
        raise BadInputError(f'{path} has {len(rows)} rows above its column names, expected types, names, IDs and kinds')
    # the label of a row is in one of the columns of frame and time; older exports have none
    labelled = {cell.lower(): cells for cells in reversed(rows) for cell in cells[:2]}
    types, names, kinds = labelled.get('type', rows[0]), labelled.get('name', rows[1]), rows[-1]
    markers = {column: names[column] for column in range(2, len(axes) - 2) if types[column].lower() == 'marker'
               and axes[column:column + 3] == ['X', 'Y', 'Z'] and kinds[column] == 'Position'}
    if not markers:
        raise BadInputError(f"{path} has no positions of markers; its columns are of type "
                            f"{', '.join(sorted(set(filter(None, types[2:])))) or 'unknown'}")
    return names_at + 1, markers
