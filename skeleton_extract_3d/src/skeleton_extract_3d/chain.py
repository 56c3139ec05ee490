"""From what the networks find in an image, and the points of the same view, to people in the image and in space.

The chain has two halves: the detection service does the first, the extractor calls the second. Programs that have
images and points, such as process_bag and the benchmarks, call both on one object.
"""
import itertools
import threading
from typing import Dict, Optional

from openpose_ros_pkg.detect.tracking import CameraTrackers, TrackingParams
from openpose_ros_pkg.people import FIRST_ID, People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.estimator import Estimate, PeopleEstimator
from skeleton_extract_3d.frame import CameraFrame
from skeleton_extract_3d.settings import EstimatorSettings


class PeopleChain:
    """The people before any number of cameras; ids in space are unique over all of them. Any thread may call it.

    Args:
        skeleton: joints of the people.
        settings: of the estimators.
        tracking: limits of following people in images; None: the defaults.
    """

    def __init__(self, skeleton: SkeletonModel, settings: EstimatorSettings, tracking: Optional[TrackingParams] = None
                 ) -> None:
        self.skeleton = skeleton
        self._settings = settings
        self._trackers = CameraTrackers(TrackingParams() if tracking is None else tracking)
        self._estimators: Dict[str, PeopleEstimator] = {}
        self._ids = itertools.count(FIRST_ID)
        # held while a frame is estimated, so that it keeps the settings that it began with
        self._lock = threading.Lock()

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Take other settings from the next frame on; see `PeopleEstimator.reconfigure`."""
        with self._lock:
            self._settings = settings
            for estimator in self._estimators.values():
                estimator.reconfigure(settings)

    def in_image(self, detected: People2D, camera: str, stamp: float) -> People2D:
        """Return the people whom the networks find in an image with ids that they keep in the images of a camera.

        Args:
            camera: frame_id of the image.
            stamp: of the image [s].
        """
        return self._trackers.update(detected, camera, stamp)

    def in_space(self, people_2d: People2D, frame: CameraFrame) -> Estimate:
        """Return the people of a frame in the frame of its points; see `PeopleEstimator.update`.

        Raises:
            BadInputError: image and points differ in aspect ratio, or the points are in no optical frame.
        """
        with self._lock:
            if frame.camera not in self._estimators:
                self._estimators[frame.camera] = PeopleEstimator(self._settings, self._ids)
            return self._estimators[frame.camera].update(people_2d, frame)
