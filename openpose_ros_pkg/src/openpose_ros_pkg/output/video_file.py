"""Videos, frame by frame."""
from pathlib import Path
from typing import Optional, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.errors import ParameterError

# Codecs that OpenCV's own packages bring along, and that players know.
_CODECS = {'.mp4': 'mp4v', '.avi': 'MJPG'}


class VideoFile:
    """A video that is written; all frames have the size of the first.

    Use it as a context manager, or call `close`: only then is the file complete.

    Args:
        path: ends in .mp4 (MPEG-4) or .avi (motion JPEG).
        rate: frames per second [Hz].

    Raises:
        ParameterError: the path ends otherwise.
    """

    def __init__(self, path: Path, rate: float) -> None:
        if path.suffix.lower() not in _CODECS:
            raise ParameterError(f"video '{path}': expected a file ending in {' or '.join(_CODECS)}")
        self.path = path
        self._rate = rate
        self._writer: Optional[cv2.VideoWriter] = None
        self._size = (0, 0)

    def __enter__(self) -> 'VideoFile':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write(self, bgr: np.ndarray) -> None:
        """Add a frame. One of another size is fitted in with its aspect kept, the rest is black.

        Args:
            bgr: (H, W, 3) uint8 BGR.

        Raises:
            OSError: OpenCV can not write there.
        """
        if self._writer is None:
            self._size = (bgr.shape[1], bgr.shape[0])
            writer = cv2.VideoWriter(str(self.path), cv2.VideoWriter_fourcc(*_CODECS[self.path.suffix.lower()]),
                                     self._rate, self._size)
            if not writer.isOpened():
                raise OSError(f'OpenCV can not write the video {self.path} of {self._size[0]}x{self._size[1]} pixels')
            self._writer = writer
        self._writer.write(_fitted(bgr, self._size))

    def close(self) -> None:
        """Complete the file.

        Raises:
            OSError: frames were written, but the file is empty or gone.
        """
        if self._writer is None:
            return
        self._writer.release()
        self._writer = None
        # OpenCV does not tell of failed writes, as on a full disk
        if not self.path.is_file() or self.path.stat().st_size == 0:
            raise OSError(f'the video {self.path} could not be written')


def _fitted(bgr: np.ndarray, size: Tuple[int, int]) -> np.ndarray:
    """Return the image in the middle of a canvas of (width, height)."""
    height, width = bgr.shape[:2]
    if (width, height) == size:
        return bgr
    factor = min(size[0] / width, size[1] / height)
    fitted = (min(max(round(width * factor), 1), size[0]), min(max(round(height * factor), 1), size[1]))
    left, top = (size[0] - fitted[0]) // 2, (size[1] - fitted[1]) // 2
    canvas = np.zeros((size[1], size[0], 3), np.uint8)
    canvas[top:top + fitted[1], left:left + fitted[0]] = cv2.resize(bgr, fitted, interpolation=cv2.INTER_AREA)
    return canvas
