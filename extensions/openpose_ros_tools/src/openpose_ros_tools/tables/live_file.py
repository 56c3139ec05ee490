"""A text file for live data, which can not be made again: rows stay, whatever happens after they were written."""
import io
from pathlib import Path

from openpose_ros_pkg.output.files import naming


class LiveFile(io.TextIOBase):
    """A text file that has each write when it returns, whole or not at all; use it as a context manager.

    Args:
        path: of the file.
        overwrite: whether one that is there is replaced.

    Attributes:
        lines: number of lines that the file has.

    Raises:
        OSError: with the name of the file.
    """

    def __init__(self, path: Path, overwrite: bool) -> None:
        super().__init__()
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path, self.lines = path, 0
        self._file = path.open('wb' if overwrite else 'xb', buffering=0)

    def write(self, text: str) -> int:
        """Write some lines; after an error the file ends with the lines before.

        Raises:
            OSError: they can not be written, with the name of the file.
        """
        size, rest = self._file.tell(), memoryview(text.encode())
        try:
            with naming(self._path):
                while rest:
                    rest = rest[self._file.write(rest):]
        except BaseException:  # an interrupt as well
            self._file.truncate(size)
            self._file.seek(size)
            raise
        self.lines += text.count('\n')
        return len(text)

    def close(self) -> None:
        """Close the file."""
        super().close()
        with naming(self._path):
            self._file.close()
