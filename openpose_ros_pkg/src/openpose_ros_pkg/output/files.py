"""Files that appear whole or not at all, names of frames, and checks of outputs."""
import itertools
import os
import re
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Iterator, List, Optional, Sequence

import numpy as np

from openpose_ros_pkg.errors import ParameterError

# OpenPose, src/openpose/utilities/string.cpp and src/openpose/producer: numbers of frames have this many digits.
_DIGITS = 12


def natural_key(path: Path) -> List[Any]:
    """Return a key that sorts names by their numbers, image2 before image10, and is never equal for two names."""
    return [[int(part) if i % 2 else part for i, part in enumerate(re.split(r'(\d+)', path.name.lower()))], path.name]


def numbered_name(base: str, number: int) -> str:
    """Return OpenPose's name of a frame, from 0, of a video or camera: `<base>_000000000012`, or the number alone.

    A '/' in the base, as in a ROS name, becomes '_'.
    """
    base = base.strip('/').replace('/', '_')
    return f'{base}_{number:0{_DIGITS}d}' if base else f'{number:0{_DIGITS}d}'


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Let an OSError of this block name the file: those of writing and closing do not."""
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside a file; at the end it is synchronized with the disk and replaces the file.

    On an error or interrupt the temporary file is deleted, and an older file stays as it was.

    Raises:
        OSError: the file can not be written; the error names `path`.
    """
    part = path.with_name(f'.{path.name}.{os.getpid()}.part')  # of this process: several may write the same file
    try:
        yield part
        with part.open('rb') as handle:
            os.fsync(handle.fileno())
        part.replace(path)
    except BaseException as error:
        with suppress(OSError):
            part.unlink()
        if isinstance(error, OSError) and error.filename in (None, str(part)):
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise


def write_whole(path: Path, content: bytes) -> None:
    """Write a file with this content; see `written_whole`."""
    with written_whole(path) as part:
        part.write_bytes(content)


def write_image(path: Path, image: np.ndarray, quality: int = 95) -> None:
    """Write an image, (H, W) or (H, W, 3), like `write_whole`; the suffix is the format, `quality` is of JPEG."""
    import cv2  # takes 0.2 s, which programs without images do not need

    write_whole(path, cv2.imencode(path.suffix, image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes())


def jpeg_of(bgr: np.ndarray, quality: int, width: Optional[int] = None) -> bytes:
    """Return the JPEG, of a quality of 1 to 100, of a (H, W, 3) uint8 image, made as small as `width` [px]."""
    import cv2

    if width is not None and width < bgr.shape[1]:
        height = max(round(bgr.shape[0] * width / bgr.shape[1]), 1)
        bgr = cv2.resize(bgr, (width, height), interpolation=cv2.INTER_AREA)
    return bytes(cv2.imencode('.jpg', bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes())


def check_outputs(paths: Sequence[Path], overwrite: bool, inputs: Sequence[Path] = ()) -> None:
    """Raise ParameterError if an output of a command is an input, a folder, or exists while `overwrite` is False."""
    read = {path.resolve() for path in inputs}
    for path in paths:
        if path.resolve() in read:
            raise ParameterError(f'{path} is an input; name another file')
        if path.exists() and not path.is_file():
            raise ParameterError(f"{path} is {'a folder' if path.is_dir() else 'no plain file'}; name a file")
        if os.path.lexists(str(path)) and not overwrite:
            raise ParameterError(f'{path} is there already; give another name, or --overwrite')


def free_name(path: Path) -> Path:
    """Return the path, or the first of NAME_2.SUFFIX, NAME_3.SUFFIX ... that does not exist."""
    numbered = (path.with_name(f'{path.stem}_{number}{path.suffix}') for number in itertools.count(2))
    return next(name for name in itertools.chain((path,), numbered) if not os.path.lexists(str(name)))


def writable_folder(key: str, folder: Path) -> Path:
    """Return the folder of a parameter, made if need be; ParameterError: no file can be written in it."""
    probe = folder / f'.write_test_{os.getpid()}'
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.write_bytes(b'')
        probe.unlink()
    except OSError as error:
        raise ParameterError(f"parameter '{key}': can not write into folder '{folder}' ({error.strerror})") from error
    return folder
