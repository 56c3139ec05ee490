"""People in many pictures at once: by one detector with all threads, or in several processes that may die."""
import logging
import multiprocessing
import os
import queue
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any, Callable, List, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.recipes import DetectorParams, recipe_of
from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.networks.backends import BackendParams
from openpose_ros_pkg.people import People2D
from openpose_ros_tools.parallel.no_interrupts import no_interrupts

_log = logging.getLogger(__name__)

# Pictures on their way beyond those that are computed: one is prepared, one is read out.
_BESIDES = 2
# A picture is sent so often; one that ends process after process will end the next one as well.
_MOST_TRIES = 3
_END_SECONDS = 5.0


class ProcessLostError(OpenposeRosError):
    """The processes that look at a picture end again and again."""


class DetectorPool:
    """Finds people in pictures, several at a time; for `with`.

    Args:
        jobs: 1: one detector in this process, whose preparing and finishing overlap the networks. More: so many
            processes with a detector each.
        params: an instance of each class in DETECTOR_PARAMETERS, in that order. Where they leave the number of
            threads open, processes share the cores.
        create: makes a detector of these; for processes a function that can be pickled.

    Raises:
        OpenposeRosError: no detector can be made of these (of processes, `submit`'s results tell).
    """

    def __init__(self, jobs: int, params: Sequence[Any], create: Callable[..., Any]) -> None:
        self.skeleton = recipe_of(next(part for part in params if isinstance(part, DetectorParams))).skeleton
        self.capacity = jobs + _BESIDES
        """Pictures that should be on their way, so that no network waits."""
        self._closed = False
        self._processes: List[_DetectorProcess] = []
        self._idle: queue.SimpleQueue = queue.SimpleQueue()
        if jobs == 1:
            detector = create(*params)
            self._detect: Callable[[np.ndarray], People2D] = detector.detect
        else:
            params = with_threads(params, max((os.cpu_count() or 1) // jobs, 1))
            self._processes = [_DetectorProcess(create, params) for _ in range(jobs)]
            for process in self._processes:
                self._idle.put(process)
            self._detect = self._detect_elsewhere
        self._threads = ThreadPoolExecutor(self.capacity if jobs == 1 else jobs, 'detect')

    def submit(self, bgr: np.ndarray) -> 'Future[People2D]':
        """Have the people found in a picture, (H, W, 3) uint8 BGR; see `Detector.detect`.

        The result raises what the detector raises, and ProcessLostError.
        """
        return self._threads.submit(self._unless_closed, bgr)

    def pids(self) -> List[int]:
        """Return the ids of the processes that are there at present."""
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


def with_threads(params: Sequence[Any], threads: int) -> Tuple[Any, ...]:
    """Return parameters with a number of threads for the networks, unless they name one."""
    return tuple(replace(part, threads=threads) if isinstance(part, BackendParams) and part.threads == 0 else part
                 for part in params)


class _DetectorProcess:
    """A process with a detector; when it dies, another one takes its place and gets the same picture."""

    def __init__(self, create: Callable[..., Any], params: Sequence[Any]) -> None:
        self._create, self._params = create, params
        self._closed = False
        self._start()

    @property
    def pid(self) -> int:
        """Id of the process."""
        return self._process.pid

    def detect(self, bgr: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return keypoints and scores, or raise what the detector raised."""
        for _ in range(_MOST_TRIES):
            try:
                self._connection.send(bgr)
                answer = self._connection.recv()
            except (EOFError, OSError):
                if self._closed:
                    break
                self._process.join(_END_SECONDS)
                _log.warning('a detector process ended with status %s; another one takes its place',
                             self._process.exitcode)
                self._start()
                continue
            if isinstance(answer, Exception):
                raise answer
            return answer
        raise ProcessLostError(f'{_MOST_TRIES} detector processes ended while they looked at the same picture')

    def close(self) -> None:
        """End the process, whatever it is at."""
        self._closed = True
        self._process.kill()
        self._process.join()
        self._connection.close()

    def _start(self) -> None:
        # spawned: a fork would copy threads' locks, and what the networks hold
        context = multiprocessing.get_context('spawn')
        connection, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs, self._create, self._params), daemon=True)
        with no_interrupts():  # the other side ends this one
            process.start()
        theirs.close()
        self._connection, self._process = connection, process
        if self._closed:  # meanwhile, by another thread, which knew the one before alone
            process.kill()


def _serve(connection: Connection, create: Callable[..., Any], params: Sequence[Any]) -> None:
    """Answer pictures with keypoints and scores, or with the error, until the other side is gone."""
    detector: Optional[Any] = None
    with suppress(EOFError, OSError):
        while True:
            bgr = connection.recv()
            try:
                detector = detector or create(*params)
                people = detector.detect(bgr)
            except OpenposeRosError as error:
                connection.send(error)
            except Exception as error:  # the other side has to know, and not every error can be sent
                connection.send(RuntimeError(f'in a detector process: {error!r}'))
            else:
                connection.send((people.keypoints, people.scores))
