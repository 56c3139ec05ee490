"""From the people in an image and the points of the same view to people in space: the order of all steps."""
import itertools
from dataclasses import dataclass, field, replace
from typing import Dict, Iterator, Optional, Protocol, Tuple

import numpy as np

from openpose_ros_pkg.people import FIRST_ID, People2D
from openpose_ros_pkg.stream.stage_timing import Stopwatch
from skeleton_extract_3d.body.extra_joints import in_skeleton
from skeleton_extract_3d.frame import Frame, View
from skeleton_extract_3d.lift.lifting import LiftingParams, make_lifting
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.lift.window_mean import lift_by_window
from skeleton_extract_3d.people import INFERRED, People3D
from skeleton_extract_3d.points.camera import check_same_aspect
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.plausibility import Doubt, PointSummary, summarize
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.track.appearance import observe_clothes
from skeleton_extract_3d.track.completion import Completion, complete
from skeleton_extract_3d.track.correction import correct
from skeleton_extract_3d.track.expectation import expect
from skeleton_extract_3d.track.floor_contact import stand
from skeleton_extract_3d.track.identity import assign, joined
from skeleton_extract_3d.track.memory import Memory
from skeleton_extract_3d.track.observations import Sightings, apart, separate
from skeleton_extract_3d.track.out_of_sight import hidden_and_there, walk_on
from skeleton_extract_3d.track.output import report
from skeleton_extract_3d.track.reidentification import welcome, without
from skeleton_extract_3d.track.tracks import Tracks

# Stages of `Estimate.timing`, in order.
STAGES = ('observe', 'identity', 'lift', 'filter', 'complete')


@dataclass(frozen=True)
class Estimate:
    """The people of one frame.

    Attributes:
        people: in the frame of the points: first those of `people_2d`, in the same order, then those whom the image
            does not show at present.
        people_2d: as they were detected, with the ids of `people`; without those whom the points do not confirm.
        timing: seconds by stage, see `STAGES`.
        unplaced: other people in the image, without ids, where there is no depth that could confirm them.
        points: what the points are like.
        doubts: what seems to be wrong with image and points.
    """

    people: People3D
    people_2d: People2D
    timing: Dict[str, float] = field(default_factory=dict)
    unplaced: Optional[People2D] = None
    points: Optional[PointSummary] = None
    doubts: Tuple[Doubt, ...] = ()

    @property
    def in_image(self) -> People2D:
        """Everybody who is seen in the image: `people_2d`, then those without a place in space."""
        return self.people_2d if self.unplaced is None else self.people_2d.joined(self.unplaced)

    @property
    def hidden(self) -> np.ndarray:
        """Which joints of `people_2d` are INFERRED, (P, K) bool."""
        return self.people.status[:len(self.people_2d)] == INFERRED


def _unnamed(people: People2D) -> People2D:
    return replace(people, ids=np.full(len(people), -1))


def _nobody(people_2d: People2D) -> Estimate:
    """Return that nobody of the image has a place in space."""
    skeleton = people_2d.skeleton
    return Estimate(People3D.empty(skeleton), People2D.empty(skeleton), unplaced=_unnamed(people_2d))


class PeopleEstimator:
    """Follows the people before one camera; not thread-safe.

    Args:
        settings: what the user has set.
        ids: where new people's ids come from: estimators that share it never give the same one. None: 1, 2, 3, ...
    """

    def __init__(self, settings: EstimatorSettings, ids: Optional[Iterator[int]] = None) -> None:
        self._ids = itertools.count(FIRST_ID) if ids is None else ids
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
        self._method: _Method = (_Following(settings, self._ids) if settings.needs_camera
                                 else _WindowMeans(settings.lifting))

    def update(self, people_2d: People2D, frame: Frame) -> Estimate:
        """Return the people of a frame.

        Args:
            people_2d: keypoints [px of the image].

        Raises:
            BadInputError: see `check_points`.
        """
        check_points(frame.grid, frame.image_size, self._settings)
        present = people_2d.present.any(axis=1)
        if not present.all():
            people_2d = people_2d.select(np.flatnonzero(present))
        summary = summarize(frame.grid)
        memory = self._memory.with_points(frame, summary)
        self._memory, estimate = self._method.update(memory, people_2d, frame, summary.doubt is None)
        doubts = (summary.doubt, self._memory.still and self._memory.still.doubt(), self._memory.agreement.doubt())
        return replace(estimate, points=summary, doubts=tuple(doubt for doubt in doubts if doubt))

    def expected(self, stamp: float, image_size: Tuple[int, int]) -> Optional[People2D]:
        """Return where the people who are followed will be in an image; see `Memory.expected`."""
        return self._memory.expected(stamp, image_size, self._settings)


def check_points(points: PointGrid, image_size: Tuple[int, int], settings: EstimatorSettings) -> None:
    """Check that points are of the view of an image.

    Args:
        image_size: width and height [px].

    Raises:
        BadInputError: image and points differ in aspect ratio, or the points are in no optical frame.
    """
    check_same_aspect('image', image_size, 'cloud', (points.width, points.height))
    if settings.needs_camera:
        points.camera_model()


class _Method(Protocol):
    """What makes people in space of people in an image."""

    def update(self, memory: Memory, people_2d: People2D, frame: Frame, has_depth: bool
               ) -> Tuple[Memory, Estimate]:
        """Return what is remembered of a frame, and its people.

        Args:
            has_depth: the points are depth in metres.
        """


class _WindowMeans:
    """The method of the original: every frame for itself, every joint at the mean of the points around its pixel."""

    def __init__(self, params: LiftingParams) -> None:
        self._params = params

    def update(self, memory: Memory, people_2d: People2D, frame: Frame, has_depth: bool
               ) -> Tuple[Memory, Estimate]:
        """See `_Method`."""
        if not has_depth:
            return memory, _nobody(people_2d)
        people = lift_by_window(people_2d, frame.image_size, frame.grid, self._params.window, self._params.statistic)
        return memory, Estimate(people, people_2d)


class _Following:
    """The method of this package: people are lifted as a whole and followed from frame to frame."""

    def __init__(self, settings: EstimatorSettings, ids: Iterator[int]) -> None:
        self._settings, self._ids = settings, ids
        self._lifting = make_lifting(settings.lifting, settings.occlusion.occlusion)

    def update(self, memory: Memory, people_2d: People2D, frame: Frame, has_depth: bool
               ) -> Tuple[Memory, Estimate]:
        """See `_Method`."""
        settings, clock = self._settings, Stopwatch()
        camera = frame.grid.camera_model() or memory.camera_of((frame.grid.width, frame.grid.height))
        if camera is None:
            return memory, _nobody(people_2d)
        if not has_depth:
            frame = replace(frame, points=OrganizedCloud.without_points(frame.grid.width, frame.grid.height))
        before, (memory, view) = memory, memory.at(frame, camera, settings.identity)
        expected = memory.tracks.predicted(view.elapsed, settings.smoothing)
        observed = observe(people_2d, frame.image_size, view.points, camera)
        clock.lap('observe')
        clothes = observe_clothes(observed, view.points, frame.bgr if settings.identity.use_clothes else None)
        row = assign(expected, observed, clothes, view.stamp, settings.identity)
        people_2d, row = joined(expected, observed, row)
        if people_2d is not observed.people_2d:
            observed = observe(people_2d, frame.image_size, view.points, camera)
            clothes = observe_clothes(observed, view.points, frame.bgr if settings.identity.use_clothes else None)
        unplaced = None
        if has_depth:
            memory = replace(memory, agreement=memory.agreement.with_frame(observed))
        else:  # newcomers would be placed by their size alone
            unplaced = _unnamed(people_2d.select(np.flatnonzero(row < 0)))
            followed = np.flatnonzero(row >= 0)
            row, observed, clothes = row[followed], observed.select(followed), clothes.select(followed)
        clock.lap('identity')
        lifted = self._lifting.lift(observed, view.points, expect(expected, row, view.elapsed))
        clock.lap('lift')
        memory, tracks, people = welcome(memory, expected, Sightings(row, observed, clothes, lifted), view.stamp,
                                         self._ids, settings.identity)
        seen = correct(tracks.select(people.row), people, view.stamp, settings.occlusion)
        clock.lap('filter')
        seen, unseen, hidden = self._infer(seen, memory.tracks, expected, people.others(len(expected)), view)
        seen, people, misplaced = separate(seen, people, view.stamp)
        if view.floor is not None and settings.occlusion.occlusion:
            seen = stand(seen, people.lifted.measured, view.floor)
        answer = report(people, seen, apart(hidden, seen), view.stamp, settings)
        people_2d = replace(people.observed.people_2d, ids=seen.tracks.ids)
        answer = in_skeleton(answer, people_2d, frame.image_size, view.points, camera, view.floor)
        clock.lap('complete')
        estimate = Estimate(answer, people_2d, clock.laps, unplaced)
        if not has_depth:  # guesses by size are no news of those who are followed
            return before, estimate
        return replace(memory, tracks=seen.tracks.joined(unseen).joined(misplaced).in_order(),
                       gone=without(memory.gone, seen.tracks)), estimate

    def _infer(self, seen: Completion, before: Tracks, expected: Tracks, unseen: np.ndarray, view: View
               ) -> Tuple[Completion, Tracks, Tracks]:
        """Return the people who were seen with their other joints, those who were not seen, and who of them is there.

        Args:
            before, expected: all tracks as the frame before left them, and with constant velocity.
            unseen: (T,) bool, which of them were not seen.
        """
        if not self._settings.occlusion.occlusion:
            return seen, without(expected.kept(unseen), seen.tracks), Tracks.none()
        seen = complete(seen, view, self._settings.occlusion.inference_timeout)
        if not unseen.any():
            return seen, Tracks.none(), Tracks.none()
        tracks = walk_on(without(before.kept(unseen), seen.tracks), view)
        return seen, tracks, tracks.kept(hidden_and_there(tracks, view))
