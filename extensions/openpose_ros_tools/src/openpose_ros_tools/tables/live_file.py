"""A text file for live data, which can not be made again: what was written stays, whatever happens then."""
import errno
import fcntl
import io
import os
from pathlib import Path

from openpose_ros_pkg.output.files import naming


class LiveFile(io.TextIOBase):
    """A text file that has each write when it returns, whole or not at all; use it as a context manager.

    Args:
        path: of the file; no other program writes it at the same time.
        overwrite: whether one that is there is replaced.

    Attributes:
        lines: number of lines that the file has.

    Raises:
        OSError: with the name of the file.
    """

    def __init__(self, path: Path, overwrite: bool) -> None:
        super().__init__()
        self._path, self._size, self.lines = path, 0, 0
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = os.open(str(path), os.O_WRONLY | os.O_CREAT | (0 if overwrite else os.O_EXCL), 0o666)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self.close()
            raise BlockingIOError(errno.EAGAIN, 'another program is writing it', str(path)) from None
        except OSError:
            pass  # a file system without locks
        with naming(path):
            os.ftruncate(self._file, 0)

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, text: str) -> int:
        """Write some lines; after an error the file ends with those before.

        Raises:
            OSError: they can not be written, with the name of the file.
        """
        rest = memoryview(text.encode())
        size = self._size + len(rest)
        try:
            with naming(self._path):
                while rest:
                    rest = rest[os.write(self._file, rest):]
            self._size = size
        except BaseException:  # an interrupt as well
            os.ftruncate(self._file, self._size)
            os.lseek(self._file, self._size, os.SEEK_SET)
            raise
        self.lines += text.count('\n')
        return len(text)

    def close(self) -> None:
        """Wait until the disk has the file."""
        if not self.closed:
            super().close()
            try:
                with naming(self._path):
                    os.fsync(self._file)
            finally:
                os.close(self._file)
