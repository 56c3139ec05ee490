"""From the people in an image and the points of the same view to people in space: the order of all steps."""
import itertools
from dataclasses import dataclass, field, replace
from typing import Dict, Iterator, Optional, Protocol, Tuple

import numpy as np

from openpose_ros_pkg.people import FIRST_ID, People2D
from openpose_ros_pkg.stream.stage_timing import Stopwatch
from skeleton_extract_3d.body.extra_joints import in_skeleton
from skeleton_extract_3d.frame import CameraFrame, View
from skeleton_extract_3d.lift.lifting import LiftingParams, make_lifting
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.lift.window_mean import lift_by_window
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.camera import check_same_aspect
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.track.answer import report
from skeleton_extract_3d.track.appearance import observe_clothes
from skeleton_extract_3d.track.completion import Completion, complete
from skeleton_extract_3d.track.correction import correct
from skeleton_extract_3d.track.expectation import expect
from skeleton_extract_3d.track.identity import assign
from skeleton_extract_3d.track.memory import Memory
from skeleton_extract_3d.track.out_of_sight import hidden_and_there, walk_on
from skeleton_extract_3d.track.sightings import Sightings, begin_tracks
from skeleton_extract_3d.track.standing import stand
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
    """

    people: People3D
    people_2d: People2D
    timing: Dict[str, float] = field(default_factory=dict)


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
        single = settings.lifting.lifting == 'mean3x3' and not settings.identity.tracking
        self._method: _Method = _WindowMeans(settings.lifting) if single else _Following(settings, self._ids)

    def update(self, people_2d: People2D, frame: CameraFrame) -> Estimate:
        """Return the people of a frame.

        Args:
            people_2d: keypoints [px of the image].

        Raises:
            BadInputError: image and points differ in aspect ratio, or the points are in no optical frame.
        """
        check_same_aspect('image', frame.image_size, 'cloud', (frame.points.width, frame.points.height))
        present = people_2d.present.any(axis=1)
        if not present.all():
            people_2d = people_2d.select(np.flatnonzero(present))
        self._memory, estimate = self._method.update(self._memory, people_2d, frame)
        return estimate

    def expected(self, stamp: float, image_size: Tuple[int, int]) -> Optional[People2D]:
        """Return where the people who are followed will be in an image; see `Memory.expected`."""
        return self._memory.expected(stamp, image_size, self._settings.smoothing)


class _Method(Protocol):
    """What makes people in space of people in an image."""

    def update(self, memory: Memory, people_2d: People2D, frame: CameraFrame) -> Tuple[Memory, Estimate]:
        """Return what is remembered of a frame, and its people."""


class _WindowMeans:
    """The method of the original: every frame for itself, every joint at the mean of the points around its pixel."""

    def __init__(self, params: LiftingParams) -> None:
        self._params = params

    def update(self, memory: Memory, people_2d: People2D, frame: CameraFrame) -> Tuple[Memory, Estimate]:
        """See `_Method`."""
        people = lift_by_window(people_2d, frame.image_size, frame.points, self._params.window, self._params.statistic)
        return memory, Estimate(people, people_2d)


class _Following:
    """The method of this package: people are lifted as a whole and followed from frame to frame."""

    def __init__(self, settings: EstimatorSettings, ids: Iterator[int]) -> None:
        self._settings, self._ids = settings, ids
        self._lifting = make_lifting(settings.lifting, settings.occlusion.occlusion)

    def update(self, memory: Memory, people_2d: People2D, frame: CameraFrame) -> Tuple[Memory, Estimate]:
        """See `_Method`."""
        settings, clock = self._settings, Stopwatch()
        camera = frame.points.camera_model() or memory.camera
        if camera is None:
            return memory, Estimate(People3D.empty(people_2d.skeleton), People2D.empty(people_2d.skeleton))
        memory, view = memory.at(frame, camera, settings.identity)
        expected = memory.tracks.predicted(view.elapsed, settings.smoothing)
        observed = observe(people_2d, frame.image_size, view.points, camera)
        clock.lap('observe')
        clothes = observe_clothes(observed, view.points, frame.bgr if settings.identity.use_clothes else None)
        row = assign(expected, observed, clothes, view.stamp, settings.identity)
        clock.lap('identity')
        lifted = self._lifting.lift(observed, view.points, expect(expected, row, view.elapsed))
        clock.lap('lift')
        tracks, people = begin_tracks(expected, Sightings(row, observed, clothes, lifted), view.stamp, self._ids,
                                      settings.identity)
        seen = correct(tracks.select(people.row), people, view.stamp, settings.occlusion)
        clock.lap('filter')
        seen, unseen, hidden = self._infer(seen, memory.tracks, expected, people.others(len(expected)), view)
        if view.floor is not None and settings.occlusion.occlusion:
            seen = stand(seen, people.lifted.measured, view.floor)
        answer = report(people, seen, hidden, view.stamp, settings)
        people_2d = replace(people.observed.people_2d, ids=seen.tracks.ids)
        answer = in_skeleton(answer, people_2d, frame.image_size, view.points, camera, view.floor)
        clock.lap('complete')
        memory = replace(memory, tracks=seen.tracks.joined(unseen).in_order())
        return memory, Estimate(answer, people_2d, clock.laps)

    def _infer(self, seen: Completion, before: Tracks, expected: Tracks, unseen: np.ndarray, view: View
               ) -> Tuple[Completion, Tracks, Tracks]:
        """Return the people who were seen with their other joints, those who were not seen, and who of them is there.

        Args:
            before, expected: all tracks as the frame before left them, and with constant velocity.
            unseen: (T,) bool, which of them were not seen.
        """
        if not self._settings.occlusion.occlusion:
            return seen, expected.kept(unseen), Tracks.none()
        seen = complete(seen, view, self._settings.occlusion.inference_timeout)
        if not unseen.any():
            return seen, Tracks.none(), Tracks.none()
        tracks = walk_on(before.kept(unseen), view)
        return seen, tracks, tracks.kept(hidden_and_there(tracks, view))
