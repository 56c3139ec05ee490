"""From what the networks find in an image, and the points of the same view, to people in the image and in space.

The chain has two halves: people in the image, found by networks or elsewhere, and people in space. What follows people
needs both sides: the tracks in space tell where in the next image people will be, see `PeopleChain.expected`.
"""
import itertools
import threading
from typing import Hashable, Optional, Tuple

import numpy as np

from openpose_ros_pkg.detect.detection import DepthView, ImageFrame
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.tracking import KeypointTracker, PerCamera, TrackingParams
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.people import FIRST_ID, People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.estimator import Estimate, PeopleEstimator, check_points
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.landmarks import Landmarks, with_hidden
from skeleton_extract_3d.lift.landmarks import lift_landmarks
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.settings import EstimatorSettings

# Camera that nobody has, to warm up with.
_WARM_UP_MATRIX = np.array([[50.0, 0.0, 31.5], [0.0, 50.0, 23.5], [0.0, 0.0, 1.0]])


class PeopleChain:
    """The people before any number of cameras; ids in space are unique over all of them. Any thread may call it.

    Of more cameras than `TRACKING.most_cameras`, the one that sent nothing for longest is forgotten.

    Args:
        skeleton: joints of the people.
        settings: of the estimators.
        tracking: limits of following people in images that are found elsewhere; None: the defaults.
        stream: what finds people in images; None: they are found elsewhere.
        landmarks: what finds their hands and faces; None: nothing does.
    """

    def __init__(self, skeleton: SkeletonModel, settings: EstimatorSettings, tracking: Optional[TrackingParams] = None,
                 stream: Optional[NetworkDetection] = None,
                 landmarks: Optional[LandmarkDetector] = None) -> None:
        self.skeleton = skeleton
        self._settings = settings
        self._stream, self._landmarks = stream, landmarks
        limits = TrackingParams() if tracking is None else tracking
        self._trackers = PerCamera(lambda: KeypointTracker(limits))
        self._ids = itertools.count(FIRST_ID)
        self._estimators = PerCamera(lambda: PeopleEstimator(self._settings, self._ids))
        # held while a frame is estimated, so that it keeps the settings that it began with
        self._lock = threading.Lock()

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Take other settings from the next frame on; see `PeopleEstimator.reconfigure`."""
        with self._lock:
            self._settings = settings
            for estimator in self._estimators.all():
                estimator.reconfigure(settings)

    def warm_up(self) -> None:
        """Estimate somebody made up, so that the first frame of a camera takes no longer than the others."""
        estimator, camera = PeopleEstimator(self._settings), CameraModel(64, 48, _WARM_UP_MATRIX)
        joints = len(self.skeleton.joints)
        place = np.stack([np.linspace(30, 34, joints), np.linspace(4, 44, joints), np.ones(joints)], axis=1)
        somebody = People2D(self.skeleton, place[None], np.ones(1), np.ones(1))
        wall, grey = np.full((48, 64), 3000, np.uint16), np.full((48, 64, 3), 90, np.uint8)
        for people in (somebody, People2D.empty(self.skeleton)):
            estimator.update(people, Frame('', 0.0, grey, DepthImage(wall, camera)))

    def detect(self, bgr: np.ndarray, camera: Hashable, stamp: float, depth: Optional[DepthView] = None) -> People2D:
        """Return the people in an image, with ids that they keep in the images of a camera; needs `stream`.

        Args:
            bgr: (H, W, 3) uint8 BGR.
            camera: frame_id of the points that come with the image.
            stamp: of the image [s].
            depth: of the image; None: it is not known.

        Raises:
            BadInputError: not such an image, or an empty one.
        """
        if self._stream is None:
            raise ValueError('this chain has no networks')
        expected = self.expected(camera, stamp, (bgr.shape[1], bgr.shape[0]))
        return self._stream.detect(ImageFrame(camera, stamp, bgr, depth), expected)

    def expected(self, camera: Hashable, stamp: float, image_size: Tuple[int, int]) -> Optional[People2D]:
        """Return where the people who are followed in space will be in an image; None where nobody was yet.

        It waits for no frame that is being estimated: then the frame before tells.

        Args:
            camera: frame_id of the points.
            stamp: of the image [s].
            image_size: width and height [px].
        """
        return self._estimators.of(camera).expected(stamp, image_size)

    def in_image(self, detected: People2D, camera: Hashable, stamp: float) -> People2D:
        """Return people of an image who were found elsewhere with ids that they keep in the images of a camera.

        Args:
            camera: frame_id of the image.
            stamp: of the image [s].
        """
        with self._lock:
            return self._trackers.of(camera).update(detected, stamp)

    def check_points(self, points: PointGrid, image_size: Tuple[int, int]) -> None:
        """Check, before a network looks at an image, that `in_space` can use the points.

        Raises:
            BadInputError: see `estimator.check_points`.
        """
        check_points(points, image_size, self._settings)

    def in_space(self, people_2d: People2D, frame: Frame) -> Estimate:
        """Return the people of a frame in the frame of its points; see `PeopleEstimator.update`.

        Raises:
            BadInputError: image and points differ in aspect ratio, or the points are in no optical frame.
        """
        with self._lock:
            return self._estimators.of(frame.camera).update(people_2d, frame)

    def landmarks(self, bgr: np.ndarray, estimate: Estimate, frame: Frame, seconds: Optional[float] = None
                  ) -> Landmarks:
        """Return hands and faces of the people of a frame, in the image and in the frame of its points.

        Args:
            bgr: (H, W, 3) uint8 BGR.
            estimate: of the frame.
            seconds: that the networks may take; None: any time.

        Raises:
            BadInputError: the points are in no optical frame.
        """
        if self._landmarks is None:
            return Landmarks.empty()
        found = self._landmarks.detect(bgr, estimate.people_2d, estimate.hidden, frame.camera, frame.stamp, seconds)
        if not (len(found.hands) or len(found.faces)):
            return Landmarks.empty()
        lifted = lift_landmarks(found, frame.grid, frame.image_size, estimate.people)
        return Landmarks(with_hidden(found, lifted), lifted)

    def landmarks_in_image(self, bgr: np.ndarray, people: People2D, camera: Hashable, stamp: float) -> Landmarks2D:
        """Return hands and faces of the people of an image without points; see `LandmarkDetector.detect`."""
        if self._landmarks is None:
            return Landmarks2D.empty()
        return self._landmarks.detect(bgr, people, None, camera, stamp)
