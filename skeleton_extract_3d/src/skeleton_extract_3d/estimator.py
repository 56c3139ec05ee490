"""People in space from people in an image and the points of the same view: the points are checked, then tracked."""
import itertools
from dataclasses import dataclass, field, replace
from typing import Dict, Iterator, Optional, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.people import FIRST_ID, ExpectedPeople, People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.lift.agreement import Agreement
from skeleton_extract_3d.lift.window_mean import lift_by_window
from skeleton_extract_3d.people import INFERRED, People3D
from skeleton_extract_3d.points.camera import CameraModel, check_same_aspect
from skeleton_extract_3d.points.plausibility import Doubt, PointSummary, Stillness, stillness, summarize
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.track.calibration import calibrated
from skeleton_extract_3d.track.tracker import LookedAt, PeopleTracker

# Stages of `Estimate.timing`, in order.
STAGES = ('observe', 'identity', 'lift', 'filter', 'complete')


@dataclass(frozen=True)
class Estimate:
    """The people of one frame.

    Attributes:
        people: in the frame of the points: first those of `people_2d`, in the same order, then hidden tracks.
        people_2d: the detections and the people found by registration, with the ids of `people`; without those that the
            points do not confirm.
        timing: seconds by stage, see `STAGES`.
        unplaced: other people in the image, without ids, where there is no depth that could confirm them.
        points: summary of the points; None: there are none.
        doubts: likely faults of image and points.
        ids: (P,) of the tracks of the P detections that `update` was given, reported or not; -1: none.
    """

    people: People3D
    people_2d: People2D
    timing: Dict[str, float] = field(default_factory=dict)
    unplaced: Optional[People2D] = None
    points: Optional[PointSummary] = None
    doubts: Tuple[Doubt, ...] = ()
    ids: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))

    @property
    def in_image(self) -> People2D:
        """All people in the image: `people_2d`, then those without a place in space."""
        return self.people_2d if self.unplaced is None else self.people_2d.joined(self.unplaced)

    @property
    def hidden(self) -> np.ndarray:
        """Which joints of `people_2d` are INFERRED where points would show them, (P, K) bool."""
        return (self.people.status[:len(self.people_2d)] == INFERRED) & (self.points is not None)


def _unnamed(people: People2D) -> People2D:
    return replace(people, ids=np.full(len(people), -1))


class PeopleEstimator:
    """Tracks the people in view of one camera; not thread-safe.

    Args:
        settings: of the user.
        ids: source of ids for new people, shared where no two estimators may give the same one. None: 1, 2, 3, ...
        method: constants of all steps.
    """

    def __init__(self, settings: EstimatorSettings, ids: Optional[Iterator[int]] = None,
                 method: MethodConstants = METHOD) -> None:
        self._ids, self._method = itertools.count(FIRST_ID) if ids is None else ids, method
        self._begin(settings)

    def _begin(self, settings: EstimatorSettings) -> None:
        self._settings = settings
        self._tracker = PeopleTracker(settings, self._ids, self._method)
        self._camera: Optional[CameraModel] = None  # of the newest points
        self._still: Optional[Stillness] = None  # since when the depth is the same
        self._agreement = Agreement()  # of people with the depth

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Take other settings from the next frame on; people keep their ids, unless tracking begins or ends."""
        if settings.identity.tracking != self._settings.identity.tracking:
            self._begin(settings)  # ids of the detection service are not those that are given out here
        self._settings = settings
        self._tracker.reconfigure(settings)

    def expected(self, frame: Frame, skeleton: SkeletonModel) -> ExpectedPeople:
        """Return where the tracked people will be in the image of a frame, with the joints of a skeleton; no people
        for an unknown camera.
        """
        camera = self._camera_of((frame.grid.width, frame.grid.height))
        return ExpectedPeople.none(skeleton) if camera is None else self._tracker.expected(frame, camera, skeleton)

    def _camera_of(self, size: Tuple[int, int]) -> Optional[CameraModel]:
        """Return the camera at a resolution, width and height [px]; None if it is not known, or has another view."""
        try:
            return self._camera and self._camera.scaled(*size)
        except BadInputError:  # the driver has another mode now, and the next points tell its camera
            return None

    @np.errstate(invalid='ignore')  # what is missing is NaN, in every step
    def update(self, people_2d: People2D, frame: Frame, missed: Optional[np.ndarray] = None,
               worlds: Optional[np.ndarray] = None) -> Estimate:
        """Return the people of a frame.

        Args:
            people_2d: detections [px of the image]; ids are those of the tracks that expected them.
            missed: (M,) ids of tracks that were looked at and not found; None: all that have no detection.
            worlds: bodies of the detections, of a frame without depth, see `lift.monocular`; None: their sizes in the
                image place them.

        Raises:
            BadInputError: see `check_points`.
            ValueError: the frame has no points.
        """
        check_points(frame.grid, frame.image_size, self._settings)
        method, given = self._method, people_2d.ids
        present = np.flatnonzero(people_2d.present.any(axis=1))
        # from here on, the number of the detection stands in place of its id
        people_2d = replace(people_2d.select(present), ids=present)
        summary = None if frame.is_monocular else summarize(frame.grid, method.plausibility)
        if summary is not None and frame.bgr is not None:
            self._still = stillness(self._still, summary, frame.bgr, method.plausibility)
        camera = None
        if self._settings.needs_camera or frame.is_monocular:
            camera = frame.grid.camera_model() or self._camera_of((frame.grid.width, frame.grid.height))
        has_depth = summary is None or summary.doubt is None
        if camera is not None:
            looks = LookedAt(given, None if missed is None else np.append(missed, given), worlds)
            tracked = self._tracker.update(people_2d, looks, frame, camera, has_depth)
            if has_depth:
                self._camera, self._agreement = camera, self._agreement.with_frame(tracked.observed, method)
            unplaced = None if tracked.unplaced is None else _unnamed(tracked.unplaced)
            people = tracked.people if frame.is_monocular else calibrated(tracked.people, method.track.sigma)
            estimate = Estimate(people, tracked.people_2d, tracked.timing, unplaced, ids=tracked.ids)
        elif has_depth and not self._settings.needs_camera:
            params, people_2d = self._settings.lifting, replace(people_2d, ids=given[present])
            people = lift_by_window(people_2d, frame.image_size, frame.grid, params.window, params.statistic)
            estimate = Estimate(people, people_2d, ids=given)
        else:
            estimate = Estimate(People3D.empty(people_2d.skeleton), People2D.empty(people_2d.skeleton),
                                unplaced=_unnamed(people_2d), ids=np.full(len(given), -1))
        if summary is None:
            return estimate
        doubts = (summary.doubt, self._still and self._still.doubt(method.plausibility), self._agreement.doubt(method))
        return replace(estimate, points=summary, doubts=tuple(doubt for doubt in doubts if doubt))


def check_points(points: PointGrid, image_size: Tuple[int, int], settings: EstimatorSettings) -> None:
    """Check that points are of the view of an image with a width and height [px].

    Raises:
        BadInputError: image and points differ in aspect ratio, or the points are in no optical frame.
    """
    check_same_aspect('image', image_size, 'cloud', (points.width, points.height))
    if settings.needs_camera:
        points.camera_model()
