"""The one folder that a command writes: whole, or not there."""
import shutil
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator, Sequence

from openpose_ros_pkg.errors import ParameterError


@contextmanager
def output_folder(path: Path, overwrite: bool, own: Sequence[str]) -> Iterator[Path]:
    """Give the folder to write to; it is in its place when the block ends, and gone if that ends with an error.

    Args:
        path: of the folder; an empty one may be there.
        overwrite: whether an older one is replaced.
        own: names that a folder of this kind holds; one with other files is never replaced.

    Raises:
        ParameterError: the folder is there already, holds something else, or can not be written.
    """
    held = sorted(item.name for item in path.iterdir()) if path.is_dir() else []
    if path.exists() and not path.is_dir():
        raise ParameterError(f'{path} is a file; name a folder')
    if held and not overwrite:
        raise ParameterError(f'{path} is there already, with {len(held)} files or folders in it; name another one, or '
                             'give --overwrite')
    foreign = [name for name in held if name not in own]
    if foreign:
        raise ParameterError(f"{path} holds '{foreign[0]}', which is not this command's, so it is not overwritten; "
                             'name another folder')
    path = path.resolve()
    part, old = path.with_name(f'.{path.name}.part'), path.with_name(f'.{path.name}.old')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir()
        yield part
        shutil.rmtree(old, ignore_errors=True)
        if path.exists():
            path.replace(old)
        part.replace(path)
        shutil.rmtree(old, ignore_errors=True)
    except OSError as error:
        raise ParameterError(f'{path} can not be written: {error.strerror or error}') from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
