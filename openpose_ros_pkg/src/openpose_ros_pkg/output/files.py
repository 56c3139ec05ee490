"""Files that are whole whenever somebody reads them, and names for frames."""
import os
from contextlib import suppress
from pathlib import Path

from openpose_ros_pkg.errors import ParameterError

# OpenPose, src/openpose/utilities/string.cpp and src/openpose/producer: numbers of frames have this many digits.
_DIGITS = 12


def frame_name(base: str, number: int) -> str:
    """Return the name that OpenPose gives a frame of a video or camera: `<base>_000000000012`, or the number alone.

    Args:
        base: of the video file or camera; '/' as in a ROS name becomes '_'. Empty: the number alone.
        number: of the frame, from 0.
    """
    base = base.strip('/').replace('/', '_')
    return f'{base}_{number:0{_DIGITS}d}' if base else f'{number:0{_DIGITS}d}'


def write_whole(path: Path, content: bytes) -> None:
    """Write a file beside its place and move it there, so that nobody ever reads half of it.

    Raises:
        OSError: it can not be written; nothing is left behind, and an older file stays as it was.
    """
    part = path.with_name(f'.{path.name}.part')
    try:
        part.write_bytes(content)
        part.replace(path)
    except BaseException:  # an interrupt as well: no half file stays
        with suppress(OSError):
            part.unlink()
        raise


def writable_folder(key: str, folder: Path) -> Path:
    """Return the folder, made if need be, after a file could be written in it.

    Args:
        key: parameter that names the folder, for the error.

    Raises:
        ParameterError: it can not be made or written to.
    """
    probe = folder / f'.write_test_{os.getpid()}'
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.write_bytes(b'')
        probe.unlink()
    except OSError as error:
        raise ParameterError(f"parameter '{key}': can not write into folder '{folder}' ({error.strerror})") from error
    return folder
