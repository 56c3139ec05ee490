"""Files and folders that appear whole or not at all: made under a temporary name, moved to their places at the end.

An output that is there already is never replaced unless the command is told to.
"""
import errno
import glob
import os
import shutil
import uuid
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Callable, Iterator, List, Optional, Sequence, Tuple

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output.files import check_outputs, naming


class PartFiles:
    """The outputs of one piece of work; use it as a context manager.

    On leaving without an error they are moved to their places, in the order in which they were named; on an error or
    an interrupt they are deleted. An OSError names the output, not its temporary path.

    Args:
        run: of `new_run`, if `delete_parts` is to find what a killed process leaves; empty: one of its own.
    """

    def __init__(self, run: str = '') -> None:
        self._run = run or new_run()
        self._outputs: List[Tuple[Path, Path, Callable[[], object]]] = []  # temporary path, place, and what moves it

    def file(self, path: Path) -> Path:
        """Return the temporary path to write a file to; its folder is made."""
        part = self._part(path, lambda: part.replace(path))
        part.touch(exist_ok=False)
        return part

    def folder(self, path: Path, is_own: Callable[[str], bool]) -> Path:
        """Return a new folder; its files will be moved into `path`, where older files with own names are deleted."""
        part = self._part(path, lambda: _merge(part, path, is_own))
        part.mkdir()
        return part

    def new_folder(self, path: Path) -> Path:
        """Return a new folder that will take the place of the folder `path`."""
        part = self._part(path, lambda: _exchange(part, path))
        part.mkdir()
        return part

    def scratch_folder(self, path: Path) -> Path:
        """Return a new folder for intermediate files of an output, which is deleted at the end."""
        part = self._part(path, lambda: None)
        part.mkdir()
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
            for part, _path, _move in self._outputs:
                _delete(part)

    def _part(self, path: Path, move: Callable[[], object]) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(f'.{path.name}.{self._run}-{len(self._outputs)}.part')
        self._outputs.append((part, path, move))
        _delete(part)  # a killed worker of this run may have left it
        return part

    def _move_all(self) -> None:
        """Move all outputs one right after the other, when the disk has all of them."""
        for part, _, _ in self._outputs:
            if not part.exists():
                raise FileNotFoundError(errno.ENOENT, 'another program deleted it', str(part))
            for file in filter(Path.is_file, (part, *part.rglob('*'))):
                with naming(file), file.open('rb') as handle:
                    os.fsync(handle.fileno())
        for _, _, move in self._outputs:
            move()

    def _name_output(self, error: OSError) -> None:
        for part, path, _ in self._outputs:
            if str(error.filename).startswith(str(part)):
                error.filename = str(path) + str(error.filename)[len(str(part)):]


@contextmanager
def output_file(path: Path, overwrite: bool, inputs: Sequence[Path] = ()) -> Iterator[Path]:
    """Yield the path to write the only output of a command to.

    Raises:
        ParameterError: the file exists already, is a folder or an input, or can not be written.
    """
    check_outputs([path], overwrite, inputs)
    with _write_errors(path), PartFiles() as parts:
        yield parts.file(path)


@contextmanager
def output_folder(path: Path, overwrite: bool, own: Sequence[str]) -> Iterator[Path]:
    """Yield the folder to write the outputs of a command to; one with names that are not its own is never replaced.

    Raises:
        ParameterError: the folder exists already, contains something else, or can not be written.
    """
    content = [file.name for file in files_of(path, lambda _: True)]
    if content and not overwrite:
        raise ParameterError(f'{path} is there already, with {len(content)} files or folders in it; give another '
                             'name, or --overwrite')
    foreign = [name for name in content if name not in own]
    if foreign:
        raise ParameterError(f"{path} holds '{foreign[0]}', which is not this command's, so it is not overwritten; "
                             'name another folder')
    with _write_errors(path), PartFiles() as parts:
        yield parts.new_folder(path.resolve())


def files_of(folder: Path, is_own: Callable[[str], bool]) -> List[Path]:
    """Return the files of a folder with own names, sorted; none where it is not there. ParameterError: it is a file."""
    if folder.exists() and not folder.is_dir():
        raise ParameterError(f'{folder} is a file; name a folder')
    return sorted(path for path in folder.iterdir() if is_own(path.name)) if folder.is_dir() else []


def new_run() -> str:
    """Return an identifier for the parts of a run."""
    return uuid.uuid4().hex[:8]


def delete_parts(path: Path, run: str) -> None:
    """Delete what a run has left of an unfinished output, also where a worker of it still writes."""
    for part in path.parent.glob(f'.{glob.escape(path.name)}.{run}-*.part'):
        _delete(part)


@contextmanager
def _write_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ParameterError(f'{error.filename or path} can not be written: {error.strerror or error}') from error


def _merge(part: Path, path: Path, is_own: Callable[[str], bool]) -> None:
    new = {file.name for file in part.iterdir()}
    path.mkdir(parents=True, exist_ok=True)
    for name in new:
        (part / name).replace(path / name)
    for file in files_of(path, is_own):
        if file.name not in new:
            file.unlink()


def _exchange(part: Path, path: Path) -> None:
    _delete(path)
    part.replace(path)


def _delete(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()
