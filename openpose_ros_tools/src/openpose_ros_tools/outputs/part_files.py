"""Outputs that appear whole, all at once: made under other names beside their places, and moved there at the end."""
import glob
import os
import shutil
import socket
import uuid
from contextlib import suppress
from pathlib import Path
from typing import Callable, List, Tuple


class PartFiles:
    """The outputs of one piece of work; for `with`.

    On leaving without an error they are moved to their places, in the order in which they were named; with one, or an
    interrupt, they are deleted. Whoever makes the same outputs anew deletes what a process that was killed has left:
    the temporary names tell what is made, and by whom. No two are equal, also in one process: who makes the same in
    another thread, as a cluster's worker may after the client has gone, is left with nothing to move.
    """

    def __init__(self) -> None:
        self._files: List[Tuple[Path, Path]] = []
        self._folders: List[Tuple[Path, Path, Callable[[str], bool]]] = []

    def file(self, path: Path) -> Path:
        """Return the path under which to write a file for now; its folder is made.

        Raises:
            OSError: the folder can not be made.
        """
        part = _part(path)
        self._files.append((part, path))
        return part

    def folder(self, path: Path, is_old: Callable[[str], bool] = lambda name: False) -> Path:
        """Return a new folder for files that will be moved into the folder `path`, among what may be there already.

        Args:
            is_old: says by its name whether a file there is of an earlier run, and goes when the new ones come.

        Raises:
            OSError: it can not be made.
        """
        part = _part(path)
        self._folders.append((part, path, is_old))
        part.mkdir()
        return part

    def __enter__(self) -> 'PartFiles':
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        try:
            if kind is None:
                self._move()
        finally:
            for part, _path, _is_old in self._folders:
                shutil.rmtree(part, ignore_errors=True)
            for part, _path in self._files:
                with suppress(OSError):
                    part.unlink()

    def _move(self) -> None:
        for part, path, is_old in self._folders:
            made = sorted(part.iterdir())
            path.mkdir(parents=True, exist_ok=True)
            for file in made:
                file.replace(path / file.name)
            for name in {file.name for file in path.iterdir()} - {file.name for file in made}:
                if is_old(name):
                    (path / name).unlink()
        for part, path in self._files:
            part.replace(path)


def _part(path: Path) -> Path:
    """Return a name for what will be moved to a path, after what others have left there is deleted."""
    path.parent.mkdir(parents=True, exist_ok=True)
    delete_parts(path)
    return path.with_name(f'.{path.name}.{socket.gethostname()}-{os.getpid()}-{uuid.uuid4().hex[:8]}.part')


def delete_parts(path: Path) -> None:
    """Delete what was begun for this path and not finished."""
    for part in path.parent.glob(f'.{glob.escape(path.name)}.*.part'):
        if part.is_dir():
            shutil.rmtree(part, ignore_errors=True)
        else:
            with suppress(OSError):
                part.unlink()
