"""Files and folders that appear whole or not at all: made under a temporary name, moved to their places at the end.

An output that is there already is never replaced unless the command is told to.
"""
import fcntl
import os
import shutil
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Callable, Iterator, List, NamedTuple, Optional, Sequence

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output.files import check_outputs, naming


class _Output(NamedTuple):
    part: Path
    path: Path
    move: Callable[[], object]  # to its place


class PartFiles:
    """The outputs of one piece of work, `.NAME.part` until they are moved; use it as a context manager.

    On leaving without an error they are moved to their places, in the order in which they were named; on an error or
    an interrupt they are deleted. What a killed process has left is overwritten. An OSError names the output.
    """

    def __init__(self) -> None:
        self._outputs: List[_Output] = []
        self._locks: List[int] = []  # open files

    def file(self, path: Path) -> Path:
        """Return the temporary path to write a file to; its folder is made.

        Raises:
            ParameterError: another program is making the same output.
        """
        part = _part(path)
        self._begin(_Output(part, path, lambda: part.replace(path)), os.O_RDWR | os.O_CREAT)
        os.truncate(str(part), 0)
        return part

    def folder(self, path: Path, is_own: Callable[[str], bool]) -> Path:
        """Return a new folder, whose content will be moved into the folder `path`, beside what is there already.

        Args:
            is_own: tells by its name whether a file there is one of this output; older ones are deleted.
        """
        part = _part(path)
        self._begin(_Output(part, path, lambda: _merge(part, path, is_own)), os.O_RDONLY, part.mkdir)
        for left in part.iterdir():
            _delete(left)
        return part

    def __enter__(self) -> 'PartFiles':
        return self

    def __exit__(self, kind: object, error: Optional[BaseException], _: object) -> None:
        try:
            if kind is None:
                self._move_all()
        except OSError as failed:
            self._name_output(failed)
            raise
        finally:
            if isinstance(error, OSError):
                self._name_output(error)
            for output in self._outputs:
                _delete(output.part)
            for lock in self._locks:
                os.close(lock)

    def _begin(self, output: _Output, flags: int, make: Callable[[], object] = lambda: None) -> None:
        self._outputs.append(output)  # before it is made: an interrupt may come between
        with suppress(FileExistsError):
            make()
        self._locks.append(os.open(str(output.part), flags, 0o666))
        try:
            fcntl.flock(self._locks[-1], fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._outputs.pop()
            raise ParameterError(f'another program is making {output.path}') from None
        except OSError:
            pass  # a file system without locks

    def _move_all(self) -> None:
        """Move all outputs one right after the other, when the disk has all of them."""
        for output in self._outputs:
            for file in filter(Path.is_file, (output.part, *output.part.rglob('*'))):
                with naming(file), file.open('rb') as handle:
                    os.fsync(handle.fileno())
        for output in self._outputs:
            output.move()

    def _name_output(self, error: OSError) -> None:
        for output in self._outputs:
            if str(error.filename).startswith(str(output.part)):
                error.filename = str(output.path) + str(error.filename)[len(str(output.part)):]


@contextmanager
def output_file(path: Path, overwrite: bool, inputs: Sequence[Path] = ()) -> Iterator[Path]:
    """Yield the path to write the only output of a command to.

    Args:
        inputs: which are never replaced.

    Raises:
        ParameterError: the file exists already, is a folder or an input.
        OSError: it can not be written, with its name; as for `output_folder`.
    """
    check_outputs([path], overwrite, inputs)
    with naming(path), PartFiles() as parts:
        yield parts.file(path)


@contextmanager
def output_folder(path: Path, overwrite: bool, own: Sequence[str]) -> Iterator[Path]:
    """Yield the folder to write the outputs of a command to.

    Args:
        path: of the folder; an empty one may exist.
        overwrite: whether an older one is replaced.
        own: names that a folder of this command contains; one with other files is never replaced.

    Raises:
        ParameterError: the folder exists already, or contains something else.
    """
    content = [item.name for item in files_of(path, lambda name: True)]
    if content and not overwrite:
        raise ParameterError(f'{path} is there already, with {len(content)} files or folders in it; give another '
                             'name, or --overwrite')
    foreign = [name for name in content if name not in own]
    if foreign:
        raise ParameterError(f"{path} holds '{foreign[0]}', which is not this command's, so it is not overwritten; "
                             'name another folder')
    with naming(path), PartFiles() as parts:
        yield parts.folder(path.resolve(), own.__contains__)


def files_of(folder: Path, is_own: Callable[[str], bool]) -> List[Path]:
    """Return what a folder has with names of an output, by name; nothing where the folder is not there.

    Raises:
        ParameterError: it is no folder.
    """
    if folder.exists() and not folder.is_dir():
        raise ParameterError(f'{folder} is a file; name a folder')
    return sorted(path for path in folder.iterdir() if is_own(path.name)) if folder.is_dir() else []


def _part(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path.with_name(f'.{path.name}.part')


def _merge(part: Path, path: Path, is_own: Callable[[str], bool]) -> None:
    path.mkdir(parents=True, exist_ok=True)
    former = files_of(path, is_own)
    made = {new.name for new in part.iterdir()}
    for old in former:
        if old.is_dir():  # a folder can not take the place of another one
            _delete(old)
    for new in part.iterdir():
        new.replace(path / new.name)
    for old in former:
        if old.name not in made:
            _delete(old)


def _delete(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()
