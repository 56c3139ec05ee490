"""Video files, written frame by frame."""
import errno
import fcntl
import os
import resource
from pathlib import Path
from typing import BinaryIO, Optional, Tuple

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
    """A video that is written; all frames have the size of the first.

    A context manager; `close` completes and verifies the file. If it is deleted meanwhile, its frames are lost and
    the next frame begins a new one.

    Args:
        path: ends in .mp4 (MPEG-4; unreadable if the program is killed) or .avi (motion JPEG; then readable up to the
            last 0.3 MB).
        rate: frames per second [Hz].
        keep: whether an existing file stays; the video then gets a number: NAME_2.mp4.

    Attributes:
        path: of the video, when it has a frame.
        frames: number of frames in the video.
        lost: number of frames that were lost.

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
        self._lock: Optional[BinaryIO] = None
        self._size = (0, 0)

    def __enter__(self) -> 'VideoFile':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write(self, bgr: np.ndarray) -> None:
        """Add a frame; one of another size is fitted with its aspect kept, on black.

        Args:
            bgr: (H, W, 3) uint8 BGR.

        Raises:
            OSError: with the file and the reason; the frame is not in the video, later ones may be.
        """
        if self._lock is not None and not self._is_in_place(self._lock):
            lost = self.frames
            self.frames, self.lost = 0, self.lost + lost
            self._release()
            raise FileNotFoundError(errno.ENOENT, f'deleted while it was written, with {lost} frames', str(self.path))
        self._check_room()
        writer = self._writer or self._open((bgr.shape[1], bgr.shape[0]))
        writer.write(_fitted(bgr, self._size))
        self.frames += 1

    def close(self) -> None:
        """Complete the file, and verify that its frames can be read.

        Raises:
            OSError: they can not; a file without readable frames is deleted.
        """
        if self._lock is None:
            return
        with naming(self.path):
            written, in_place = self.frames, self._is_in_place(self._lock)
            self.frames, self.lost = 0, self.lost + written  # until they are read back
            self._release()
            readable = _readable_frames(self.path) if in_place else None
            self.frames = min(readable or 0, written)
            self.lost -= self.frames
            if readable is None and in_place:
                self.path.unlink()
            if self.frames < written:
                what = ('the end is missing, players may show a part' if readable == 0 else
                        f'{self.frames} of {written} frames can be read')
                raise OSError(errno.EIO, f'the video is damaged: {what}')

    def _open(self, size: Tuple[int, int]) -> cv2.VideoWriter:
        """Begin the file, locked against other programs."""
        if self._keep:
            self.path = free_name(self.path)
        if self.path.exists() and not self.path.is_file():
            raise FileExistsError(errno.EEXIST, 'is no file', str(self.path))  # opening a pipe would block
        lock = self.path.open('xb' if self._keep else 'ab')
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            lock.close()
            raise BlockingIOError(errno.EAGAIN, 'another program is writing it', str(self.path)) from error
        except OSError:
            pass  # a file system without locks
        codec = cv2.VideoWriter_fourcc(*_CODECS[self.path.suffix.lower()])
        writer = cv2.VideoWriter(str(self.path), codec, self._rate, size)
        if not writer.isOpened():
            if os.fstat(lock.fileno()).st_size == 0:  # what was there before stays
                self.path.unlink()
            lock.close()
            raise OSError(errno.EINVAL, f'OpenCV can not write a video of {size[0]}x{size[1]} pixels', str(self.path))
        self._lock, self._writer, self._size = lock, writer, size
        return writer

    def _release(self) -> None:
        """Let OpenCV complete the file, and synchronize it with the disk."""
        if self._writer is not None and self._lock is not None:
            self._writer.release()
            self._writer = None
            with self._lock as handle:
                self._lock = None
                os.fsync(handle.fileno())

    def _is_in_place(self, handle: BinaryIO) -> bool:
        try:
            return os.path.samestat(os.fstat(handle.fileno()), self.path.stat())
        except OSError:
            return False

    def _check_room(self) -> None:
        """Raise OSError if the disk or the process's limit of file size has no room to complete the file."""
        needed = _RESERVE + _INDEX * self.frames
        disk = os.statvfs(str(self.path.parent))
        if disk.f_blocks and disk.f_bavail * disk.f_frsize < needed:
            raise OSError(errno.ENOSPC, f'{os.strerror(errno.ENOSPC)}: a video needs {needed >> 20} MB to be completed',
                          str(self.path))
        limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
        size = 0 if self._lock is None else os.fstat(self._lock.fileno()).st_size
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
