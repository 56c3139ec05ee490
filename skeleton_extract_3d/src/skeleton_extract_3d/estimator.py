"""From the people in an image and the points of the same view to people in space: who is who, where each joint is, and
whether it was seen."""
import itertools
import time
from dataclasses import dataclass, field, replace
from typing import Dict, Iterator, Optional, Tuple

import numpy as np

from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18, SkeletonModel
from skeleton_extract_3d.body import measures as body_measures
from skeleton_extract_3d.body.body import HIPS, SHOULDERS, STATURE_SPREAD
from skeleton_extract_3d.body.extra_joints import in_skeleton
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.lifting import LiftingParams, make_lifting
from skeleton_extract_3d.lift.observation import ObservedPeople, grid_positions, observe
from skeleton_extract_3d.lift.records import Expectation, Lifted
from skeleton_extract_3d.lift.window_mean import lift_by_window
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel, check_same_aspect
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.track import appearance, completion, identity
from skeleton_extract_3d.track.bone_constraints import satisfy_lengths
from skeleton_extract_3d.track.completion import OcclusionParams
from skeleton_extract_3d.track.identity import Clothes, IdentityParams
from skeleton_extract_3d.track.joint_filter import along_rays, isotropic
from skeleton_extract_3d.track.tracks import Tracks, frame_change, middle_of_trunk

# Stamps that go back by more [s] are a new beginning (bag loop), by less a late frame.
_RESET_BACKSTEP = 0.5
# Errors of keypoints across the view [m]: at full score, growing with its square below, more where hidden.
_ACROSS, _ACROSS_BY_SCORE, _ACROSS_HIDDEN = 0.013, 0.11, 0.02
# Errors along the ray [m]: of a measured surface and offset, and the least of an inferred depth.
_ALONG_MEASURED, _ALONG_INFERRED = 0.024, 0.05
# What no filter takes away: bodies differ from the model [m].
_BODY_SIGMA = 0.01
# How far the depth of a joint may change against what was expected [m].
_EXPECTED_SIGMA, _EXPECTED_FACTOR = 0.06, 1.5
# The direction that people face is averaged over about this time [s]; frames are taken to be this far apart at least
# [s], and what was before counts at most so many times as much as the present frame.
_TURNING_TIME, _LEAST_ELAPSED, _MOST_TURNING_WEIGHT = 0.1, 0.01, 4.0
# The trunk's place by at least three measured joints, and by fewer [m].
_ROOT_MEASURED, _ROOT_GUESSED = 0.03, 0.15
# A keypoint that no bone contradicts is used from `hidden_min_score`; one that bones contradict from this score.
_SURE_SCORE = 0.75
# Of a stranger nobody knows the depth of joints.
_UNKNOWN_SPEED = 1.0
# A smoothed joint counts as measured up to this distance from where it was read [m].
_MEASURED_REACH = 0.12
# Samples within this distance of the trunk show the person's clothes [m].
_CLOTHES_DEPTH = 0.35
# Share of a new direction of the trunk downwards.
_DOWN_SHARE = 0.2
# The corners of the trunk.
_SQUARE = np.concatenate([SHOULDERS, HIPS])


@dataclass(frozen=True)
class SmoothingParams(Parameters):
    """How joints are smoothed over time."""

    smoothing: bool = parameter(
        True, 'Filter each joint (Kalman filter with constant velocity). false: positions are those of the single '
              'frames; velocities are estimated all the same.')
    acceleration: float = parameter(
        4.0, "How quickly the trunk's joints change their velocity (standard deviation per axis); elbows and knees do "
             'by 1.5, ankles by 2 and wrists by 2.5 times as much. More follows quick motions more closely and smooths '
             'less.', unit='m/s^2', minimum=0.1, maximum=100.0)
    walking_acceleration: float = parameter(
        3.0, 'The same for people as a whole, who are expected to walk on when they are out of sight.', unit='m/s^2',
        minimum=0.1, maximum=100.0)


@dataclass(frozen=True)
class EstimatorSettings:
    """All parameters of the estimator."""

    lifting: LiftingParams
    occlusion: OcclusionParams
    identity: IdentityParams
    smoothing: SmoothingParams


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
        skeleton: joints of the people.
        settings: how people are lifted, followed and smoothed.
        ids: where new people's ids come from: estimators that share it never give the same one. None: 0, 1, 2, ...
    """

    def __init__(self, skeleton: SkeletonModel, settings: EstimatorSettings,
                 ids: Optional[Iterator[int]] = None) -> None:
        self._skeleton = skeleton
        self._tracks = Tracks()
        self._ids = itertools.count() if ids is None else ids
        self._stamp: Optional[float] = None
        self._camera: Optional[CameraModel] = None
        self._tracking_from_points: Optional[Tuple[np.ndarray, np.ndarray]] = None
        self._settings = settings
        self._method = make_lifting(settings.lifting, settings.occlusion.occlusion)

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Take other parameters from the next frame on; people keep their ids, unless tracking begins or ends."""
        if settings.identity.tracking != self._settings.identity.tracking:
            # ids of the detection service are not those that are given out here
            self._forget()
        self._settings = settings
        self._method = make_lifting(settings.lifting, settings.occlusion.occlusion)

    def update(self, people_2d: People2D, image_size: Tuple[int, int], points: PointGrid, stamp: float,
               bgr: Optional[np.ndarray] = None,
               tracking_from_points: Optional[Tuple[np.ndarray, np.ndarray]] = None) -> Estimate:
        """Return the people of a frame.

        Args:
            people_2d: keypoints [px of the image].
            image_size: width and height of the image [px].
            points: cloud or depth image of the same view.
            stamp: of the frame [s].
            bgr: (H, W, 3) uint8, the image, for the colours of the clothes; None: people are told apart without.
            tracking_from_points: rotation (3, 3) and translation (3,) [m] from the frame of the points to one in
                which the room stands still, in every frame; None: the camera does not move.

        Raises:
            BadInputError: image and points differ in aspect ratio, or the points are in no optical frame.
        """
        check_same_aspect('image', image_size, 'cloud', (points.width, points.height))
        people_2d = _select(people_2d, np.flatnonzero(people_2d.present.any(axis=1)))
        lifting = self._settings.lifting
        if lifting.lifting == 'mean3x3' and not self._settings.identity.tracking:
            people = lift_by_window(people_2d, image_size, points, lifting.window, lifting.statistic)
            return Estimate(people, people_2d)
        clock = _Clock()
        camera = points.camera_model()
        self._camera = camera if camera is not None else self._camera
        if self._camera is None:
            return self._nobody(people_2d)
        elapsed = self._advance(stamp, tracking_from_points)
        seen = observe(people_2d, image_size, points, self._camera)
        clock.lap('observe')
        clothes = self._clothes(people_2d, points, image_size, bgr, seen)
        rows = identity.assign(self._tracks, seen, clothes, stamp, self._settings.identity)
        clock.lap('identity')
        lifted = self._method.lift(seen, points, self._expectation(rows, elapsed))
        clock.lap('lift')
        rows = self._begin_tracks(rows, seen, lifted, people_2d, stamp)
        kept = np.flatnonzero(rows >= 0)
        rows, seen, lifted = rows[kept], seen.select(kept), lifted.select(kept)
        people_2d = seen.people_2d
        trusted = self._correct(rows, seen, lifted, clothes, kept, stamp)
        clock.lap('filter')
        people, ids = self._people(rows, seen, lifted, trusted, points, stamp, elapsed, people_2d, image_size)
        people_2d = replace(people_2d, ids=ids[:len(rows)])
        clock.lap('complete')
        return Estimate(people, people_2d, clock.laps)

    def _advance(self, stamp: float, tracking_from_points: Optional[Tuple[np.ndarray, np.ndarray]]) -> float:
        """Bring the tracks to a time and to where the camera is now; return the time that passed [s]."""
        tracks, before = self._tracks, self._stamp
        if not self._settings.identity.tracking or (before is not None and stamp < before - _RESET_BACKSTEP):
            self._forget()
            before = None
        elapsed = 0.0 if before is None else max(stamp - before, 0.0)
        self._stamp = stamp if before is None else max(stamp, before)
        tracks.keep(stamp - tracks.last_seen <= self._settings.identity.track_timeout)
        if len(tracks) and tracking_from_points is not None and self._tracking_from_points is not None:
            tracks.transform(*frame_change(self._tracking_from_points, tracking_from_points))
        self._tracking_from_points = tracking_from_points
        tracks.predict(elapsed, self._settings.smoothing.acceleration, self._settings.smoothing.walking_acceleration)
        return elapsed

    def _forget(self) -> None:
        self._tracks.keep(np.zeros(len(self._tracks), bool))

    def _clothes(self, people: People2D, points: PointGrid, image_size: Tuple[int, int], bgr: Optional[np.ndarray],
                 seen: ObservedPeople) -> Clothes:
        """Return the colours of the clothes, where the surface is near the person's."""
        clothes = Clothes(len(people))
        if bgr is None or not self._settings.identity.use_clothes or not len(people):
            return clothes
        trunk = surfaces.lower_median(seen.samples[:, _SQUARE].reshape(len(people), -1))
        upper, lower = appearance.clothes_pixels(seen.uv)
        pixels, count = np.concatenate([upper, lower], axis=1), upper.shape[1]
        with np.errstate(invalid='ignore'):
            usable = np.abs(surfaces.depths_at(points, np.where(np.isfinite(pixels), pixels, -1e6))
                            - trunk[:, None]) < _CLOTHES_DEPTH
        pixels = grid_positions(pixels, (points.width, points.height), image_size)
        for part, chosen in enumerate((slice(None, count), slice(count, None))):
            colours, seen_pixels = appearance.mean_colours(bgr, pixels[:, chosen], usable[:, chosen])
            clothes.colours[:, part], clothes.known[:, part] = colours, seen_pixels > 0
        return clothes

    def _expectation(self, rows: np.ndarray, elapsed: float) -> Expectation:
        """Return what the tracks say of the people of a frame."""
        tracks, old = self._tracks, rows >= 0
        expected = Expectation.of_strangers(len(rows))
        track = rows[old]
        if not len(track):
            return expected
        expected.root[old] = tracks.root.position[track, 0, 2]
        expected.depth[old] = np.where(tracks.has[track], tracks.joints.position[track][..., 2], np.nan)
        variance = tracks.joints.position_covariance[track][..., 2, 2]
        expected.depth_sigma[old] = _EXPECTED_FACTOR * np.sqrt(variance + _EXPECTED_SIGMA ** 2)
        weight = min(_TURNING_TIME / max(elapsed, _LEAST_ELAPSED), _MOST_TURNING_WEIGHT)
        expected.left[old] = tracks.left[track] * weight
        expected.stature[old] = tracks.stature[track]
        expected.stature_spread[old] = identity.stature_spread(tracks)[track]
        expected.lengths[old] = body_measures.expected_lengths(tracks, track)
        expected.length_spread[old] = body_measures.length_spreads(tracks, track)
        return expected

    def _begin_tracks(self, rows: np.ndarray, seen: ObservedPeople, lifted: Lifted, people: People2D, stamp: float
                      ) -> np.ndarray:
        """Give newcomers a track each; return the rows of all, -1 for those who are nobody."""
        new = rows < 0
        # what can not be measured does not speak against a newcomer
        measurable = (seen.known & np.isfinite(seen.samples).any(axis=2)).sum(axis=1)
        new &= lifted.measured.sum(axis=1) >= np.minimum(self._settings.identity.birth_joints, measurable)
        new &= ~identity.repeated(lifted.xyz, seen.known, rows >= 0)
        begun = np.flatnonzero(new)
        if len(begun):
            if not self._settings.identity.tracking and (people.ids >= 0).all():
                ids = people.ids[begun]
            else:
                ids = np.array([next(self._ids) for _ in begun])
            rows = rows.copy()
            rows[begun] = np.arange(len(self._tracks), len(self._tracks) + len(begun))
            self._tracks.append(ids, stamp, lifted.xyz[begun], seen.known[begun], lifted.left[begun],
                                lifted.stature[begun])
        return rows

    def _correct(self, rows: np.ndarray, seen: ObservedPeople, lifted: Lifted, clothes: Clothes, people: np.ndarray,
                 stamp: float) -> np.ndarray:
        """Take the frame into the tracks; return which joints it placed, (N, 18)."""
        tracks, occlusion = self._tracks, self._settings.occlusion
        believable = (seen.scores >= occlusion.hidden_min_score) & (lifted.plausible | (seen.scores > _SURE_SCORE))
        trusted = lifted.measured | believable if occlusion.occlusion else lifted.measured
        trusted &= seen.known & (seen.scores >= occlusion.measured_min_score)
        across = (_ACROSS + _ACROSS_BY_SCORE * (1 - np.minimum(seen.scores, 1.0)) ** 2
                  + np.where(lifted.measured, 0.0, _ACROSS_HIDDEN))
        along = np.where(lifted.measured, _ALONG_MEASURED, np.maximum(lifted.sigma, _ALONG_INFERRED))
        along = np.maximum(along, _size_error(lifted))
        covariance = along_rays(seen.rays, across, along)
        xyz = lifted.xyz
        if occlusion.occlusion:
            xyz = satisfy_lengths(xyz, covariance, body_measures.expected_lengths(tracks, rows),
                                  body_measures.length_spreads(tracks, rows), trusted)
        first = trusted & ~tracks.has[rows]
        tracks.joints.correct(rows, xyz, covariance, trusted & ~first)
        if first.any():
            person, joint = np.nonzero(first)
            tracks.joints.place(rows[person], joint, xyz[first], np.zeros((len(person), 3)), covariance[first],
                                _UNKNOWN_SPEED)
        tracks.has[rows] |= trusted
        tracks.seen[rows] = np.where(trusted, stamp, tracks.seen[rows])
        tracks.left[rows] = lifted.left
        self._correct_down(rows, trusted)
        tracks.last_seen[rows] = stamp
        tracks.sightings[rows] += 1
        body_measures.learn(tracks, rows, lifted.xyz, lifted.measured, seen.scores)
        sure = lifted.measured[:, _SQUARE].sum(axis=1) >= 3
        error = np.where(sure, _ROOT_MEASURED, _ROOT_GUESSED)
        middle = middle_of_trunk(tracks.joints.position[rows], tracks.has[rows])
        tracks.root.correct(rows, middle[:, None], isotropic(error * np.sqrt(3))[:, None],
                            np.ones((len(rows), 1), bool))
        if len(clothes.known):
            known = clothes.known[people] & sure[:, None]
            weight = np.minimum(tracks.clothes_weight[rows] + known, appearance.MEMORY)
            share = np.where(known, 1 / np.maximum(weight, 1), 0.0)
            tracks.clothes[rows] += share[..., None] * (clothes.colours[people] - tracks.clothes[rows])
            tracks.clothes_weight[rows] = weight
        return trusted

    def _correct_down(self, rows: np.ndarray, trusted: np.ndarray) -> None:
        tracks = self._tracks
        position = tracks.joints.position[rows]
        along = (position[:, HIPS] - position[:, SHOULDERS]).sum(axis=1)
        length = np.linalg.norm(along, axis=1, keepdims=True)
        known = trusted[:, _SQUARE].all(axis=1) & (length[:, 0] > 0.1)
        mixed = tracks.down[rows] + _DOWN_SHARE * (along / np.maximum(length, 1e-6) - tracks.down[rows])
        mixed /= np.maximum(np.linalg.norm(mixed, axis=1, keepdims=True), 1e-6)
        tracks.down[rows] = np.where(known[:, None], mixed, tracks.down[rows])

    def _people(self, rows: np.ndarray, seen: ObservedPeople, lifted: Lifted, trusted: np.ndarray, points: PointGrid,
                stamp: float, elapsed: float, people_2d: People2D, image_size: Tuple[int, int]
                ) -> Tuple[People3D, np.ndarray]:
        """Return who is there and where, and the ids."""
        tracks, occlusion = self._tracks, self._settings.occlusion
        sigma = np.sqrt(tracks.joints.sigmas() ** 2 + _BODY_SIGMA ** 2)
        # it is the same in every frame, so no filter takes it away
        sigma[rows] = np.maximum(sigma[rows], _size_error(lifted))
        placed, hidden = trusted, np.zeros(0, np.int64)
        if occlusion.occlusion:
            placed = completion.complete_joints(tracks, rows, trusted, sigma, stamp, elapsed, occlusion)
            unseen = np.ones(len(tracks), bool)
            unseen[rows] = False
            unseen = np.flatnonzero(unseen)
            if len(unseen):
                completion.move_unseen(tracks, unseen, sigma, points, self._camera, stamp, elapsed)
                hidden = unseen[completion.hidden_and_there(tracks, unseen, points, self._camera)]
        position = tracks.joints.position[rows]
        read = lifted.measured & trusted
        if self._settings.smoothing.smoothing and occlusion.occlusion:
            # where the filter does not follow the surface, its answer is not read from there
            read &= ((position - lifted.xyz) ** 2).sum(axis=2) < _MEASURED_REACH ** 2
        status = np.where(placed, np.where(read, MEASURED, INFERRED), MISSING)
        recent = stamp - tracks.seen[hidden] <= occlusion.inference_timeout
        of_hidden = np.where(tracks.has[hidden] & recent, INFERRED, MISSING)
        status = np.concatenate([status, of_hidden]).astype(np.uint8)
        everybody = np.concatenate([rows, hidden])
        position = tracks.joints.position[everybody]
        if not self._settings.smoothing.smoothing:
            position[:len(rows)] = np.where(trusted[..., None], lifted.xyz, position[:len(rows)])
        known = status != MISSING
        scores = np.concatenate([seen.scores, np.zeros((len(hidden), seen.scores.shape[1]))])
        people = People3D(
            COCO_18, np.where(known[..., None], position, np.nan), scores, status,
            np.where(known, sigma[everybody], np.nan), tracks.ids[everybody],
            np.where(known[..., None] & self._settings.identity.tracking, tracks.joints.velocity[everybody], np.nan))
        uv = grid_positions(people_2d.xy, image_size, (points.width, points.height))
        return in_skeleton(people, people_2d, uv, points, self._camera), people.ids

    def _nobody(self, people_2d: People2D) -> Estimate:
        """Return nobody: there are no points to tell."""
        people = People3D(self._skeleton, *(np.zeros((0, len(self._skeleton.joints), *rest))
                                            for rest in ((3,), (), (), ())), np.zeros(0))
        return Estimate(people, _select(people_2d, np.zeros(0, np.int64)))


class _Clock:
    """Measures stages."""

    def __init__(self) -> None:
        self.laps: Dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """End a stage."""
        now = time.perf_counter()
        self.laps[stage] = now - self._last
        self._last = now


def _size_error(lifted: Lifted) -> np.ndarray:
    """Return the error of people without a single surface, whose depth their size alone tells, (P, 1) [m]; else 0."""
    return np.where(lifted.measured.any(axis=1), 0.0, STATURE_SPREAD * lifted.root)[:, None]


def _select(people: People2D, rows: np.ndarray) -> People2D:
    """Return some of the people, in the same order."""
    if len(rows) == len(people):
        return people
    return replace(people, keypoints=people.keypoints[rows], scores=people.scores[rows], ids=people.ids[rows])
