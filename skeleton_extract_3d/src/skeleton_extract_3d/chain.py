"""From an image, and the points of the same view, to people in the image and in space.

`PeopleChain` is what nodes, process_bag, benchmarks and scripts without ROS run::

    chain = PeopleChain(detection, settings)
    result = chain.update(Frame(camera, stamp, bgr, points))

A pipeline calls the stages one by one, each in the order of the frames of a camera: prepare, compute, finish, lift;
then add_landmarks, and search beside it.
"""
import itertools
import threading
from dataclasses import dataclass, field, replace
from typing import Any, Dict, Hashable, Optional, Tuple

import numpy as np

from openpose_ros_pkg.detect.detection import Detection, ImageFrame, Wanted, never_wanted
from openpose_ros_pkg.detect.tracking import PerCamera
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.people import FIRST_ID, ExpectedPeople, People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.estimator import Estimate, PeopleEstimator, check_points
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.landmarks import Landmarks, Landmarks3D, with_hidden
from skeleton_extract_3d.lift.landmarks import lift_landmarks
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.depth_view import depth_view
from skeleton_extract_3d.points.plausibility import Doubt
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.settings import EstimatorSettings

# Intrinsics of the made-up camera of `PeopleChain.warm_up`, 64 x 48 [px].
_WARM_UP_MATRIX = np.array([[50.0, 0.0, 31.5], [0.0, 50.0, 23.5], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class PreparedFrame:
    """A frame that is ready for the networks; `image` is what `Detection.prepare` returned."""

    frame: Frame
    image: Any


@dataclass(frozen=True, eq=False)
class ComputedFrame:
    """A frame after the networks; `found` is what `Detection.compute` returned."""

    frame: Frame
    found: Any


@dataclass(frozen=True, eq=False)
class Result:
    """What is known of a frame.

    Attributes:
        frame: what it was computed from.
        people_2d: the people in the image, with track ids; after `lift` with their ids in space, -1 for people without
            a place in space.
        estimate: the people in space and how they were found; None: before `lift`, or without points.
        landmarks: hands and faces.
    """

    frame: Frame
    people_2d: People2D
    estimate: Optional[Estimate] = None
    landmarks: Landmarks = field(default_factory=Landmarks.empty)

    @property
    def people_3d(self) -> Optional[People3D]:
        """The people in the frame of reference of the points; None: without points."""
        return None if self.estimate is None else self.estimate.people

    @property
    def doubts(self) -> Tuple[Doubt, ...]:
        """What seems to be wrong with image and points."""
        return () if self.estimate is None else self.estimate.doubts

    @property
    def timing(self) -> Dict[str, float]:
        """Seconds by stage of the estimator, see `estimator.STAGES`."""
        return {} if self.estimate is None else self.estimate.timing

    def located(self, tracking_from_points: Optional[Transform], floor: Optional[np.ndarray] = None) -> 'Result':
        """Return the result with the pose of its camera and the floor, see `Frame`, where these are known only now."""
        return replace(self, frame=replace(self.frame, tracking_from_points=tracking_from_points, floor=floor))


class PeopleChain:
    """The people before any number of cameras; ids in space are unique over all of them. Any thread may call it.

    Of more cameras than `TRACKING.most_cameras`, the one that sent nothing for longest is forgotten.

    Args:
        detection: finds people in images.
        settings: of the estimators.
        landmarks: finds hands and faces; None: the results have none.
    """

    def __init__(self, detection: Detection, settings: EstimatorSettings,
                 landmarks: Optional[LandmarkDetector] = None) -> None:
        self.detection = detection
        self._settings, self._landmarks = settings, landmarks
        self._ids = itertools.count(FIRST_ID)
        self._estimators = PerCamera(lambda: PeopleEstimator(self._settings, self._ids))
        # held while a frame is estimated, so that it keeps the settings that it began with
        self._lock = threading.Lock()

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people."""
        return self.detection.skeleton

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Take other settings from the next frame on; see `PeopleEstimator.reconfigure`."""
        with self._lock:
            self._settings = settings
            for estimator in self._estimators.all():
                estimator.reconfigure(settings)

    def warm_up(self) -> None:
        """Estimate a made-up person, so that the first frame of a camera takes no longer than the others."""
        estimator, camera = PeopleEstimator(self._settings), CameraModel(64, 48, _WARM_UP_MATRIX)
        joints = len(self.skeleton.joints)
        place = np.stack([np.linspace(30, 34, joints), np.linspace(4, 44, joints), np.ones(joints)], axis=1)
        person = People2D(self.skeleton, place[None], np.ones(1), np.ones(1))
        wall, grey = np.full((48, 64), 3000, np.uint16), np.full((48, 64, 3), 90, np.uint8)
        for people in (person, People2D.empty(self.skeleton)):
            estimator.update(people, Frame('', 0.0, grey, DepthImage(wall, camera)))

    def update(self, frame: Frame) -> Result:
        """Return all that is known of a frame.

        Raises:
            BadInputError: the image is empty, its aspect ratio is not that of the points, or the points are in no
                optical frame.
        """
        prepared = self.prepare(frame)
        with self.detection.lock:
            computed = self.compute(prepared)
            self.search(computed)
        return self.add_landmarks(self.lift(self.finish(computed)))

    def prepare(self, frame: Frame) -> PreparedFrame:
        """Check a frame and bring its image to the sizes that the networks want; errors as `update`."""
        if frame.points is not None:
            check_points(frame.points, frame.image_size, self._settings)
        depth = None if frame.points is None else depth_view(frame.points)
        image = ImageFrame(frame.camera, frame.image_time, frame.image, depth, source=frame.source,
                           interval=frame.interval)
        return PreparedFrame(frame, self.detection.prepare(image))

    def compute(self, prepared: PreparedFrame) -> ComputedFrame:
        """Let the networks see the image, with `detection.lock` held."""
        frame = prepared.frame
        expected = None
        if frame.points is not None:
            expected = self.expected(frame.camera, frame.image_time, frame.image_size)
        return ComputedFrame(frame, self.detection.compute(prepared.image, expected))

    def search(self, computed: ComputedFrame, wanted: Wanted = never_wanted) -> bool:
        """Look for other people in the newest computed frame, for the next one; see `Detection.search`."""
        return self.detection.search(computed.found, wanted)

    def finish(self, computed: ComputedFrame) -> Result:
        """Return the people in the image, with track ids."""
        return Result(computed.frame, self.detection.finish(computed.found))

    def lift(self, result: Result) -> Result:
        """Return the result with the people in space; without points as it is. Errors as `update`."""
        frame = result.frame
        if frame.points is None:
            return result
        with self._lock:
            estimate = self._estimators.of(frame.camera).update(result.people_2d, frame)
        return replace(result, people_2d=estimate.in_image, estimate=estimate)

    def add_landmarks(self, result: Result, seconds: Optional[float] = None) -> Result:
        """Return the result with hands and faces, for which the networks may take some seconds; None: any time.

        Raises:
            BadInputError: the points are in no optical frame.
        """
        if self._landmarks is None:
            return result
        frame, estimate = result.frame, result.estimate
        people, hidden = (result.people_2d, None) if estimate is None else (estimate.people_2d, estimate.hidden)
        found = self._landmarks.detect(frame.image, people, hidden, frame.camera, frame.stamp, seconds)
        if estimate is None or not (len(found.hands) or len(found.faces)):
            return replace(result, landmarks=Landmarks(found, Landmarks3D.empty()))
        lifted = lift_landmarks(found, frame.grid, frame.image_size, estimate.people)
        return replace(result, landmarks=Landmarks(with_hidden(found, lifted), lifted))

    def expected(self, camera: Hashable, stamp: float, image_size: Tuple[int, int]) -> Optional[ExpectedPeople]:
        """Return where the people tracked in space will be in an image of a size (width, height) [px]; None: none yet.

        Does not block: returns the prediction from the last estimated frame.
        """
        return self._estimators.of(camera).expected(stamp, image_size)
