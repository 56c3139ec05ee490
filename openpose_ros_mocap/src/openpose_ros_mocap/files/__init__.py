"""Files of motion capture systems: tables of OptiTrack Motive (.csv), C3D (.c3d), TRC (.trc)."""
from pathlib import Path
from typing import Union

from openpose_ros_mocap.files.c3d_file import c3d_bytes, is_c3d, read_c3d
from openpose_ros_mocap.files.motive import is_motive_csv, motive_csv_bytes, read_motive_csv
from openpose_ros_mocap.files.recording import MarkerRecording
from openpose_ros_mocap.files.text import decode
from openpose_ros_mocap.files.trc import is_trc, read_trc, trc_bytes
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.files import write_whole

SUFFIXES = ('.csv', '.c3d', '.trc')

__all__ = ['SUFFIXES', 'MarkerRecording', 'read_mocap', 'write_c3d', 'write_mocap', 'write_motive_csv', 'write_trc']


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
    if suffix == '.c3d' or is_c3d(content):
        recording = read_c3d(path, content)
    else:
        start = decode(path, content[:4096])
        if is_trc(start) or (suffix == '.trc' and not is_motive_csv(start)):
            recording = read_trc(path, content)
        elif is_motive_csv(start) or suffix == '.csv':
            recording = read_motive_csv(path, content)
        else:
            raise BadInputError(f"{path} is no motion capture file that can be read: expected a table that Motive "
                                f"exported (.csv), C3D (.c3d) or TRC (.trc); it starts with '{start[:40]!r}'")
    if not len(recording):
        raise BadInputError(f'{path} has a header, but no frames')
    return recording


def write_mocap(path: Union[str, Path], recording: MarkerRecording) -> None:
    """Write a recording in the format that the suffix tells.

    Raises:
        BadInputError: the suffix is none of `SUFFIXES`, or the format can not hold the recording.
    """
    writers = {'.csv': write_motive_csv, '.c3d': write_c3d, '.trc': write_trc}
    path = Path(path)
    if path.suffix.lower() not in writers:
        raise BadInputError(f"{path}: the suffix says which format to write, expected one of {', '.join(SUFFIXES)}")
    writers[path.suffix.lower()](path, recording)


def write_motive_csv(path: Union[str, Path], recording: MarkerRecording) -> None:
    """Write a table as Motive exports it."""
    _write(path, motive_csv_bytes(recording))


def write_c3d(path: Union[str, Path], recording: MarkerRecording) -> None:
    """Write a C3D file; its times are whole multiples of the time between two frames."""
    _write(path, c3d_bytes(recording))


def write_trc(path: Union[str, Path], recording: MarkerRecording) -> None:
    """Write a TRC file."""
    _write(path, trc_bytes(recording, Path(path).name))


def _write(path: Union[str, Path], content: bytes) -> None:
    try:
        write_whole(Path(path), content)
    except OSError as error:
        raise BadInputError(f'{path} can not be written: {error.strerror}') from error
