"""Files of motion capture systems: tables of OptiTrack Motive (.csv), C3D (.c3d), TRC (.trc)."""
import csv
from pathlib import Path
from typing import Union

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.mocap.files.c3d_file import is_c3d, read_c3d
from openpose_ros_tools.mocap.files.recording import MarkerRecording
from openpose_ros_tools.mocap.files.tables import MOTIVE_KEY, TRC_KEY, decode, read_motive_csv, read_trc

__all__ = ['MarkerRecording', 'read_mocap']


def read_mocap(path: Union[str, Path]) -> MarkerRecording:
    """Read the markers of a recording; the content decides on the format, then the file's suffix.

    Raises:
        BadInputError: the file is missing, of no known format, or damaged.
    """
    path = Path(path).expanduser()
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadInputError(f'{path} can not be read: {error.strerror}') from error
    if not content:
        raise BadInputError(f'{path} is empty')
    suffix = path.suffix.lower()
    try:
        if suffix == '.c3d' or is_c3d(content):
            recording = read_c3d(path, content)
        else:
            text = decode(path, content)
            if text.startswith(TRC_KEY) or (suffix == '.trc' and not text.startswith(MOTIVE_KEY)):
                recording = read_trc(path, text)
            elif text.startswith(MOTIVE_KEY) or suffix == '.csv':
                recording = read_motive_csv(path, text)
            else:
                raise BadInputError(f"{path} is no motion capture file that can be read: expected a table that Motive "
                                    f"exported (.csv), C3D (.c3d) or TRC (.trc); it starts with '{text[:40]!r}'")
    except (csv.Error, ValueError) as error:
        raise BadInputError(f'{path}: {error}') from error
    if not len(recording):
        raise BadInputError(f'{path} has a header, but no frames')
    return recording
