"""Tables of motion capture systems as text: OptiTrack Motive (.csv), and .trc of Cortex, OpenSim and Motive."""
import codecs
import csv
import logging
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.mocap.files.recording import MarkerRecording, unique_names

_log = logging.getLogger(__name__)

MOTIVE_KEY, TRC_KEY = 'Format Version', 'PathFileType'
"""What a table begins with."""
# Names of length units, in lower case, and their size [m].
UNITS: Dict[str, float] = {
    'm': 1.0, 'meters': 1.0, 'metres': 1.0, 'cm': 0.01, 'centimeters': 0.01, 'centimetres': 0.01, 'mm': 0.001,
    'millimeters': 0.001, 'millimetres': 0.001}
_BINARY = {chr(code) for code in range(9)}  # control characters that no text holds


def decode(path: Path, content: bytes) -> str:
    """Return a file's text with '\\n' at the end of lines.

    UTF-8 and UTF-16 with their byte order marks, UTF-8 without, else Latin-1, as older Windows programs write.

    Raises:
        BadInputError: it is no text.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = content.decode('utf-16', errors='replace')
    else:
        try:
            text = content.decode('utf-8-sig')
        except UnicodeDecodeError:
            text = content.decode('latin-1')
    if _BINARY & set(text[:4096]):
        raise BadInputError(f'{path} is a binary file, expected text')
    return text.replace('\r\n', '\n').replace('\r', '\n')


def metres_in(path: Path, unit: str) -> float:
    """Return the size of a length unit [m].

    Raises:
        BadInputError: it is none of `UNITS`.
    """
    size = UNITS.get(unit.strip().lower())
    if size is None:
        raise BadInputError(f"{path} has lengths in '{unit.strip()}', expected one of {', '.join(UNITS)}")
    return size


def read_motive_csv(path: Path, text: str) -> MarkerRecording:
    """Return the measured markers of a table of Motive; bones and rigid bodies, which Motive computes, are left out.

    Format versions 1.2 to 1.25 (Motive 1.10 to 3). Sources: OptiTrack's documentation, page "Data Export: CSV"
    (docs.optitrack.com/motive/data-export/data-export-csv), and files of these versions in public repositories.
    A first line of keys and values, an empty one, then rows that describe the columns::

        Format Version,1.23,Take Name,walk,...,Export Frame Rate,120.000000,...,Length Units,Meters,...

        ,Type,Marker,Marker,Marker,Bone,...
        ,Name,Ann:LSHO,Ann:LSHO,Ann:LSHO,Ann:LUArm,...
        ,ID,4CF0B31A,...
        ,Parent,...                                  since version 1.25
        ,,Position,Position,Position,Rotation,...
        Frame,Time (Seconds),X,Y,Z,X,...             version 1.24 may have a third column, TimeCode
        0,0.000000,0.1,1.4,...

    The words Type, Name and ID are missing in older exports. An empty cell is a hidden marker.

    Args:
        path: of the file, for errors.
        text: of the file.

    Raises:
        BadInputError: it is no such table; the text says what was expected.
        ValueError: its times or positions can not be; see `MarkerRecording`.
    """
    lines = text.split('\n')
    if lines[0].startswith(f'{MOTIVE_KEY};'):
        raise BadInputError(f"{path} has columns separated by ';', expected ',', with '.' before decimals: as Motive "
                            'exports, before a spreadsheet saved it in its own way')
    if not text.startswith(MOTIVE_KEY):
        raise BadInputError(f"{path} is no table of Motive: it starts with '{lines[0][:40]}', expected "
                            f"'{MOTIVE_KEY},...'; export with 'Header Information' switched on")
    header = _cells(lines[0])
    values = dict(zip(header[0::2], header[1::2]))
    if 'Length Units' not in values:
        raise BadInputError(f"{path} does not tell 'Length Units' in its first line; there: {', '.join(values)}")
    scale = metres_in(path, values['Length Units'])
    first, markers = _motive_markers(path, lines)
    used = [1, *(column + axis for column in markers for axis in range(3))]
    numbers = _read_numbers(path, lines, first, ',', used)
    positions = numbers[:, 1:].reshape(len(numbers), len(markers), 3) * scale
    return MarkerRecording(tuple(unique_names(markers.values())), numbers[:, 0], positions)


def _motive_markers(path: Path, lines: Sequence[str]) -> Tuple[int, Dict[int, str]]:
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


def read_trc(path: Path, text: str) -> MarkerRecording:
    """Return the markers of a track row column file; arguments and errors as `read_motive_csv`.

    Source: OpenSim's documentation, "Marker (.trc) Files"; time = (frame - OrigDataStartFrame) / DataRate. Cells are
    separated by tabs; a hidden marker has empty cells, NaN, or zeros throughout::

        PathFileType  4  (X/Y/Z)  walk.trc
        DataRate  CameraRate  NumFrames  NumMarkers  Units  OrigDataRate  OrigDataStartFrame  OrigNumFrames
        120.00    120.00      300        2           mm     120.00        1                   300
        Frame#  Time  LSHO          RSHO
                      X1  Y1  Z1    X2  Y2  Z2

        1       0.000 10.0 20.0 30.0 ...
    """
    lines = text.split('\n')
    if not text.startswith(TRC_KEY):
        raise BadInputError(f"{path} is no TRC file: it starts with '{lines[0][:40]}', expected '{TRC_KEY}'")
    if len(lines) < 5:
        raise BadInputError(f'{path} breaks off in its header: {len(lines)} lines, expected 5 and then numbers')
    values = dict(zip(_trc_cells(lines[1]), _trc_cells(lines[2])))
    if not values.get('Units'):
        raise BadInputError(f"{path} does not tell its Units in lines 2 and 3; there: {', '.join(values)}")
    scale = metres_in(path, values['Units'])
    names = _trc_names(path, lines[3], values)
    numbers = _read_numbers(path, lines, 5, '\t', range(2 + 3 * len(names)), may_be_short=True)
    positions = numbers[:, 2:].reshape(len(numbers), len(names), 3) * scale
    positions[(positions == 0).all(axis=2)] = np.nan
    return MarkerRecording(tuple(unique_names(names)), _trc_times(path, numbers[:, :2], values), positions)


def _trc_names(path: Path, line: str, values: Dict[str, str]) -> Tuple[str, ...]:
    cells = _trc_cells(line)
    names = tuple(cell for cell in cells[2:] if cell)
    if not cells[0].startswith('Frame') or not names:
        raise BadInputError(f"{path}, line 4: expected 'Frame#', 'Time' and names of markers, got '{line[:60]}'")
    if values.get('NumMarkers') != str(len(names)):
        raise BadInputError(f"{path} has NumMarkers = {values.get('NumMarkers')}, but line 4 names {len(names)}: "
                            f"{', '.join(names[:8])}{', ...' if len(names) > 8 else ''}")
    return names


def _trc_times(path: Path, frames_and_times: np.ndarray, values: Dict[str, str]) -> np.ndarray:
    """Return the times [s]: the second column, or by frame and rate if that is not filled in."""
    frames, times = frames_and_times.T
    if np.isfinite(times).all():
        return times
    try:
        rate, first = float(values.get('DataRate', '')), float(values.get('OrigDataStartFrame') or 1)
    except ValueError:
        rate, first = 0.0, 1.0
    if not rate > 0:
        raise BadInputError(f"{path} has rows without a time and DataRate = '{values.get('DataRate', '')}', expected "
                            'one of them')
    return (frames - first) / rate


def _read_numbers(path: Path, lines: Sequence[str], first: int, separator: str, columns: Sequence[int],
                 may_be_short: bool = False) -> np.ndarray:
    """Return columns of the rows of a table; empty cells are NaN.

    A last line that breaks off, as when the export was interrupted, is dropped with a warning.

    Args:
        lines: of the whole file.
        first: index of the first row; empty lines are skipped from there on.
        columns: to return, from 0.
        may_be_short: whether empty cells at the end of a row may be left out.

    Returns:
        (rows, columns) float64.

    Raises:
        BadInputError: a row is too short or holds something else.
    """
    filled = [number for number in range(first, len(lines)) if lines[number].strip()]
    rows: List[List[float]] = []
    for number in filled:
        cells = lines[number].split(separator)
        if may_be_short and number < len(lines) - 1:  # the line is whole: a line end follows it
            cells += [''] * (max(columns) + 1 - len(cells))
        try:
            rows.append(_numbers(cells, columns))
        except ValueError as error:
            if number != filled[-1]:
                raise BadInputError(f'{path}, line {number + 1}: {error}') from error
            _log.warning('%s breaks off: its last line, %d, is left out (%s)', path, number + 1, error)
    return np.array(rows, np.float64).reshape(len(rows), len(columns))


def _cells(line: str) -> List[str]:
    return [cell.strip() for cell in next(csv.reader([line]), [])]


def _trc_cells(line: str) -> List[str]:
    return [cell.strip() for cell in line.split('\t')]


def _numbers(cells: Sequence[str], columns: Sequence[int]) -> List[float]:
    """Return the numbers in some cells of a row; raise ValueError where there are none."""
    if len(cells) <= max(columns):
        raise ValueError(f'has {len(cells)} cells, expected {max(columns) + 1}')
    try:
        return [float(cells[column].strip() or 'nan') for column in columns]
    except ValueError as error:
        comma = any(',' in cell for cell in cells)
        raise ValueError(f'holds something that is no number: {error}'
                         + "; decimal commas can not be read, export with '.'" * comma) from error
