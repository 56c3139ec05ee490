"""Save frames in a thread of its own: detection does not wait for the disk."""
import logging
from collections import deque
from contextlib import suppress
from typing import Callable, Deque, Dict, Optional, Tuple, Union

import numpy as np

from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.output.draw import DrawParams
from openpose_ros_pkg.output.frame_writer import FrameWriter
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.stream.worker import Worker
from openpose_ros_pkg.throttle import Throttle

_log = logging.getLogger(__name__)

_Item = Tuple[Union[str, int], np.ndarray, People2D, Optional[Landmarks2D]]


class Recorder:
    """Hands frames to a `FrameWriter` in a thread of its own, through a queue of bounded length; thread-safe.

    When the queue is full, either the caller waits (files and videos: nothing is lost), or the new frame is dropped and
    counted (live images: the caller never waits).

    Args:
        writer: belongs to the recorder from now on.
        wait_when_full: True: `submit` waits for a place; False: it drops the frame.
        queue_size: frames that may wait; each holds its image in memory.
        on_fault: called in any thread with why a frame, or a part of it, is not saved; None: logged, throttled.
    """

    def __init__(self, writer: FrameWriter, wait_when_full: bool, queue_size: int = 8,
                 on_fault: Optional[Callable[[str], None]] = None) -> None:
        self._writer = writer
        self._throttle = Throttle()
        self._on_fault = on_fault or self._log_fault
        self._wait_when_full, self._queue_size = wait_when_full, queue_size
        self._queue: Deque[_Item] = deque()
        self._dropped = self._broken = 0
        self._worker = Worker({'recorder': self._write_next}, self._count_broken)
        self._changed = self._worker.condition
        self._worker.start()

    def __enter__(self) -> 'Recorder':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def counters(self) -> Dict[str, int]:
        """Numbers of files and video frames that were written and that failed, of frames dropped and waiting."""
        with self._changed:
            return {'written': self._writer.written, 'failed': self._writer.failed + self._broken,
                    'dropped': self._dropped, 'waiting': len(self._queue)}

    def submit(self, frame: Union[str, int], bgr: np.ndarray, people: People2D,
               landmarks: Optional[Landmarks2D] = None) -> bool:
        """Queue a frame to be saved.

        Args:
            frame: name of the files, as `numbered_name` makes it; or a number.
            bgr: (H, W, 3) uint8 BGR; not to be modified any more.
            people: in pixels of the image.
            landmarks: their hands and faces; None: none.

        Returns:
            False if the frame was dropped: the queue is full, or the recorder is closed.
        """
        with self._changed:
            if self._wait_when_full:
                self._changed.wait_for(lambda: self._worker.stopped or len(self._queue) < self._queue_size)
            closed = self._worker.stopped
            if not closed and len(self._queue) < self._queue_size:
                self._queue.append((frame, bgr, people, landmarks))
                self._changed.notify_all()
                return True
            self._dropped += 1
        if not closed:
            self._on_fault(f'saving is slower than the frames: {self._queue_size} are waiting')
        return False

    def fault(self, least: int = 1) -> str:
        """Return what is not saved at present; see `FrameWriter.fault`."""
        return self._writer.fault(least)

    def reconfigure(self, draw: DrawParams) -> None:
        """Use other drawing parameters from the next frame on."""
        self._writer.reconfigure(draw)

    def close(self) -> None:
        """Write all frames that wait, end the thread and complete the video."""
        self._worker.stop()
        try:
            fault = self._writer.close()
        except Exception as error:  # logged like the faults of closing
            fault = repr(error)
        if fault:
            _log.error('%s', fault)

    def _write_next(self) -> bool:
        with self._changed:
            self._changed.wait_for(lambda: self._worker.stopped or self._queue)
            if not self._queue:
                return False
            item = self._queue.popleft()
            self._changed.notify_all()
        if fault := self._writer.write(*item):
            with suppress(Exception):  # a frame counts as failed once
                self._on_fault(fault)
        return True

    def _count_broken(self, error: Exception) -> None:
        """Count a frame that the writer raised for, and report it."""
        with self._changed:
            self._broken += 1
        self._on_fault(repr(error))

    def _log_fault(self, fault: str) -> None:
        if self._throttle.is_due(''):
            counters = self.counters
            _log.error('not saved: %s (%d files and frames so far)', fault, counters['failed'] + counters['dropped'])
