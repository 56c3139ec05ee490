"""People in several images at a time: by one detector with all threads, or by processes, which may die."""
import functools
import logging
import multiprocessing
import os
import queue
import signal
import threading
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import replace
from typing import Callable, List, Tuple

import numpy as np

from openpose_ros_pkg.detect.detector import Detector, DetectorSettings
from openpose_ros_pkg.detect.recipes import recipe_of
from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.people import People2D
from openpose_ros_tools.parallel.no_interrupts import no_interrupts

_log = logging.getLogger(__name__)

# Number of images in progress beside those in the networks: one is prepared, one is finished.
_BESIDES = 2
# Number of processes that may end on the same image before it is given up.
_MOST_TRIES = 3


class ProcessLostError(OpenposeRosError):
    """Several processes ended on the same image."""


class DetectorPool:
    """Finds people in several images at a time; use it as a context manager.

    Args:
        jobs: 1: one detector in this process, whose preparing and finishing overlap the networks. More: the number of
            processes, each with a detector.
        settings: of the detectors. Where they leave the number of threads open, processes share the cores.
        create: makes a detector of the settings; for processes a function that can be pickled.

    Raises:
        OpenposeRosError: no detector can be made (with processes, `submit`'s results raise it).
    """

    def __init__(self, jobs: int, settings: DetectorSettings, create: Callable[[DetectorSettings], Detector]) -> None:
        self.skeleton = recipe_of(settings.detector).skeleton
        self.capacity = jobs + _BESIDES
        """Number of images that have to be in progress, so that no network waits."""
        self._closed = False
        self._processes: List[_DetectorProcess] = []
        self._idle: queue.SimpleQueue = queue.SimpleQueue()
        if jobs == 1:
            detector = create(settings)
            self._detect: Callable[[np.ndarray], People2D] = detector.detect
        else:
            settings = with_threads(settings, max((os.cpu_count() or 1) // jobs, 1))
            self._processes = [_DetectorProcess(create, settings) for _ in range(jobs)]
            for process in self._processes:
                self._idle.put(process)
            self._detect = self._detect_elsewhere
        self._threads = ThreadPoolExecutor(self.capacity if jobs == 1 else jobs, 'detect')

    def submit(self, bgr: np.ndarray) -> 'Future[People2D]':
        """Start to find the people in an image, (H, W, 3) uint8 BGR; see `Detector.detect`.

        The result raises what the detector raises, and ProcessLostError.
        """
        return self._threads.submit(self._unless_closed, bgr)

    def pids(self) -> List[int]:
        """Return the ids of the present processes."""
        return [process.pid for process in self._processes]

    def __enter__(self) -> 'DetectorPool':
        return self

    def __exit__(self, *_: object) -> None:
        self._closed = True
        for process in self._processes:
            process.close()
        self._threads.shutdown()

    def _unless_closed(self, bgr: np.ndarray) -> People2D:
        if self._closed:
            raise CancelledError
        return self._detect(bgr)

    def _detect_elsewhere(self, bgr: np.ndarray) -> People2D:
        process = self._idle.get()
        try:
            keypoints, scores = process.detect(bgr)
        finally:
            self._idle.put(process)
        return People2D(self.skeleton, keypoints, scores, np.full(len(scores), -1))


def with_threads(settings: DetectorSettings, threads: int) -> DetectorSettings:
    """Return settings with a number of threads for the networks, unless they name one."""
    if settings.backend.threads != 0:
        return settings
    return replace(settings, backend=replace(settings.backend, threads=threads))


class _DetectorProcess:
    """A process with a detector; when it dies, another one takes its place and gets the same image."""

    def __init__(self, create: Callable[[DetectorSettings], Detector], settings: DetectorSettings) -> None:
        self._arguments = (create, settings)
        self._closed = False
        self._start()

    @property
    def pid(self) -> int:
        """Id of the process."""
        return self._pid.result()

    def detect(self, bgr: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return keypoints and scores, or raise what the detector raised."""
        for _ in range(_MOST_TRIES):
            try:
                return self._executor.submit(_detect, bgr).result()
            except BrokenProcessPool:
                if self._closed:
                    raise CancelledError from None
                _log.warning('a detector process has ended; another one takes its place')
                self._start()
        raise ProcessLostError(f'{_MOST_TRIES} detector processes ended while they processed the same image')

    def close(self) -> None:
        """End the process at once; the result of its image is not needed."""
        self._closed = True
        with suppress(BrokenProcessPool, ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)
        self._executor.shutdown()

    def _start(self) -> None:
        # spawned: a fork would copy locks of threads and the state of the networks
        self._executor = ProcessPoolExecutor(1, multiprocessing.get_context('spawn'), _keep, self._arguments)
        with no_interrupts():  # this process ends the new one, not the terminal
            self._pid = self._executor.submit(os.getpid)
        if self._closed:  # in the meantime, by another thread, which knew only the process before
            self.close()


# In a detector process: returns its detector, which the first call makes.
_own_detector: Callable[[], Detector]


def _keep(create: Callable[[DetectorSettings], Detector], settings: DetectorSettings) -> None:
    """Keep what makes the detector: the first image makes it, as its result can carry the error."""
    global _own_detector
    _own_detector = functools.lru_cache(maxsize=None)(functools.partial(create, settings))
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent has ended, even if that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _detect(bgr: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    try:
        people = _own_detector().detect(bgr)
    except OpenposeRosError:
        raise
    except Exception as error:  # not every error can be sent
        raise RuntimeError(f'in a detector process: {error!r}') from None
    return people.keypoints, people.scores
