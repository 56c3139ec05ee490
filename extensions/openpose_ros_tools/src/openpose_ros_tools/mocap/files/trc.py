"""Track row column files (.trc), as Cortex, OpenSim and Motive write them.

Source: OpenSim's documentation, "Marker (.trc) Files"; time = (frame - OrigDataStartFrame) / DataRate. Cells are
separated by tabs::

    PathFileType  4  (X/Y/Z)  walk.trc
    DataRate  CameraRate  NumFrames  NumMarkers  Units  OrigDataRate  OrigDataStartFrame  OrigNumFrames
    120.00    120.00      300        2           mm     120.00        1                   300
    Frame#  Time  LSHO          RSHO
                  X1  Y1  Z1    X2  Y2  Z2

    1       0.000 10.0 20.0 30.0 ...

A hidden marker has empty cells, NaN, or zeros throughout.
"""
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.mocap.files.recording import MarkerRecording, unique_names
from openpose_ros_tools.mocap.files.text import metres_in, read_numbers

_FIRST_KEY = 'PathFileType'


def is_trc(text: str) -> bool:
    """Say whether a text starts as such a file does."""
    return text.startswith(_FIRST_KEY)


def read_trc(path: Path, text: str) -> MarkerRecording:
    """Return the markers of a file.

    Args:
        path: of the file, for errors.
        text: of the file.

    Raises:
        BadInputError: it is no such file; the text says what was expected.
        ValueError: its times or positions can not be; see `MarkerRecording`.
    """
    lines = text.split('\n')
    if not is_trc(text):
        raise BadInputError(f"{path} is no TRC file: it starts with '{lines[0][:40]}', expected '{_FIRST_KEY}'")
    if len(lines) < 5:
        raise BadInputError(f'{path} breaks off in its header: {len(lines)} lines, expected 5 and then numbers')
    values = dict(zip(_cells(lines[1]), _cells(lines[2])))
    if not values.get('Units'):
        raise BadInputError(f"{path} does not tell its Units in lines 2 and 3; there: {', '.join(values)}")
    scale = metres_in(path, values['Units'])
    names = _names(path, lines[3], values)
    numbers = read_numbers(path, lines, 5, '\t', range(2 + 3 * len(names)), may_be_short=True)
    positions = numbers[:, 2:].reshape(len(numbers), len(names), 3) * scale
    positions[(positions == 0).all(axis=2)] = np.nan
    return MarkerRecording(tuple(unique_names(names)), _times(path, numbers[:, :2], values), positions)


def _cells(line: str) -> List[str]:
    return [cell.strip() for cell in line.split('\t')]


def _names(path: Path, line: str, values: Dict[str, str]) -> Tuple[str, ...]:
    cells = _cells(line)
    names = tuple(cell for cell in cells[2:] if cell)
    if not cells[0].startswith('Frame') or not names:
        raise BadInputError(f"{path}, line 4: expected 'Frame#', 'Time' and names of markers, got '{line[:60]}'")
    if values.get('NumMarkers') != str(len(names)):
        raise BadInputError(f"{path} has NumMarkers = {values.get('NumMarkers')}, but line 4 names {len(names)}: "
                            f"{', '.join(names[:8])}{', ...' if len(names) > 8 else ''}")
    return names


def _times(path: Path, frames_and_times: np.ndarray, values: Dict[str, str]) -> np.ndarray:
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
