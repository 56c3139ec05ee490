"""Outputs that appear whole, all at once: made under other names beside their places, and moved there at the end."""
import glob
import os
import shutil
import socket
from contextlib import suppress
from pathlib import Path
from typing import List, Tuple


class PartFiles:
    """The outputs of one piece of work; for `with`.

    On leaving without an error they are moved to their places, in the order in which they were named; with one, or an
    interrupt, they are deleted. Whoever makes the same outputs anew deletes what a process that was killed has left:
    the temporary names tell what is made, and by whom.
    """

    def __init__(self) -> None:
        self._files: List[Tuple[Path, Path]] = []
        self._folders: List[Tuple[Path, Path]] = []

    def file(self, path: Path) -> Path:
        """Return the path under which to write a file for now; its folder is made.

        Raises:
            OSError: the folder can not be made.
        """
        return self._part(self._files, path)

    def folder(self, path: Path) -> Path:
        """Return a new folder for files that will be moved into the folder `path`, among what may be there already.

        Raises:
            OSError: it can not be made.
        """
        part = self._part(self._folders, path)
        part.mkdir()
        return part

    def __enter__(self) -> 'PartFiles':
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        try:
            if kind is None:
                self._move()
        finally:
            for part, _path in self._folders:
                shutil.rmtree(part, ignore_errors=True)
            for part, _path in self._files:
                with suppress(OSError):
                    part.unlink()

    def _part(self, parts: List[Tuple[Path, Path]], path: Path) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        delete_parts(path)
        part = path.with_name(f'.{path.name}.{socket.gethostname()}-{os.getpid()}.part')
        parts.append((part, path))
        return part

    def _move(self) -> None:
        for part, path in self._folders:
            path.mkdir(parents=True, exist_ok=True)
            for file in sorted(part.iterdir()):
                file.replace(path / file.name)
        for part, path in self._files:
            part.replace(path)


def delete_parts(path: Path) -> None:
    """Delete what was begun for this path and not finished."""
    for part in path.parent.glob(f'.{glob.escape(path.name)}.*.part'):
        if part.is_dir():
            shutil.rmtree(part, ignore_errors=True)
        else:
            with suppress(OSError):
                part.unlink()
