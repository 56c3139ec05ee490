"""Files of motion capture systems: tables of OptiTrack Motive (.csv), C3D (.c3d), TRC (.trc)."""
from pathlib import Path
from typing import Callable, Dict, Union

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.files import write_whole
from openpose_ros_tools.mocap.files.c3d_file import c3d_bytes, is_c3d, read_c3d
from openpose_ros_tools.mocap.files.motive import is_motive_csv, motive_csv_bytes, read_motive_csv
from openpose_ros_tools.mocap.files.recording import MarkerRecording
from openpose_ros_tools.mocap.files.text import decode
from openpose_ros_tools.mocap.files.trc import is_trc, read_trc, trc_bytes

# What makes a recording, under the name of its file, into bytes.
_WRITERS: Dict[str, Callable[[MarkerRecording, str], bytes]] = {
    '.csv': lambda recording, _: motive_csv_bytes(recording), '.c3d': lambda recording, _: c3d_bytes(recording),
    '.trc': trc_bytes}
SUFFIXES = tuple(_WRITERS)

__all__ = ['SUFFIXES', 'MarkerRecording', 'read_mocap', 'write_mocap']


def read_mocap(path: Union[str, Path]) -> MarkerRecording:
    """Read what a motion capture system recorded.

    The content decides on the format, and the file's suffix where that tells nothing.

    Raises:
        BadInputError: the file is missing, or of no known format; the text says what was expected.
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
            if is_trc(text) or (suffix == '.trc' and not is_motive_csv(text)):
                recording = read_trc(path, text)
            elif is_motive_csv(text) or suffix == '.csv':
                recording = read_motive_csv(path, text)
            else:
                raise BadInputError(f"{path} is no motion capture file that can be read: expected a table that Motive "
                                    f"exported (.csv), C3D (.c3d) or TRC (.trc); it starts with '{text[:40]!r}'")
    except ValueError as error:
        raise BadInputError(f'{path}: {error}') from error
    if not len(recording):
        raise BadInputError(f'{path} has a header, but no frames')
    return recording


def write_mocap(path: Union[str, Path], recording: MarkerRecording) -> None:
    """Write a recording in the format that the suffix tells.

    The times of a C3D file are whole multiples of the time between two frames.

    Raises:
        BadInputError: the suffix is none of `SUFFIXES`, or the format can not hold the recording.
    """
    path = Path(path)
    if path.suffix.lower() not in _WRITERS:
        raise BadInputError(f"{path}: the suffix says which format to write, expected one of {', '.join(SUFFIXES)}")
    content = _WRITERS[path.suffix.lower()](recording, path.name)
    try:
        write_whole(path, content)
    except OSError as error:
        raise BadInputError(f'{path} can not be written: {error.strerror}') from error
