"""People in space from people in an image and the points of the same view: the table of contents of the method."""
import itertools
from dataclasses import dataclass, field, replace
from typing import Dict, Iterator, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.people import FIRST_ID, ExpectedPeople, People2D
from openpose_ros_pkg.stream.stage_timing import Stopwatch
from skeleton_extract_3d.body.extra_joints import in_skeleton
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import Frame, FrameView
from skeleton_extract_3d.lift.lifting import make_lifting
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.lift.window_mean import lift_by_window
from skeleton_extract_3d.people import INFERRED, People3D
from skeleton_extract_3d.points.camera import CameraModel, check_same_aspect
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.plausibility import Doubt, PointSummary, summarize
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.track.appearance import Clothes, observe_clothes
from skeleton_extract_3d.track.completion import complete, hidden_and_there, stand, walk_on
from skeleton_extract_3d.track.correction import correct
from skeleton_extract_3d.track.feet import follow_feet
from skeleton_extract_3d.track.identity import assign, compare, joined
from skeleton_extract_3d.track.memory import Memory
from skeleton_extract_3d.track.one_body import apart, separate
from skeleton_extract_3d.track.output import report
from skeleton_extract_3d.track.registered import registered, seen_bodies
from skeleton_extract_3d.track.reidentification import Reidentification, without
from skeleton_extract_3d.track.tracks import Observations, Tracks, expect

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
        points: summary of the points.
        doubts: likely faults of image and points.
    """

    people: People3D
    people_2d: People2D
    timing: Dict[str, float] = field(default_factory=dict)
    unplaced: Optional[People2D] = None
    points: Optional[PointSummary] = None
    doubts: Tuple[Doubt, ...] = ()

    @property
    def in_image(self) -> People2D:
        """All people in the image: `people_2d`, then those without a place in space."""
        return self.people_2d if self.unplaced is None else self.people_2d.joined(self.unplaced)

    @property
    def hidden(self) -> np.ndarray:
        """Which joints of `people_2d` are INFERRED, (P, K) bool."""
        return self.people.status[:len(self.people_2d)] == INFERRED


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
        self._memory = Memory()
        self._take(settings)

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Take other settings from the next frame on; people keep their ids, unless tracking begins or ends."""
        if settings.identity.tracking != self._settings.identity.tracking:
            # ids of the detection service are not those that are given out here
            self._memory = Memory()
        self._take(settings)

    def _take(self, settings: EstimatorSettings) -> None:
        self._settings = settings
        self._lifting = make_lifting(settings.lifting, settings.occlusion.occlusion, self._method)
        self._reidentification = Reidentification(settings.identity, self._ids, self._method)

    def expected(self, stamp: float, image_size: Tuple[int, int]) -> Optional[ExpectedPeople]:
        """Return where the tracked people will be in an image; see `Memory.expected`."""
        return self._memory.expected(stamp, image_size, self._settings)

    @np.errstate(invalid='ignore')  # what is missing is NaN, in every step
    def update(self, people_2d: People2D, frame: Frame) -> Estimate:
        """Return the people of a frame.

        Args:
            people_2d: keypoints [px of the image].

        Raises:
            BadInputError: see `check_points`.
            ValueError: the frame has no points.
        """
        check_points(frame.grid, frame.image_size, self._settings)
        method, present = self._method, people_2d.present.any(axis=1)
        if not present.all():
            people_2d = people_2d.select(np.flatnonzero(present))
        summary = summarize(frame.grid, method.plausibility)
        memory = self._memory.with_points(frame, summary, method)
        camera = None
        if self._settings.needs_camera:
            camera = frame.grid.camera_model() or memory.camera_of((frame.grid.width, frame.grid.height))
        if camera is not None:
            self._memory, estimate = self._tracked(memory, people_2d, frame, camera, summary.doubt is None)
        elif summary.doubt is None and not self._settings.needs_camera:
            params = self._settings.lifting
            people = lift_by_window(people_2d, frame.image_size, frame.grid, params.window, params.statistic)
            self._memory, estimate = memory, Estimate(people, people_2d)
        else:
            self._memory, estimate = memory, Estimate(
                People3D.empty(people_2d.skeleton), People2D.empty(people_2d.skeleton), unplaced=_unnamed(people_2d))
        doubts = (summary.doubt, memory.still and memory.still.doubt(method.plausibility),
                  self._memory.agreement.doubt(method))
        return replace(estimate, points=summary, doubts=tuple(doubt for doubt in doubts if doubt))

    def _tracked(self, memory: Memory, people_2d: People2D, frame: Frame, camera: CameraModel, has_depth: bool
                 ) -> Tuple[Memory, Estimate]:
        """Return the memory after a frame, and its people; without depth, which is no measurement, the memory stays."""
        if has_depth:
            people = self._identified(memory, people_2d, frame, camera)
            agreement = memory.agreement.with_frame(people.observed, self._method)
            return self._placed(people._replace(memory=replace(people.memory, agreement=agreement)))
        empty = OrganizedCloud.without_points(frame.grid.width, frame.grid.height)
        people = self._identified(memory, people_2d, replace(frame, points=empty), camera)
        unplaced = people.observed.people_2d.select(np.flatnonzero(people.row < 0))
        _, estimate = self._placed(people.select(np.flatnonzero(people.row >= 0)))
        return memory, replace(estimate, unplaced=_unnamed(unplaced))

    def _identified(self, memory: Memory, people_2d: People2D, frame: Frame, camera: CameraModel) -> '_Identified':
        """Return the people of a frame with the rows of their tracks."""
        settings, method, clock = self._settings, self._method, Stopwatch()
        memory, view = memory.at(frame, camera, settings.identity, method.track)
        expected = memory.tracks.predicted(view.elapsed, settings.smoothing, method.body)
        bgr = frame.bgr if settings.identity.use_clothes else None
        observed = observe(people_2d, frame.image_size, view.points, camera, method)
        clothes = observe_clothes(observed, view.points, bgr, method)
        clock.lap('observe')
        compared = compare(expected, observed, method)
        row = assign(expected, clothes, compared, view.stamp, settings.identity, method.track.identity)
        whole, row = joined(expected, observed, compared, row, method)
        if whole is not observed.people_2d:
            observed = observe(whole, frame.image_size, view.points, camera, method)
            clothes = observe_clothes(observed, view.points, bgr, method)
        found = registered(observed, row, expected, memory, view, method)
        if found.people is not observed.people_2d:
            observed = observe(found.people, frame.image_size, view.points, camera, method)
            row, observed = found.row, replace(observed, error=found.error, unseen=found.unseen)
            clothes = observe_clothes(observed, view.points, bgr, method)
        clock.lap('identity')
        return _Identified(found.memory, view, expected, row, observed, clothes, clock.laps)

    def _placed(self, found: '_Identified') -> Tuple[Memory, Estimate]:
        """Return the memory after a frame and its people, lifted and with their tracks corrected."""
        settings, method, clock, view = self._settings, self._method, Stopwatch(), found.view
        before, occlusion = found.memory.tracks, settings.occlusion
        expectation = expect(found.expected, found.row, method)
        lifted = self._lifting.lift(found.observed, view.points, expectation)
        lifted = lifted._replace(measured=lifted.measured & ~found.observed.unseen)
        clock.lap('lift')
        memory, tracks, people = self._reidentification.welcome(
            found.memory, found.expected, Observations(found.row, found.observed, found.clothes, lifted), view.stamp)
        seen = correct(tracks.select(people.row), people, view.stamp, occlusion, method)
        clock.lap('filter')
        unseen = people.others(len(before))
        if occlusion.occlusion:
            seen = complete(seen, view, occlusion.inference_timeout, method)
            lost = walk_on(without(before.select(unseen), seen.tracks), view, method)
            hidden = lost.select(hidden_and_there(lost, view, method))
        else:
            lost, hidden = without(found.expected.select(unseen), seen.tracks), Tracks.none()
        seen, people, misplaced = separate(seen, people, view.stamp, method.track)
        if view.floor is not None and occlusion.occlusion:
            seen = stand(seen, people.lifted.measured, view.floor, method)
        hidden = apart(hidden, seen, method.track.one_body)
        output = report(people, seen, hidden, view.stamp, settings, method.track.correction)
        statures = np.concatenate([seen.tracks.sizes.stature, hidden.sizes.stature])
        feet, toes = follow_feet(found.memory.feet, output, statures, people.observed, view, method)
        output = in_skeleton(output, people.observed, toes, view, method)
        memory = replace(memory, feet=feet, tracks=seen.tracks.joined(lost).joined(misplaced).in_order(),
                         gone=without(memory.gone, seen.tracks),
                         seen=seen_bodies(memory, seen, people, view, method))
        clock.lap('complete')
        people_2d = replace(people.observed.people_2d, ids=seen.tracks.ids)
        return memory, Estimate(output, people_2d, {**found.laps, **clock.laps})


class _Identified(NamedTuple):
    """The P people of a frame with the rows (P,) of their tracks, -1: none, before lifting; `memory` at the time of the
    frame, `expected` tracks predicted to it, durations of the stages until now [s].
    """

    memory: Memory
    view: FrameView
    expected: Tracks
    row: np.ndarray
    observed: ObservedPeople
    clothes: Clothes
    laps: Dict[str, float]

    def select(self, people: np.ndarray) -> '_Identified':
        """Return some of the people, by indices."""
        return self._replace(row=self.row[people], observed=self.observed.select(people),
                             clothes=self.clothes.select(people))


def check_points(points: PointGrid, image_size: Tuple[int, int], settings: EstimatorSettings) -> None:
    """Check that points are of the view of an image with a width and height [px].

    Raises:
        BadInputError: image and points differ in aspect ratio, or the points are in no optical frame.
    """
    check_same_aspect('image', image_size, 'cloud', (points.width, points.height))
    if settings.needs_camera:
        points.camera_model()
