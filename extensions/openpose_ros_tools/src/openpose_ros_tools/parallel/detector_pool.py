"""People in several images at a time: by one detector with all threads, or by processes, which may die."""
import functools
import os
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from typing import Callable, Optional

import numpy as np

from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.recipe_choice import recipe_of
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.people import People2D
from openpose_ros_tools.parallel.processes import ProcessPool

# Number of images in progress beside those in the networks: one is prepared, one is finished.
_BESIDES = 2


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
        self._stack = ExitStack()
        if jobs == 1:
            detect = create(settings).detect
            threads = self._stack.enter_context(ThreadPoolExecutor(self.capacity, 'detect'))
            self._submit: Callable[..., Future[People2D]] = lambda *view: threads.submit(detect, *view)
        else:
            settings = with_threads(settings, max((os.cpu_count() or 1) // jobs, 1))
            processes = self._stack.enter_context(ProcessPool(jobs, _keep, (create, settings)))
            self._submit = functools.partial(processes.submit, _detect)

    def submit(self, bgr: np.ndarray, depth: Optional[DepthView] = None) -> 'Future[People2D]':
        """Start to find the people in an image, (H, W, 3) uint8 BGR, of a depth; see `Detector.detect`.

        The result raises what the detector raises, and ProcessLostError.
        """
        return self._submit(bgr, depth)

    def __enter__(self) -> 'DetectorPool':
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()


def with_threads(settings: DetectorSettings, threads: int) -> DetectorSettings:
    """Return settings with a number of threads for the networks, unless they name one."""
    if settings.backend.threads != 0:
        return settings
    return replace(settings, backend=replace(settings.backend, threads=threads))


# In a detector process: returns its detector, which the first call makes, as its result can carry the error.
_own_detector: Callable[[], Detector]


def _keep(create: Callable[[DetectorSettings], Detector], settings: DetectorSettings) -> None:
    global _own_detector
    _own_detector = functools.lru_cache(maxsize=None)(functools.partial(create, settings))


def _detect(bgr: np.ndarray, depth: Optional[DepthView]) -> People2D:
    return _own_detector().detect(bgr, depth)
