"""The one file that a command writes: whole, or not there."""
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_tools.outputs.part_files import PartFiles


@contextmanager
def output_file(path: Path, overwrite: bool) -> Iterator[Path]:
    """Give the path to write to; the file is in its place when the block ends, and gone if that ends with an error.

    Raises:
        ParameterError: the file is there already, is a folder, or can not be written.
    """
    if path.is_dir():
        raise ParameterError(f'{path} is a folder; name a file')
    if path.exists() and not overwrite:
        raise ParameterError(f'{path} is there already; name another file, or give --overwrite')
    try:
        with PartFiles() as parts:
            yield parts.file(path)
    except OSError as error:
        raise ParameterError(f'{path} can not be written: {error.strerror or error}') from error
