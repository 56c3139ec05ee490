"""People in space before several cameras: an estimator for each, ids given out once for all."""
import itertools
import threading
from typing import Dict, Optional, Tuple

import numpy as np

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.estimator import Estimate, PeopleEstimator
from skeleton_extract_3d.frame import CameraFrame
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.settings import EstimatorSettings


class CameraEstimators:
    """A `PeopleEstimator` for each camera, told apart by the frame_id of the points; any thread may call it.

    Args:
        skeleton: joints of the people.
        settings: of each estimator.
    """

    def __init__(self, skeleton: SkeletonModel, settings: EstimatorSettings) -> None:
        self.skeleton = skeleton
        self._settings = settings
        self._estimators: Dict[str, PeopleEstimator] = {}
        self._ids = itertools.count()
        # held while a frame is estimated, so that it keeps the parameters that it began with
        self._lock = threading.Lock()

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Take other parameters from the next frame on; see `PeopleEstimator.reconfigure`."""
        with self._lock:
            self._settings = settings
            for estimator in self._estimators.values():
                estimator.reconfigure(settings)

    def update(self, people_2d: People2D, points: PointGrid, frame_id: str, stamp: float, bgr: np.ndarray,
               tracking_from_points: Optional[Tuple[np.ndarray, np.ndarray]] = None) -> Estimate:
        """Return the people of a frame of a camera; see `PeopleEstimator.update`.

        Args:
            frame_id: of the points.
            bgr: (H, W, 3) uint8, the image.

        Raises:
            BadInputError: image and points differ in aspect ratio, or the points are in no optical frame.
        """
        height, width = bgr.shape[:2]
        with self._lock:
            if frame_id not in self._estimators:
                self._estimators[frame_id] = PeopleEstimator(self._settings, self._ids)
            return self._estimators[frame_id].update(
                people_2d, CameraFrame((width, height), points, stamp, bgr, tracking_from_points))
