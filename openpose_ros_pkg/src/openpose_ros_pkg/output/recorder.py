"""Save frames in a thread of its own, so that detection does not wait for the disk."""
import logging
import threading
from collections import deque
from contextlib import suppress
from typing import Callable, Deque, Dict, Optional, Tuple, Union

import numpy as np

from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.output.draw import DrawParams
from openpose_ros_pkg.output.frame_writer import FrameWriter
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.throttle import Throttle

_log = logging.getLogger(__name__)

_Item = Tuple[Union[str, int], np.ndarray, People2D, Optional[Landmarks2D]]


class Recorder:
    """Hands frames to a `FrameWriter` in a thread of its own, through a queue of bounded length.

    When the queue is full, either the caller waits (nothing is lost: files and videos), or the new frame is dropped,
    counted and warned of (the caller never waits: live images). Any thread may call it.

    Args:
        writer: belongs to the recorder from now on.
        wait_when_full: True: `submit` waits for a place; False: it drops the frame.
        queue_size: frames that may wait; each holds its image in memory.
        on_fault: gets why a frame is not saved, or not all of it, in any thread; None: that is logged, throttled.
    """

    def __init__(self, writer: FrameWriter, wait_when_full: bool, queue_size: int = 8,
                 on_fault: Optional[Callable[[str], None]] = None) -> None:
        self._writer = writer
        self._throttle = Throttle()
        self._on_fault = on_fault or self._log_fault
        self._wait_when_full = wait_when_full
        self._queue_size = queue_size
        self._queue: Deque[_Item] = deque()
        self._condition = threading.Condition()
        self._closed = False
        self._dropped = 0
        self._broken = 0
        self._thread = threading.Thread(target=self._run, name='recorder', daemon=True)
        self._thread.start()

    def __enter__(self) -> 'Recorder':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def counters(self) -> Dict[str, int]:
        """Numbers: files and video frames that were written, that failed, that a full queue dropped, that wait."""
        with self._condition:
            return {'written': self._writer.written, 'failed': self._writer.failed + self._broken,
                    'dropped': self._dropped, 'waiting': len(self._queue)}

    def submit(self, frame: Union[str, int], bgr: np.ndarray, people: People2D,
               landmarks: Optional[Landmarks2D] = None) -> bool:
        """Queue a frame to be saved.

        Args:
            frame: name of the files, as `frame_name` makes it; or a number.
            bgr: (H, W, 3) uint8 BGR, which nobody may modify any more.
            people: in pixels of the image.
            landmarks: their hands and faces; None: none.

        Returns:
            False if the frame was dropped: the queue is full, or the recorder is closed.
        """
        with self._condition:
            if self._wait_when_full:
                self._condition.wait_for(lambda: self._closed or len(self._queue) < self._queue_size)
            if not self._closed and len(self._queue) < self._queue_size:
                self._queue.append((frame, bgr, people, landmarks))
                self._condition.notify_all()
                return True
            self._dropped += 1
            closed = self._closed
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
        """Write all frames that wait, complete the video, and end the thread."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._closed or self._queue)
                if not self._queue:
                    break
                item = self._queue.popleft()
                self._condition.notify_all()
            try:
                fault = self._writer.write(*item)
            except Exception as error:  # the thread must outlive whatever one frame does to it
                with self._condition:
                    self._broken += 1
                fault = repr(error)
            if fault:
                with suppress(Exception):  # nor may what tells of it end the thread
                    self._on_fault(fault)
        try:
            fault = self._writer.close()
        except Exception as error:  # it is told as the other faults of closing are
            fault = repr(error)
        if fault:
            _log.error('%s', fault)

    def _log_fault(self, fault: str) -> None:
        if self._throttle.is_due(''):
            counters = self.counters
            _log.error('not saved: %s (%d files and frames so far)', fault, counters['failed'] + counters['dropped'])
