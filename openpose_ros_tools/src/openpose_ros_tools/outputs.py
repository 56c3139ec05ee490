"""Files and folders that appear whole or not at all: made under a temporary name, moved to their places at the end."""
import errno
import glob
import os
import shutil
import socket
import uuid
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Callable, Iterator, List, Optional, Sequence, Tuple

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output.files import naming


class PartFiles:
    """The outputs of one piece of work; use it as a context manager.

    On leaving without an error they are moved to their places, in the order in which they were named; on an error or
    an interrupt they are deleted. Temporary names contain the name of the output, so that the next run can delete what
    a killed process has left, and are unique even within a process: a cluster's worker may still write an output that
    another thread begins anew; it then finds nothing to move. Methods raise OSError where nothing can be written; such
    errors, and those of the block that name a temporary path, name the output.
    """

    def __init__(self) -> None:
        self._moves: List[Tuple[Path, Path, Callable[[Path], object]]] = []

    def file(self, path: Path) -> Path:
        """Return the temporary path to write a file to; its folder is made."""
        return self._part(path, lambda part: _move(part, path))

    def folder(self, path: Path, is_old: Callable[[str], bool] = lambda name: False) -> Path:
        """Return a new folder, whose files will be moved into the folder `path`, beside the files that it has already.

        Args:
            is_old: tells by its name whether a file there is of an earlier run, and is deleted.
        """
        part = self._part(path, lambda part: _merge(part, path, is_old))
        part.mkdir()
        return part

    def new_folder(self, path: Path) -> Path:
        """Return a new folder that will take the place of the folder `path`."""
        part = self._part(path, lambda part: _exchange(part, path))
        part.mkdir()
        return part

    def __enter__(self) -> 'PartFiles':
        return self

    def __exit__(self, kind: object, error: Optional[BaseException], _: object) -> None:
        try:
            if kind is None:
                for part, _path, move in self._moves:
                    move(part)
        except OSError as failed:
            self._name_output(failed)
            raise
        finally:
            if isinstance(error, OSError):
                self._name_output(error)
            for part, _path, _move in self._moves:
                _delete(part)

    def _part(self, path: Path, move: Callable[[Path], object]) -> Path:
        """Return the temporary path of an output, after unfinished ones of earlier runs are deleted."""
        path.parent.mkdir(parents=True, exist_ok=True)
        delete_parts(path)
        part = path.with_name(f'.{path.name}.{socket.gethostname()}-{os.getpid()}-{uuid.uuid4().hex[:8]}.part')
        self._moves.append((part, path, move))
        return part

    def _name_output(self, error: OSError) -> None:
        """Let an error that names a temporary path name the output instead."""
        for part, path, _ in self._moves:
            if str(error.filename).startswith(str(part)):
                error.filename = str(path) + str(error.filename)[len(str(part)):]


@contextmanager
def output_file(path: Path, overwrite: bool) -> Iterator[Path]:
    """Yield the path to write the only output of a command to.

    Raises:
        ParameterError: the file exists already, is a folder, or can not be written.
    """
    if path.is_dir():
        raise ParameterError(f'{path} is a folder; name a file')
    if path.exists() and not overwrite:
        raise ParameterError(f'{path} is there already; name another file, or give --overwrite')
    with _told(path), PartFiles() as parts:
        yield parts.file(path)


@contextmanager
def output_folder(path: Path, overwrite: bool, own: Sequence[str]) -> Iterator[Path]:
    """Yield the folder to write the outputs of a command to.

    Args:
        path: of the folder; an empty one may exist.
        overwrite: whether an older one is replaced.
        own: names that a folder of this command contains; one with other files is never replaced.

    Raises:
        ParameterError: the folder exists already, contains something else, or can not be written.
    """
    content = sorted(item.name for item in path.iterdir()) if path.is_dir() else []
    if path.exists() and not path.is_dir():
        raise ParameterError(f'{path} is a file; name a folder')
    if content and not overwrite:
        raise ParameterError(f'{path} is there already, with {len(content)} files or folders in it; name another one, '
                             'or give --overwrite')
    foreign = [name for name in content if name not in own]
    if foreign:
        raise ParameterError(f"{path} holds '{foreign[0]}', which is not this command's, so it is not overwritten; "
                             'name another folder')
    with _told(path), PartFiles() as parts:
        yield parts.new_folder(path.resolve())


def delete_parts(path: Path) -> None:
    """Delete unfinished outputs for this path."""
    for part in path.parent.glob(f'.{glob.escape(path.name)}.*.part'):
        _delete(part)


@contextmanager
def _told(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ParameterError(f'{error.filename or path} can not be written: {error.strerror or error}') from error


def _move(part: Path, path: Path) -> None:
    """Move a file to its place when the disk has it."""
    if not part.exists():
        raise FileNotFoundError(errno.ENOENT, 'another program began to write it, or deleted it', str(part))
    _sync(part)
    part.replace(path)


def _sync(path: Path) -> None:
    """Wait until the disk has a file."""
    if path.is_file():
        with naming(path), path.open('rb') as handle:
            os.fsync(handle.fileno())


def _merge(part: Path, path: Path, is_old: Callable[[str], bool]) -> None:
    new = {file.name for file in part.iterdir()}
    path.mkdir(parents=True, exist_ok=True)
    for name in new:
        _move(part / name, path / name)
    for file in path.iterdir():
        if file.name not in new and is_old(file.name):
            file.unlink()


def _exchange(part: Path, path: Path) -> None:
    for file in part.rglob('*'):
        _sync(file)
    old = path.with_name(f'{part.name[:-len(".part")]}.old.part')
    if path.exists():
        path.replace(old)
    part.replace(path)
    _delete(old)


def _delete(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()
