"""Who is there, and who is who: `PeopleTracker.update` tells it of a frame."""
from dataclasses import replace
from typing import Dict, Iterator, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.detect.existence import EXISTENCE
from openpose_ros_pkg.detect.tracking import TRACKING
from openpose_ros_pkg.people import ExpectedPeople, People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_18, SkeletonModel
from openpose_ros_pkg.stream.stage_timing import Stopwatch
from skeleton_extract_3d.body.extra_joints import in_skeleton
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import Frame, FrameView
from skeleton_extract_3d.lift.lifting import make_lifting
from skeleton_extract_3d.lift.monocular import lift_bodies
from skeleton_extract_3d.lift.observation import grid_positions, observe
from skeleton_extract_3d.lift.records import Lifted, ObservedPeople
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.track.appearance import Clothes, observe_clothes
from skeleton_extract_3d.track.completion import Completion, complete, stand, walk_on
from skeleton_extract_3d.track.constants import CorrectionConstants
from skeleton_extract_3d.track.correction import correct
from skeleton_extract_3d.track.existence import (
    after_time,
    evidence_of,
    views_of,
    with_detection,
    without_detection,
)
from skeleton_extract_3d.track.feet import Feet, follow_feet
from skeleton_extract_3d.track.identity import assign, compare, joined
from skeleton_extract_3d.track.memory import Memory
from skeleton_extract_3d.track.one_body import apart, sharing
from skeleton_extract_3d.track.registered import registered, seen_bodies
from skeleton_extract_3d.track.reidentification import STRANGER, UNCLEAR, NewPeople, new_people, recognize
from skeleton_extract_3d.track.sides import sides_of
from skeleton_extract_3d.track.tracks import Observations, Tracks, expect, without


class TrackedPeople(NamedTuple):
    """The people of a frame, see `Estimate`; `observed`: all detections."""

    people: People3D
    people_2d: People2D
    unplaced: Optional[People2D]
    ids: np.ndarray
    observed: ObservedPeople
    timing: Dict[str, float]


class LookedAt(NamedTuple):
    """What was looked at in a frame: ids (P,) that came with the detections, ids of the tracks that were looked at,
    None: all were; and bodies of the detections (P, 18, 3), see `lift.monocular`.
    """

    given: np.ndarray
    looked: Optional[np.ndarray]
    worlds: Optional[np.ndarray] = None

    def of(self, tracks: Tracks) -> np.ndarray:
        """Return which tracks were looked at, (T,) bool."""
        return np.ones(len(tracks), bool) if self.looked is None else np.isin(tracks.ids, self.looked)


class PeopleTracker:
    """Tracks the people before one camera; not thread-safe.

    A track is **born** of a person who is assigned to none. It is **kept** by detections, or without them by looks and
    points that tell nothing against it: each changes the probability that the person is there. People are **reported**
    from a probability of `EXISTENCE.reported` on, and **given up** below `EXISTENCE.ended` or `track_timeout` after
    the last detection. Who comes back within `return_timeout` gets the old id if clothes, size and place agree.

    Args:
        settings: of the user.
        ids: source of ids for new people.
        method: constants of all steps.
    """

    def __init__(self, settings: EstimatorSettings, ids: Iterator[int], method: MethodConstants = METHOD) -> None:
        self._ids, self._method = ids, method
        self.memory = Memory()
        self.reconfigure(settings)

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Take other settings from the next frame on."""
        self._settings = settings
        self._lift = make_lifting(settings.lifting, settings.occlusion.occlusion, self._method)

    def update(self, people_2d: People2D, looks: LookedAt, frame: Frame, camera: CameraModel, has_depth: bool = True
               ) -> TrackedPeople:
        """Return the people of a frame.

        Without depth, which is no measurement, tracks stay as they are, but for their existence.

        Args:
            people_2d: P detections [px of the image], numbered by `ids`.
            looks: which people were looked at, and what expected the detections, by their numbers.
            camera: of the points.
        """
        settings, method, clock, unplaced = self._settings, self._method, Stopwatch(), None
        occlusion, tracking = settings.occlusion.occlusion, settings.identity.tracking
        if not has_depth:
            frame = replace(frame, points=OrganizedCloud.without_points(frame.grid.width, frame.grid.height))
        memory, view = self._given_up(frame, camera)
        before = memory.tracks
        expected = before.predicted(view.elapsed, settings.smoothing, method.body)
        seen_now = self._observed(people_2d, frame, view)
        clock.lap('observe')
        memory, row, observed, clothes = self._identified(memory, expected, seen_now, looks, frame, view)
        clock.lap('identity')
        all_observed = observed
        if not has_depth:
            unplaced, placed = observed.people_2d.select(np.flatnonzero(row < 0)), np.flatnonzero(row >= 0)
            row, observed, clothes = row[placed], observed.select(placed), clothes.select(placed)
        worlds = None if looks.worlds is None else looks.worlds[observed.people_2d.ids]
        observed, lifted, trust = self._lifted(observed, expected, row, view, worlds)
        people = Observations(row, observed, clothes, lifted, trust)
        clock.lap('lift')
        memory, tracks, people = self._born(memory, expected, people, view.stamp, looks.given)
        seen = correct(tracks.select(people.row), people, view.stamp, settings.occlusion, method)
        clock.lap('filter')
        if occlusion:
            seen = complete(seen, view, settings.occlusion.inference_timeout, method)
        if tracking:  # the detection of a person in the place of another one is that of the other
            kept = np.flatnonzero(~sharing(seen, people.observed.people_2d.looked, method.track))
            seen, people = seen.select(kept), people.select(kept)
        undetected = (before if occlusion else expected).select(people.others(len(before)))
        lost = without(undetected, seen.tracks)
        if occlusion:
            lost = walk_on(lost, view, method)
        seen, lost = self._kept(seen, lost, people, tracks, looks, view)
        if view.floor is not None and occlusion:
            seen = stand(seen, people.lifted.measured, view.floor, method)
        feet, result, people_2d = self._reported(memory.feet, seen, lost, people, view)
        after = replace(memory, feet=feet, tracks=seen.tracks.joined(lost).in_order(),
                        gone=without(memory.gone, seen.tracks), seen=seen_bodies(memory, seen, people, view, method))
        self.memory = after if has_depth else self.memory.with_existence(after.tracks)
        clock.lap('complete')
        ids, number = np.full(len(looks.given), -1), people.observed.people_2d.ids
        ids[number[number >= 0]] = seen.tracks.ids[number >= 0]
        return TrackedPeople(result, people_2d, unplaced, ids, all_observed, clock.laps)

    def _given_up(self, frame: Frame, camera: CameraModel) -> Tuple[Memory, FrameView]:
        """Return the memory at the begin of a frame, without tracks that ended, and the view of the frame.

        Stamps that jump back end all tracks, as does each frame without tracking.
        """
        params, memory, stamp = self._settings.identity, self.memory, frame.stamp
        before = memory.stamp
        if before is None or not params.tracking or stamp < before - TRACKING.reset_backstep:
            fresh = replace(memory, tracks=Tracks.none(), gone=Tracks.none(), feet=Feet(), stamp=stamp,
                            tracking_from_points=frame.tracking_from_points)
            return fresh, FrameView(frame.grid, camera, stamp, 0.0, frame.floor)
        tracks = memory.tracks
        # what was detected goes on, whatever it is: a picture is to be known in the next frame, too
        recent = (stamp - tracks.last_seen <= params.track_timeout) & (
            (tracks.existence >= EXISTENCE.ended) | (tracks.last_seen == before))
        recent[:-TRACKING.most_tracks] = False
        gone = memory.gone if recent.all() else memory.gone.joined(tracks.select(~recent))
        gone = gone.select(np.argsort(gone.last_seen, kind='stable')[-self._method.track.returning.most_gone:])
        gone = gone.select(stamp - gone.last_seen <= params.return_timeout)
        memory = replace(memory, tracks=tracks.select(recent), gone=gone, stamp=max(stamp, before))
        view = FrameView(frame.grid, camera, stamp, max(stamp - before, 0.0), frame.floor)
        return memory.in_frame_of(frame.tracking_from_points), view

    def _observed(self, people: People2D, frame: Frame, view: FrameView) -> Tuple[ObservedPeople, Clothes]:
        """Return what the points and the image show of people."""
        observed = observe(people, frame.image_size, view.points, view.camera, self._method)
        bgr = frame.bgr if self._settings.identity.use_clothes else None
        return observed, observe_clothes(observed, view.points, bgr, self._method)

    def _identified(self, memory: Memory, expected: Tracks, people: Tuple[ObservedPeople, Clothes], looks: LookedAt,
                    frame: Frame, view: FrameView) -> Tuple[Memory, np.ndarray, ObservedPeople, Clothes]:
        """Return rows of the tracks of the people of a frame, assigned, put together, or found by the points alone."""
        params, method, (observed, clothes) = self._settings.identity, self._method, people
        compared = compare(expected, observed, looks.given, method)
        row = assign(expected, clothes, compared, view.stamp, params, method.track.identity)
        whole, row = joined(expected, observed, compared, row, method)
        # where a look at a body in free view found no person, the surface there is another one's
        open_view = views_of(expected, view, method).visible >= EXISTENCE.free_view
        lost = np.setdiff1d(np.flatnonzero(~(looks.of(expected) & open_view)), row)
        found = registered((whole, frame.image_size), expected, lost, memory, view, method)
        if found.people is not observed.people_2d:
            observed, clothes = self._observed(found.people, frame, view)
            observed = replace(observed, error=found.error, unseen=found.unseen)
        return found.memory, np.append(row, found.row), observed, clothes

    def _lifted(self, observed: ObservedPeople, tracks: Tracks, row: np.ndarray, view: FrameView,
                worlds: Optional[np.ndarray]) -> Tuple[ObservedPeople, Lifted, np.ndarray]:
        """Return the people with their own left and right, in space, and `Tracks.trust`; worlds: see `LookedAt`."""
        expected = expect(tracks, row, self._method)
        lifted = self._lift(observed, view.points, expected)
        exchanged, trust = sides_of(observed, lifted, tracks, row, view, self._method)
        if worlds is not None:
            lifted = lift_bodies(lifted, observed, worlds, expected, view, self._method)
        elif exchanged.any():
            observed = observed.exchanged(exchanged)
            lifted = self._lift(observed, view.points, expected)
        return observed, lifted._replace(measured=lifted.measured & ~observed.unseen), trust

    def _born(self, memory: Memory, tracks: Tracks, people: Observations, stamp: float, given: np.ndarray
              ) -> Tuple[Memory, Tracks, Observations]:
        """Return the memory, the tracks with one for each person who is born or comes back, and the people with one.

        The former track of a person who comes back stays, see `without`.
        """
        method = self._method
        new, waiting = new_people(people, method), None
        if len(new):
            absent = tracks.select(people.others(len(tracks))).joined(memory.gone)
            rows = recognize(absent, NewPeople.of(people.select(new), method.sizes.least_score), stamp, method)
            plain = people.lifted.measured[new].sum(axis=1) >= method.track.identity.plain
            rows = np.where((rows == UNCLEAR) & plain, STRANGER, rows)
            unclear = rows == UNCLEAR
            waiting = (stamp if memory.waiting is None else memory.waiting) if unclear.any() else None
            if waiting is not None and stamp - waiting < method.track.identity.gap:
                new, rows = new[~unclear], rows[~unclear]
        if len(new):
            number = people.observed.people_2d.ids
            named = self._named(np.where(number >= 0, np.append(given, -1)[number], -1), new, absent, rows)
            row = people.row.copy()
            row[new] = np.arange(len(tracks), len(tracks) + len(new))
            xyz, lifted = np.where(people.observed.known[..., None], people.lifted.xyz, np.nan), people.lifted
            begun = Tracks.begun(named[new], stamp, xyz[new], lifted.left[new], lifted.stature[new], method.track)
            people, tracks = people._replace(row=row), tracks.joined(begun.like(absent, rows))
        has_track = people.row >= 0
        people = people if has_track.all() else people.select(np.flatnonzero(has_track))
        return replace(memory, waiting=waiting), tracks, people

    def _named(self, given: np.ndarray, new: np.ndarray, absent: Tracks, rows: np.ndarray) -> np.ndarray:
        """Return the ids of all people, (P,): without tracking, the given ones if all have one."""
        if not self._settings.identity.tracking and not (given < 0).any():
            return given
        ids = np.full(len(given), -1)
        ids[new] = [absent.ids[row] if row >= 0 else next(self._ids) for row in rows]
        return ids

    def _kept(self, seen: Completion, lost: Tracks, people: Observations, tracks: Tracks, looks: LookedAt,
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

    def _reported(self, feet: Feet, seen: Completion, lost: Tracks, people: Observations, view: FrameView
                  ) -> Tuple[Feet, People3D, People2D]:
        """Return the people who are likely there, in space and in the image, hidden ones in space alone, and feet."""
        settings, method, hidden = self._settings, self._method, Tracks.none()
        likely = np.flatnonzero((seen.tracks.existence >= EXISTENCE.reported) | (not settings.identity.tracking))
        shown, of_shown = seen.select(likely), people.select(likely)
        if settings.occlusion.occlusion:
            inside = views_of(lost, view, method).inside > 0.5
            hidden = apart(lost.select((lost.existence >= EXISTENCE.reported) & inside), seen, method.track.one_body)
        result = _report(of_shown, shown, hidden, view.stamp, settings, method.track.correction)
        statures = np.concatenate([shown.tracks.sizes.stature, hidden.sizes.stature])
        feet, toes = follow_feet(feet, result, statures, of_shown.observed, view, method)
        people_2d = replace(of_shown.observed.people_2d, ids=shown.tracks.ids, existence=shown.tracks.existence)
        return feet, in_skeleton(result, of_shown.observed, toes, view, method), people_2d

    def expected(self, frame: Frame, camera: CameraModel, skeleton: SkeletonModel) -> ExpectedPeople:
        """Return the tracks as people expected in or outside the image of a frame, with the joints of a skeleton.

        Tracks move with constant velocity since the newest frame. There are none after a gap that ends all tracks, and
        when the clock was reset.
        """
        memory, points, timeout = self.memory, frame.grid, self._settings.identity.track_timeout
        elapsed = 0.0 if memory.stamp is None else frame.image_time - memory.stamp
        if memory.stamp is None or not -TRACKING.reset_backstep <= elapsed <= timeout:
            return ExpectedPeople.none(skeleton)
        tracks = memory.tracks.predicted(elapsed, self._settings.smoothing, self._method.body)
        stamp, position = max(frame.image_time, memory.stamp), tracks.joints.position
        views = views_of(tracks, FrameView(points, camera, stamp, elapsed), self._method)
        uv = camera.project(position.reshape(-1, 3)).reshape(*position.shape[:2], 2)
        there = tracks.has & np.isfinite(uv).all(axis=2)
        xy = grid_positions(np.where(there[..., None], uv, np.nan), (points.width, points.height), frame.image_size)
        keypoints = np.concatenate([xy, there[..., None]], axis=2).astype(np.float32)
        known = np.flatnonzero(there.any(axis=1))
        return ExpectedPeople(
            skeleton, keypoints_in(keypoints[known], COCO_18, skeleton), tracks.ids[known],
            after_time(tracks, views, stamp, timeout)[known], views.visible[known],
            (tracks.root.sigmas()[:, 0] / np.sqrt(3) / (tracks.sizes.stature / 2))[known])


def _report(people: Observations, completion: Completion, hidden: Tracks, stamp: float, settings: EstimatorSettings,
            constants: CorrectionConstants = METHOD.track.correction) -> People3D:
    """Return the people of a frame with the joints of COCO_18, in the frame of the points, and then hidden tracks."""
    tracks, lifted, trusted = completion.tracks, people.lifted, completion.trusted
    read = lifted.measured & trusted
    position = tracks.joints.position
    if settings.smoothing.smoothing and settings.occlusion.occlusion:
        # where the filter does not follow the surface, its position is not a measured one
        read &= ((position - lifted.xyz) ** 2).sum(axis=2) < constants.measured_reach ** 2
    if not settings.smoothing.smoothing:
        position = np.where(trusted[..., None], lifted.xyz, position)
    recent = stamp - hidden.seen <= settings.occlusion.inference_timeout
    status = _with_hidden(np.where(completion.placed, np.where(read, MEASURED, INFERRED), MISSING),
                          np.where(hidden.has & recent, INFERRED, MISSING))
    known = status != MISSING
    scores, velocity = people.observed.scores, _with_hidden(tracks.joints.velocity, hidden.joints.velocity)
    return People3D(
        COCO_18, np.where(known[..., None], _with_hidden(position, hidden.joints.position), np.nan),
        _with_hidden(scores, np.zeros((len(hidden), scores.shape[1]))), status,
        np.where(known, _with_hidden(completion.sigma, hidden.joints.sigmas()), np.nan),
        _with_hidden(tracks.ids, hidden.ids),
        np.where(known[..., None] & settings.identity.tracking, velocity, np.nan),
        _with_hidden(tracks.existence, hidden.existence))


def _with_hidden(seen: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    return np.concatenate([seen, hidden]) if len(hidden) else seen
