"""C3D files (www.c3d.org), which most motion capture systems write, by the library c3d."""
import logging
import struct
import warnings
from io import BytesIO
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any, List, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.mocap.files.recording import MarkerRecording, unique_names
from openpose_ros_tools.mocap.files.tables import metres_in

_log = logging.getLogger(__name__)

# Second byte of each such file; the first tells the block with the parameters.
_KEY = 0x50
# What the library raises for damaged files: it checks little itself.
_LIBRARY_ERRORS = (AssertionError, AttributeError, IndexError, KeyError, NameError, OSError, OverflowError, TypeError,
                   ValueError, ZeroDivisionError, struct.error)


def is_c3d(content: bytes) -> bool:
    """Say whether a file starts as C3D does."""
    return len(content) >= 512 and content[1] == _KEY


def read_c3d(path: Path, content: bytes) -> MarkerRecording:
    """Return the points of a file.

    Frame 1 is at 0 s, so that a trial which was cut keeps its clock. A point is missing where its residual is negative,
    and where all its coordinates are 0.

    Args:
        path: of the file, for errors.
        content: of the file.

    Raises:
        BadInputError: the library is missing, or it is no such file.
    """
    library = _library(path)
    if not is_c3d(content):
        raise BadInputError(f'{path} is no C3D file: its second byte is not 0x{_KEY:X}')
    try:
        with warnings.catch_warnings():  # of the library, on headers that disagree; what matters is checked here
            warnings.simplefilter('ignore')
            reader = library.Reader(BytesIO(content))
            rate, scale = _rate_and_scale(path, reader)
            names, first = _names(reader), _first_frame(reader)
            count = int(reader.last_frame) - first + 1
            frames = [points[:, :4] for _, points, _ in islice(reader.read_frames(), max(count, 0))]
    except _LIBRARY_ERRORS as error:
        raise BadInputError(f'{path} is damaged or no C3D file: {error!r}') from error
    if len(frames) < count:
        _log.warning('%s breaks off after %d of %d frames', path, len(frames), count)
    values = np.array(frames, np.float64).reshape(len(frames), len(names), 4)
    positions = values[..., :3] * scale
    positions[(values[..., 3] < 0) | (positions == 0).all(axis=2)] = np.nan
    return MarkerRecording(tuple(unique_names(names)), (first - 1 + np.arange(len(frames))) / rate, positions)


def _library(path: Path) -> ModuleType:
    try:
        import c3d as library
    except ImportError:
        raise BadInputError(f"the library c3d is needed to read {path}: './run setup' installs it, or 'python3 -m pip "
                            "install c3d'; or export CSV or TRC instead") from None
    return library


def _rate_and_scale(path: Path, reader: Any) -> Tuple[float, float]:
    """Return the samples per second [Hz] and the size of the unit of length [m]."""
    rate, unit = float(reader.point_rate), reader.get('POINT:UNITS')
    if not (np.isfinite(rate) and rate > 0):
        raise BadInputError(f'{path} has POINT:RATE = {rate:g}, expected a number above 0 [Hz]')
    if unit is None or not unit.string_value.strip(' \0'):
        raise BadInputError(f'{path} does not tell its unit (POINT:UNITS), expected mm or m')
    return rate, metres_in(path, unit.string_value.strip(' \0'))


def _names(reader: Any) -> List[str]:
    """Return a name for each point: LABELS, and those beyond 255 in LABELS2, LABELS3 and so on."""
    labels: List[str] = []
    for number in ('', *range(2, 100)):
        param = reader.get(f'POINT:LABELS{number}')
        if param is None:
            break
        labels += [label.strip(' \0') for label in np.ravel(param.string_array)]
    labels += [''] * int(reader.point_used)
    return [label or f'point {number}' for number, label in enumerate(labels[:int(reader.point_used)], 1)]


def _first_frame(reader: Any) -> int:
    """Return the number of the first frame; the library joins the two words of large ones wrongly."""
    param = reader.get('TRIAL:ACTUAL_START_FIELD')
    if param is None:
        return int(reader.header.first_frame)
    return sum(int(word) << 16 * place for place, word in enumerate(np.ravel(param.uint16_array)[:2]))
