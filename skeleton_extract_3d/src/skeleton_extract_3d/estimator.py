"""People in space from people in an image and the points of the same view: the table of contents of the method."""
import itertools
from dataclasses import dataclass, field, replace
from typing import Dict, Iterator, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.detect.existence import EXISTENCE
from openpose_ros_pkg.people import FIRST_ID, ExpectedPeople, People2D
from openpose_ros_pkg.skeletons import SkeletonModel
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
from skeleton_extract_3d.track.completion import Completion, complete, stand, walk_on
from skeleton_extract_3d.track.correction import correct
from skeleton_extract_3d.track.existence import (
    after_time,
    evidence_of,
    views_of,
    with_detection,
    without_detection,
)
from skeleton_extract_3d.track.feet import follow_feet
from skeleton_extract_3d.track.identity import assign, compare, joined
from skeleton_extract_3d.track.memory import Memory
from skeleton_extract_3d.track.one_body import apart, sharing
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

    def expected(self, frame: Frame, skeleton: SkeletonModel) -> ExpectedPeople:
        """Return where the tracked people will be in the image of a frame, with the joints of a skeleton."""
        return self._memory.expected(frame, skeleton, self._settings, self._method)

    @np.errstate(invalid='ignore')  # what is missing is NaN, in every step
    def update(self, people_2d: People2D, frame: Frame, missed: Optional[np.ndarray] = None) -> Estimate:
        """Return the people of a frame.

        Args:
            people_2d: detections [px of the image]; ids are those of the tracks that expected them.
            missed: (M,) ids of tracks that were looked at and not found; None: all that have no detection.

        Raises:
            BadInputError: see `check_points`.
            ValueError: the frame has no points.
        """
        check_points(frame.grid, frame.image_size, self._settings)
        method, given = self._method, people_2d.ids
        present = np.flatnonzero(people_2d.present.any(axis=1))
        # from here on, the number of the detection stands in place of its id
        people_2d = replace(people_2d.select(present), ids=present)
        summary = summarize(frame.grid, method.plausibility)
        memory = self._memory.with_points(frame, summary, method)
        camera = None
        if self._settings.needs_camera:
            camera = frame.grid.camera_model() or memory.camera_of((frame.grid.width, frame.grid.height))
        if camera is not None:
            looks = _Looks(given, None if missed is None else np.append(missed, given))
            self._memory, estimate = self._tracked(memory, people_2d, looks, (frame, camera), summary.doubt is None)
        elif summary.doubt is None and not self._settings.needs_camera:
            params, people_2d = self._settings.lifting, replace(people_2d, ids=given[present])
            people = lift_by_window(people_2d, frame.image_size, frame.grid, params.window, params.statistic)
            self._memory, estimate = memory, Estimate(people, people_2d, ids=given)
        else:
            self._memory, estimate = memory, Estimate(
                People3D.empty(people_2d.skeleton), People2D.empty(people_2d.skeleton), unplaced=_unnamed(people_2d),
                ids=np.full(len(given), -1))
        doubts = (summary.doubt, memory.still and memory.still.doubt(method.plausibility),
                  self._memory.agreement.doubt(method))
        return replace(estimate, points=summary, doubts=tuple(doubt for doubt in doubts if doubt))

    def _tracked(self, memory: Memory, people_2d: People2D, looks: '_Looks', taken: Tuple[Frame, CameraModel],
                 has_depth: bool) -> Tuple[Memory, Estimate]:
        """Return the memory after a frame, and its people; without depth, which is no measurement, the memory stays."""
        frame, camera = taken
        if has_depth:
            people = self._identified(memory, people_2d, looks, frame, camera)
            agreement = memory.agreement.with_frame(people.observed, self._method)
            return self._placed(people._replace(memory=replace(people.memory, agreement=agreement)), looks)
        empty = OrganizedCloud.without_points(frame.grid.width, frame.grid.height)
        people = self._identified(memory, people_2d, looks, replace(frame, points=empty), camera)
        unplaced = people.observed.people_2d.select(np.flatnonzero(people.row < 0))
        after, estimate = self._placed(people.select(np.flatnonzero(people.row >= 0)), looks)
        return memory.with_existence(after.tracks), replace(estimate, unplaced=_unnamed(unplaced))

    def _identified(self, memory: Memory, people_2d: People2D, looks: '_Looks', frame: Frame, camera: CameraModel
                    ) -> '_Identified':
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
        # where a look at a body in free view found no person, the surface there is another one's
        open_view = views_of(expected, view, method).visible >= EXISTENCE.free_view
        lost = np.setdiff1d(np.flatnonzero(~(looks.of(expected) & open_view)), row)
        found = registered(observed, expected, lost, memory, view, method)
        if len(found.row):
            observed = observe(found.people, frame.image_size, view.points, camera, method)
            row, observed = np.append(row, found.row), replace(observed, error=found.error, unseen=found.unseen)
            clothes = observe_clothes(observed, view.points, bgr, method)
        clock.lap('identity')
        return _Identified(found.memory, view, expected, row, observed, clothes, clock.laps)

    def _placed(self, found: '_Identified', looks: '_Looks') -> Tuple[Memory, Estimate]:
        """Return the memory after a frame and its people, lifted and with their tracks corrected."""
        settings, method, clock, view = self._settings, self._method, Stopwatch(), found.view
        before, occlusion = found.memory.tracks, settings.occlusion
        expectation = expect(found.expected, found.row, method)
        lifted = self._lifting.lift(found.observed, view.points, expectation)
        lifted = lifted._replace(measured=lifted.measured & ~found.observed.unseen)
        clock.lap('lift')
        memory, tracks, people = self._reidentification.welcome(
            found.memory, found.expected, Observations(found.row, found.observed, found.clothes, lifted), view.stamp,
            looks.given)
        seen = correct(tracks.select(people.row), people, view.stamp, occlusion, method)
        clock.lap('filter')
        if occlusion.occlusion:
            seen = complete(seen, view, occlusion.inference_timeout, method)
        if settings.identity.tracking:  # the detection of a person in the place of another one is that of the other
            kept = np.flatnonzero(~sharing(seen, people.observed.people_2d.looked, method.track))
            seen, people = seen.select(kept), people.select(kept)
        unseen = people.others(len(before))
        if occlusion.occlusion:
            lost = walk_on(without(before.select(unseen), seen.tracks), view, method)
        else:
            lost = without(found.expected.select(unseen), seen.tracks)
        seen, lost = self._believed(seen, lost, people, tracks, looks, view)
        if view.floor is not None and occlusion.occlusion:
            seen = stand(seen, people.lifted.measured, view.floor, method)
        reported = np.flatnonzero((seen.tracks.existence >= EXISTENCE.reported) | (not settings.identity.tracking))
        shown, of_shown = seen.select(reported), people.select(reported)
        hidden = Tracks.none()
        if occlusion.occlusion:
            inside = views_of(lost, view, method).inside > 0.5
            hidden = apart(lost.select((lost.existence >= EXISTENCE.reported) & inside), seen, method.track.one_body)
        output = report(of_shown, shown, hidden, view.stamp, settings, method.track.correction)
        statures = np.concatenate([shown.tracks.sizes.stature, hidden.sizes.stature])
        feet, toes = follow_feet(found.memory.feet, output, statures, of_shown.observed, view, method)
        output = in_skeleton(output, of_shown.observed, toes, view, method)
        memory = replace(memory, feet=feet, tracks=seen.tracks.joined(lost).in_order(),
                         gone=without(memory.gone, seen.tracks),
                         seen=seen_bodies(memory, seen, people, view, method))
        clock.lap('complete')
        ids, number = np.full(len(looks.given), -1), people.observed.people_2d.ids
        ids[number[number >= 0]] = seen.tracks.ids[number >= 0]
        people_2d = replace(of_shown.observed.people_2d, ids=shown.tracks.ids, existence=shown.tracks.existence)
        return memory, Estimate(output, people_2d, {**found.laps, **clock.laps}, ids=ids)

    def _believed(self, seen: Completion, lost: Tracks, people: Observations, tracks: Tracks, looks: '_Looks',
                  view: FrameView) -> Tuple[Completion, Tracks]:
        """Return people with a detection, and tracks without, after all evidence of a frame on their existence.

        Args:
            tracks: before the frame, predicted to it, and then those that it began.
        """
        method, timeout = self._method, self._settings.identity.track_timeout
        expected = tracks.select(people.row)
        views = views_of(replace(expected, has=expected.has | seen.placed), view, method)
        before = after_time(expected, views, view.stamp, timeout)
        since = np.where(expected.born == view.stamp, np.inf, view.stamp - expected.looked)
        evidence = evidence_of(people.observed, people.lifted, since, view, method)
        seen = seen._replace(tracks=with_detection(seen.tracks, before, evidence, view.stamp))
        return seen, without_detection(lost, looks.of(lost), view, timeout, method)


class _Looks(NamedTuple):
    """What was looked at in a frame: ids (P,) that came with the detections, and ids of the tracks that were looked at;
    None: all were.
    """

    given: np.ndarray
    looked: Optional[np.ndarray]

    def of(self, tracks: Tracks) -> np.ndarray:
        """Return which tracks were looked at, (T,) bool."""
        return np.ones(len(tracks), bool) if self.looked is None else np.isin(tracks.ids, self.looked)


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
