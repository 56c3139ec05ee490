"""Tables that OptiTrack Motive exports: "Data Export: CSV", format versions 1.2 to 1.25 (Motive 1.10 to 3).

Sources: OptiTrack's documentation, page "Data Export: CSV" (docs.optitrack.com/motive/data-export/data-export-csv), and
files of these versions that public repositories show. A first line of keys and values, an empty one, then rows that
describe the columns::

    Format Version,1.23,Take Name,walk,...,Export Frame Rate,120.000000,...,Length Units,Meters,Coordinate Space,Global

    ,Type,Marker,Marker,Marker,Bone,Bone,Bone,Bone,Bone,Bone,Bone
    ,Name,Ann:LSHO,Ann:LSHO,Ann:LSHO,Ann:LUArm,...
    ,ID,4CF0B31A,...
    ,Parent,...                                  since version 1.25
    ,,Position,Position,Position,Rotation,Rotation,Rotation,Rotation,Position,Position,Position
    Frame,Time (Seconds),X,Y,Z,X,Y,Z,W,X,Y,Z     version 1.24 may have a third column, TimeCode
    0,0.000000,0.1,1.4,...

The words Type, Name and ID are missing in older exports. An empty cell is a marker that was not seen.
"""
import csv
import logging
from io import StringIO
from pathlib import Path
from typing import List, NamedTuple, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.mocap.files.recording import MarkerRecording, unique_names
from openpose_ros_tools.mocap.files.text import metres_in, read_numbers

_log = logging.getLogger(__name__)

BONE = ' (bone)'
_FIRST_KEY = 'Format Version'
# Types for where a marker should be on its body end with this; they are only of use where it was not measured.
_EXPECTED_END = ' marker'


class _Point(NamedTuple):
    """Three columns of a table: type in lower case, name, and the first of the columns."""

    kind: str
    name: str
    column: int


def is_motive_csv(text: str) -> bool:
    """Say whether a text starts as such a table does."""
    return text.startswith(_FIRST_KEY)


def read_motive_csv(path: Path, text: str) -> MarkerRecording:
    """Return the markers, bones and rigid bodies of a table.

    Bones are called `NAME (bone)` and rigid bodies `NAME (rigid body)`, as a skeleton has bones and markers of one
    name, such as Chest. What Motive calls bone markers and rigid body markers, the places where markers should be,
    count only where no measured marker has the name. Rotations and errors are left out.

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
    first, points = _points(path, lines)
    points = _wanted(path, points, values.get('Coordinate Space', 'Global').lower() == 'local')
    used = [1, *(point.column + axis for point in points for axis in range(3))]
    numbers = read_numbers(path, lines, first, ',', used)
    positions = numbers[:, 1:].reshape(len(numbers), len(points), 3) * scale
    return MarkerRecording(tuple(unique_names(point.name for point in points)), numbers[:, 0], positions)


def motive_csv_bytes(recording: MarkerRecording) -> bytes:
    """Return a recording as Motive exports it (version 1.23): metres and seconds with six digits."""
    out = StringIO()
    writer = csv.writer(out)
    rate = f'{recording.rate:.6f}' if len(recording) > 1 else '0.000000'
    writer.writerow(['Format Version', '1.23', 'Take Name', 'Take', 'Capture Frame Rate', rate,
                     'Export Frame Rate', rate, 'Capture Start Time', '2000-01-01 12.00.00.000 AM',
                     'Total Frames in Take', len(recording), 'Total Exported Frames', len(recording),
                     'Rotation Type', 'Quaternion', 'Length Units', 'Meters', 'Coordinate Space', 'Global'])
    writer.writerow([])
    types, names = [], []
    for name in recording.names:
        is_bone = name.endswith(BONE)
        types += ['Bone' if is_bone else 'Marker'] * 3
        names += [name[:-len(BONE)] if is_bone else name] * 3
    ids = [f'{number + 1:X}' for number in range(len(recording.names)) for _ in range(3)]
    for row in (['', 'Type', *types], ['', 'Name', *names], ['', 'ID', *ids], ['', '', *['Position'] * len(names)],
                ['Frame', 'Time (Seconds)', *['X', 'Y', 'Z'] * len(recording.names)]):
        writer.writerow(row)
    for frame, (time, positions) in enumerate(zip(recording.times, recording.positions)):
        writer.writerow([frame, f'{time:.6f}', *('' if np.isnan(value) else f'{value:.6f}'
                                                 for value in positions.ravel())])
    return out.getvalue().encode()


def _cells(line: str) -> List[str]:
    return [cell.strip() for cell in next(csv.reader([line]), [])]


def _points(path: Path, lines: Sequence[str]) -> Tuple[int, List[_Point]]:
    """Return the index of the first row of numbers, and the columns that hold positions."""
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
    points = [_Point(types[column].lower(), names[column], column) for column in range(2, len(axes) - 2)
              if axes[column:column + 3] == ['X', 'Y', 'Z'] and kinds[column] == 'Position']
    if not points:
        raise BadInputError(f"{path} has no positions of markers, bones or rigid bodies; its columns are of type "
                            f"{', '.join(sorted(set(filter(None, types[2:])))) or 'unknown'}")
    return names_at + 1, points


def _wanted(path: Path, points: Sequence[_Point], local: bool) -> List[_Point]:
    """Return the measured markers, then what Motive computed, under names that tell these apart.

    Args:
        local: whether the positions of bones are relative to each other, and so of no use.
    """
    measured = [point for point in points if point.kind == 'marker']
    names = {point.name for point in measured}
    if local and any(point.kind.endswith('bone') for point in points):
        _log.warning('%s: bones are left out, as they are relative to each other; export with Coordinate Space: Global',
                     path)
    computed = []
    for point in points:
        if point.kind.endswith(_EXPECTED_END):
            if point.name not in names:
                computed.append(point)
        elif point.kind != 'marker' and not (local and point.kind.endswith('bone')):
            computed.append(point._replace(name=f'{point.name} ({point.kind})'))
    return measured + computed
