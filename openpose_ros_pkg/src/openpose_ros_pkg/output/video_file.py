"""Video files, written frame by frame."""
import errno
import os
import resource
from pathlib import Path
from typing import Optional, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output.files import free_name, naming

# Codecs of OpenCV's own packages that players know.
_CODECS = {'.mp4': 'mp4v', '.avi': 'MJPG'}
# OpenCV reports no failed write, and a video without its end can hardly be read: frames are refused while there is less
# room than FFmpeg's buffers (at most 1 MiB seen) and the index at the end need [bytes; bytes per frame].
_RESERVE, _INDEX = 4 << 20, 64


class VideoFile:
    """A video that is written; all frames have the size of the first. `close` completes and verifies it.

    Args:
        path: ends in .mp4 (MPEG-4; unreadable if the program is killed) or .avi (motion JPEG; then readable up to the
            last 0.3 MB).
        rate: frames per second [Hz].
        keep: whether an existing file stays; the video then gets a number: NAME_2.mp4.

    Attributes:
        path: of the video, when it has a frame.
        frames: number of frames in the video.
        lost: number of frames that were lost with it.

    Raises:
        ParameterError: the path has another suffix.
    """

    def __init__(self, path: Path, rate: float, keep: bool = False) -> None:
        if path.suffix.lower() not in _CODECS:
            raise ParameterError(f"video '{path}': expected a file ending in {' or '.join(_CODECS)}")
        self.path = path
        self.frames = self.lost = 0
        self._rate, self._keep = rate, keep
        self._writer: Optional[cv2.VideoWriter] = None
        self._size = (0, 0)

    def __enter__(self) -> 'VideoFile':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write(self, bgr: np.ndarray) -> None:
        """Add a frame, (H, W, 3) uint8 BGR; one of another size is fitted with its aspect kept, on black.

        Raises:
            OSError: with the file and the reason; the frame is not in the video, later ones may be.
        """
        self._check_room()
        writer = self._writer or self._open((bgr.shape[1], bgr.shape[0]))
        writer.write(_fitted(bgr, self._size))
        self.frames += 1

    def close(self) -> None:
        """Complete the file, and verify that its frames can be read.

        Raises:
            OSError: they can not; a file without readable frames is deleted.
        """
        if self._writer is None:
            return
        written, self.frames = self.frames, 0
        self.lost += written  # until they are read back
        self._writer.release()
        self._writer = None
        with naming(self.path):
            with self.path.open('rb') as handle:
                os.fsync(handle.fileno())
            readable = _readable_frames(self.path)
            self.frames = min(readable or 0, written)
            self.lost -= self.frames
            if readable is None:
                self.path.unlink()
            if self.frames < written:
                what = ('the end is missing, players may show a part' if readable == 0 else
                        f'{self.frames} of {written} frames can be read')
                raise OSError(errno.EIO, f'the video is damaged: {what}')

    def _open(self, size: Tuple[int, int]) -> cv2.VideoWriter:
        if self._keep:
            self.path = free_name(self.path)
        with naming(self.path), self.path.open('ab') as file:  # fails where OpenCV would only not open
            is_new = file.tell() == 0
        writer = cv2.VideoWriter(str(self.path), cv2.VideoWriter_fourcc(*_CODECS[self.path.suffix.lower()]), self._rate,
                                 size)
        if not writer.isOpened():
            if is_new:
                self.path.unlink()
            raise OSError(errno.EINVAL, f'OpenCV can not write a video of {size[0]}x{size[1]} pixels', str(self.path))
        self._writer, self._size = writer, size
        return writer

    def _check_room(self) -> None:
        """Raise OSError if the disk or the process's limit of file size has no room to complete the file."""
        needed = _RESERVE + _INDEX * self.frames
        disk = os.statvfs(str(self.path.parent))
        if disk.f_blocks and disk.f_bavail * disk.f_frsize < needed:
            raise OSError(errno.ENOSPC, f'{os.strerror(errno.ENOSPC)}: a video needs {needed >> 20} MB to be completed',
                          str(self.path))
        limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
        size = 0 if self._writer is None else self.path.stat().st_size
        if limit != resource.RLIM_INFINITY and size + needed > limit:
            raise OSError(errno.EFBIG, os.strerror(errno.EFBIG), str(self.path))


def _readable_frames(path: Path) -> Optional[int]:
    """Return a video's number of frames by its index; 0: only the first can be read, None: no frame can."""
    capture = cv2.VideoCapture(str(path))
    try:
        if not capture.read()[0]:
            return None
        count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        if count < 2:
            return max(count, 0)
        capture.set(cv2.CAP_PROP_POS_FRAMES, count - 1)
        return count if capture.read()[0] else 0
    finally:
        capture.release()


def _fitted(bgr: np.ndarray, size: Tuple[int, int]) -> np.ndarray:
    """Return the image fitted into a black canvas of (width, height), centred."""
    height, width = bgr.shape[:2]
    if (width, height) == size:
        return bgr
    factor = min(size[0] / width, size[1] / height)
    fitted = (min(max(round(width * factor), 1), size[0]), min(max(round(height * factor), 1), size[1]))
    left, top = (size[0] - fitted[0]) // 2, (size[1] - fitted[1]) // 2
    canvas = np.zeros((size[1], size[0], 3), np.uint8)
    canvas[top:top + fitted[1], left:left + fitted[0]] = cv2.resize(bgr, fitted, interpolation=cv2.INTER_AREA)
    return canvas
