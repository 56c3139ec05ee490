"""Files of motion capture systems: tables of OptiTrack Motive (.csv), C3D (.c3d), TRC (.trc)."""
import csv
import logging
import re
import warnings
from dataclasses import dataclass
from io import BytesIO, StringIO
from itertools import islice
from pathlib import Path
from typing import Dict, Iterable, List, Sequence, Tuple, Union

import numpy as np

from openpose_ros_pkg.errors import BadInputError

_log = logging.getLogger(__name__)

_MOTIVE_KEY, _TRC_KEY, _C3D_KEY = 'Format Version', 'PathFileType', 0x50  # the last is the second byte of a file
# Names of length units, in lower case, and their size [m].
UNITS: Dict[str, float] = {'m': 1.0, 'meters': 1.0, 'cm': 0.01, 'centimeters': 0.01, 'mm': 0.001, 'millimeters': 0.001}


@dataclass(frozen=True)
class MarkerRecording:
    """Positions of M markers, or joints, at T times, in the frame and by the clock of the motion capture system."""

    names: Tuple[str, ...]
    times: np.ndarray  # (T,) float64 [s], increasing
    positions: np.ndarray  # (T, M, 3) float64 [m]; NaN where a marker is hidden

    def __len__(self) -> int:
        return len(self.times)

    @property
    def rate(self) -> float:
        """Samples per second of two or more at a constant rate [Hz]."""
        return float((len(self) - 1) / (self.times[-1] - self.times[0]))


def read_mocap(path: Union[str, Path]) -> MarkerRecording:
    """Read the markers of a recording, whatever its suffix.

    Raises:
        BadInputError: the file is missing, of no known format, or damaged.
    """
    path = Path(path).expanduser()
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadInputError(f'{path} can not be read: {error.strerror}') from error
    try:
        if len(content) >= 512 and content[1] == _C3D_KEY:
            names, times, positions = _read_c3d(content)
        else:
            text = content.decode('utf-8-sig', errors='replace')
            if text.startswith(_MOTIVE_KEY):
                names, times, positions = _read_motive(_whole_lines(text))
            elif text.startswith(_TRC_KEY):
                names, times, positions = _read_trc(_whole_lines(text))
            else:
                raise ValueError("expected a table that Motive exported with 'Header Information' (.csv), C3D (.c3d) "
                                 f'or TRC (.trc); it starts with {text[:40]!r}')
    except (csv.Error, ValueError) as error:
        raise BadInputError(f'{path}: {error}') from error
    if not len(times):
        raise BadInputError(f'{path} has a header, but no frames')
    if not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise BadInputError(f'{path}: times do not increase from row to row')
    positions[~np.isfinite(positions).all(axis=2)] = np.nan
    return MarkerRecording(tuple(names), times, positions)


def _read_motive(lines: Sequence[str]) -> Tuple[List[str], np.ndarray, np.ndarray]:
    """Return names, times and positions of the measured markers of a table of Motive, without what Motive computes.

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
    """
    head = next(csv.reader(lines[:1]))
    scale = _metres(dict(zip(head[0::2], head[1::2])).get('Length Units', ''))
    last = next((number for number, line in enumerate(lines) if line.startswith(('Frame,', '"Frame",'))), 0)
    *rows, axes = [row for row in csv.reader(lines[1:last + 1]) if any(row)] or [[]]
    rows = [[*row, *[''] * (len(axes) - len(row))] for row in rows]
    if len(rows) < 3:
        raise ValueError("expected rows of types, names, IDs and kinds above one of 'Frame,Time (Seconds),X,Y,Z,...'")
    labelled = {cell.lower(): row for row in reversed(rows) for cell in row[:2]}
    types, names, kinds = labelled.get('type', rows[0]), labelled.get('name', rows[1]), rows[-1]
    markers = [column for column in range(2, len(axes) - 2) if types[column].lower() == 'marker'
               and axes[column:column + 3] == ['X', 'Y', 'Z'] and kinds[column] == 'Position']
    if not markers:
        raise ValueError(f"no positions of markers; its columns are of type {', '.join(sorted({*types[2:]} - {''}))}")
    numbers = _numbers(lines[last + 1:], ',', len(axes), [1, *(first + axis for first in markers for axis in range(3))])
    return [names[column] for column in markers], numbers[:, 0], scale * numbers[:, 1:].reshape(
        len(numbers), len(markers), 3)


def _read_trc(lines: Sequence[str]) -> Tuple[List[str], np.ndarray, np.ndarray]:
    """Return names, times and positions of the markers of a track row column file.

    Source: OpenSim's documentation, "Marker (.trc) Files". Cells are separated by tabs; a hidden marker has empty
    cells, NaN, or zeros throughout::

        PathFileType  4  (X/Y/Z)  walk.trc
        DataRate  CameraRate  NumFrames  NumMarkers  Units  OrigDataRate  OrigDataStartFrame  OrigNumFrames
        120.00    120.00      300        2           mm     120.00        1                   300
        Frame#  Time  LSHO          RSHO
                      X1  Y1  Z1    X2  Y2  Z2

        1       0.000 10.0 20.0 30.0 ...
    """
    if len(lines) < 5:
        raise ValueError(f'breaks off in its header: {len(lines)} lines, expected 5 and then numbers')
    keys, values, names = ([cell.strip() for cell in line.split('\t')] for line in lines[1:4])
    scale, names = _metres(dict(zip(keys, values)).get('Units', '')), [name for name in names[2:] if name]
    numbers = _numbers(lines[5:], '\t', 2 + 3 * len(names), range(1, 2 + 3 * len(names)))
    positions = scale * numbers[:, 1:].reshape(len(numbers), len(names), 3)
    positions[(positions == 0).all(axis=2)] = np.nan
    return names, numbers[:, 0], positions


def _read_c3d(content: bytes) -> Tuple[List[str], np.ndarray, np.ndarray]:
    """Return names, times and positions of the points of a C3D file (www.c3d.org), by the library c3d.

    Frame 1 is at 0 s, so that a trial which was cut keeps its clock. A point is missing where its residual is negative,
    and where all its coordinates are 0.
    """
    try:
        import c3d
    except ImportError:
        raise BadInputError("the library c3d is needed to read C3D: './run setup' installs it, or 'python3 -m pip "
                            "install c3d'; or export CSV or TRC instead") from None
    try:
        with warnings.catch_warnings():  # of the library, on headers that disagree; what matters is checked here
            warnings.simplefilter('ignore')
            reader = c3d.Reader(BytesIO(content))
            rate, unit, first = float(reader.point_rate), reader.get('POINT:UNITS'), int(reader.first_frame)
            labels = [label.strip(' \0') for label in (reader.point_labels if reader.get('POINT:LABELS') else ())]
            frames = [points[:, :4] for _, points, _ in islice(
                reader.read_frames(), max(int(reader.last_frame) - first + 1, 0))]
            unit = '' if unit is None else unit.string_value.strip(' \0')
    except Exception as error:  # of many kinds: the library checks little itself
        raise ValueError(f'damaged, or no C3D file: {error!r}') from error
    if not 0 < rate < np.inf:
        raise ValueError(f'POINT:RATE = {rate:g}, expected a number above 0 [Hz]')
    number = len(frames[0]) if frames else 0
    values = np.array(frames, np.float64).reshape(len(frames), number, 4)
    positions = values[..., :3] * _metres(unit)
    positions[(values[..., 3] < 0) | (positions == 0).all(axis=2)] = np.nan
    names = [label or f'point {place}' for place, label in enumerate([*labels, *[''] * number][:number], 1)]
    return names, (first - 1 + np.arange(len(frames))) / rate, positions


def _whole_lines(text: str) -> List[str]:
    """Return the lines of a table without a last one that breaks off, as when the export was interrupted."""
    lines = text.splitlines()
    if len(lines) > 1 and not text.endswith('\n') and len(re.findall('[,\t]', lines[-1])) < len(
            re.findall('[,\t]', lines[-2])):
        _log.warning('the last line is left out, as it breaks off')
        lines.pop()
    return lines


def _numbers(lines: Sequence[str], separator: str, width: int, columns: Iterable[int]) -> np.ndarray:
    """Return columns of the rows of a table, float64; empty cells are NaN."""
    import pandas as pd
    rows = [line for line in lines if line.strip()]
    if not rows:
        return np.zeros((0, len(list(columns))))
    table = pd.read_csv(StringIO('\n'.join(rows)), sep=separator, header=None, names=range(width), index_col=False,
                        usecols=list(columns), dtype=np.float64)
    return table.to_numpy()


def _metres(unit: str) -> float:
    if unit.strip().lower() not in UNITS:
        raise ValueError(f"lengths in '{unit.strip()}', expected one of {', '.join(UNITS)}")
    return UNITS[unit.strip().lower()]
