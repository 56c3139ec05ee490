"""From an image, and the points of the same view, to people in the image and in space.

`PeopleChain` is what nodes, process_bag, benchmarks and scripts without ROS run. Recordings and single images::

    result = PeopleChain(detection, settings).update(Frame(camera, stamp, bgr, points))

A stream takes the same steps; a frame is published before the rest of the image is searched::

    result = chain.look(frame)
    for part in chain.search():   # stop when the next frame comes
        ...
"""
import itertools
from dataclasses import dataclass, field, replace
from typing import Callable, Dict, Iterator, Optional, Tuple

import numpy as np

from openpose_ros_pkg.detect.detection import Detection, ImageFrame, NextPart
from openpose_ros_pkg.detect.tracking import TURNED_CAMERA, ImageTracker, Mounting, PerCamera, TrackingParams
from openpose_ros_pkg.landmarks.body_landmarks import BodyLandmarkNetwork
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.people import FIRST_ID, People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.estimator import Estimate, PeopleEstimator, check_points
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.landmarks import Landmarks, with_hidden
from skeleton_extract_3d.lift.landmarks import lift_landmarks
from skeleton_extract_3d.lift.monocular import worlds_of
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.depth_view import depth_view
from skeleton_extract_3d.points.plausibility import Doubt
from skeleton_extract_3d.settings import EstimatorSettings

# Intrinsics of the made-up camera of `PeopleChain.warm_up`, 64 x 48 [px].
_WARM_UP_MATRIX = np.array([[50.0, 0.0, 31.5], [0.0, 50.0, 23.5], [0.0, 0.0, 1.0]])
IMAGE_TRACKING = TrackingParams()


@dataclass(frozen=True, eq=False)
class Result:
    """What is known of a frame.

    Attributes:
        frame: what it was computed from.
        people_2d: the people in the image, with their ids; -1 for people without a place in space.
        estimate: the people in space and how they were found; None: without points.
        landmarks: hands and faces.
        mounting: how the camera seems to be turned, see `Mounting`.
    """

    frame: Frame
    people_2d: People2D
    estimate: Optional[Estimate] = None
    landmarks: Landmarks = field(default_factory=Landmarks)
    mounting: str = ''

    @property
    def people_3d(self) -> Optional[People3D]:
        """The people in the frame of reference of the points; None: without points."""
        return None if self.estimate is None else self.estimate.people

    @property
    def doubts(self) -> Tuple[Doubt, ...]:
        """What seems to be wrong with camera, image and points."""
        return (*(() if self.estimate is None else self.estimate.doubts),
                *([Doubt(TURNED_CAMERA, self.mounting)] if self.mounting else []))

    @property
    def timing(self) -> Dict[str, float]:
        """Seconds by stage of the estimator, see `estimator.STAGES`."""
        return {} if self.estimate is None else self.estimate.timing


Locate = Callable[[Frame], Frame]
"""Adds the pose of the camera and the floor, see `Frame`, where these are known only once the image was looked at."""


class PeopleChain:
    """The people before any number of cameras; ids are unique over all of them. One thread at a time uses it.

    Of more cameras than `TRACKING.most_cameras`, the one that sent nothing for longest is forgotten. With points,
    tracks in space decide who is there and who is who, else tracks in the image.

    Args:
        detection: finds people in images.
        settings: of the estimators.
        landmarks: finds hands and faces; None: the results have none.
        tracking: limits of tracks in the image.
        bodies: finds people in space in images without depth; None: their sizes in the image place them.
    """

    def __init__(self, detection: Detection, settings: EstimatorSettings, landmarks: Optional[LandmarkDetector] = None,
                 tracking: TrackingParams = IMAGE_TRACKING, bodies: Optional[BodyLandmarkNetwork] = None) -> None:
        self.detection = detection
        self._settings, self._landmarks, self._bodies = settings, landmarks, bodies
        self._ids = itertools.count(FIRST_ID)
        self._estimators = PerCamera(lambda: PeopleEstimator(self._settings, self._ids))
        self._trackers = PerCamera(lambda: ImageTracker(tracking, self._ids))
        self._mountings = PerCamera(Mounting)
        self._newest: Optional[ImageFrame] = None

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people."""
        return self.detection.skeleton

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Take other settings from the next frame on; see `PeopleEstimator.reconfigure`."""
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

    def look(self, frame: Frame, in_full: bool = False, locate: Locate = lambda frame: frame) -> Result:
        """Return what is known of a frame after looks at the expected people; with `in_full`, after a search of all.

        Raises:
            BadInputError: the image is empty, its aspect ratio is not that of the points, or the points are in no
                optical frame.
        """
        depth = None
        if frame.points is not None:
            check_points(frame.points, frame.image_size, self._settings)
            depth = None if frame.is_monocular else depth_view(frame.points)
        image = ImageFrame(frame.camera, frame.image_time, frame.image, depth, frame.source)
        self._newest = image
        in_space = frame.points is not None and self._settings.identity.tracking
        result = (self._in_space if in_space else self._in_image)(frame, image, in_full, locate)
        return replace(result, mounting=self._mountings.of(frame.camera).fault(result.people_2d))

    def _in_space(self, frame: Frame, image: ImageFrame, in_full: bool, locate: Locate) -> Result:
        """Return a frame whose people keep the ids of tracks in space."""
        estimator = self._estimators.of(frame.camera)
        looks = self.detection.look(image, estimator.expected(frame, self.skeleton), in_full)
        people = looks.people
        if self.detection.gives_ids:  # of another tracker
            people = replace(people, ids=np.full(len(people), -1))
        frame = locate(frame)
        estimate = estimator.update(people, frame, looks.missed, self._worlds(people, frame))
        self.detection.remember(image, estimate.ids)
        return Result(frame, estimate.in_image, estimate)

    def _in_image(self, frame: Frame, image: ImageFrame, in_full: bool, locate: Locate) -> Result:
        """Return a frame whose people keep the ids of tracks in the image, or those that the detection gave them."""
        tracker = self._trackers.of(frame.camera)
        looks = self.detection.look(image, tracker.expected(image.stamp, image.size, self.skeleton), in_full)
        people = looks.people
        if not self.detection.gives_ids:
            people = tracker.update(looks, image.stamp, image.size)
            self.detection.remember(image, people.ids[:len(looks.people)])
        frame = locate(frame)
        if frame.points is None:
            return Result(frame, people)
        estimate = self._estimators.of(frame.camera).update(people, frame, None, self._worlds(people, frame))
        return Result(frame, estimate.in_image, estimate)

    def _worlds(self, people: People2D, frame: Frame) -> Optional[np.ndarray]:
        """Return the bodies of people by themselves, see `worlds_of`; None: with depth, or without the network."""
        if self._bodies is None or not frame.is_monocular:
            return None
        return worlds_of(self._bodies.observe(frame.image, people.keypoints, people.skeleton))

    def search(self) -> Iterator[NextPart]:
        """Search the rest of the newest frame; see `Detection.search`."""
        return iter(()) if self._newest is None else self.detection.search(self._newest)

    def update(self, frame: Frame) -> Result:
        """Return all that is known of a frame after a search of all of it, with hands and faces; errors as `look`."""
        return self.add_landmarks(self.look(frame, in_full=True))

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
        if estimate is None or frame.is_monocular or not (len(found.hands) or len(found.faces)):
            return replace(result, landmarks=Landmarks(found))
        lifted = lift_landmarks(found, frame.grid, frame.image_size, estimate.people)
        return replace(result, landmarks=Landmarks(with_hidden(found, lifted), lifted))
