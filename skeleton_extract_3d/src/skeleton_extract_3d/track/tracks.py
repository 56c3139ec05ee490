"""Records of tracking: tracks, and the people of a frame as tracks take them in; one array per property."""
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, Tuple, TypeVar

import numpy as np

from openpose_ros_pkg.detect.existence import EXISTENCE
from skeleton_extract_3d.body import measures
from skeleton_extract_3d.body.body import BODY, JOINTS, TRUNK, BodyConstants
from skeleton_extract_3d.body.measures import Sizes
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.records import Expectation, Lifted, ObservedPeople
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.settings import SmoothingParams
from skeleton_extract_3d.track.appearance import Clothes
from skeleton_extract_3d.track.constants import TrackConstants
from skeleton_extract_3d.track.joint_filter import JointFilter

# Where a person may be across the view, from the predicted place [standard deviations], and how likely each place is.
PLACES = np.arange(-2.0, 3.0)
PLACE_WEIGHTS = np.exp(-PLACES ** 2 / 2) / np.exp(-PLACES ** 2 / 2).sum()
IN_TRUNK = np.isin(np.arange(len(JOINTS)), TRUNK)
Record = TypeVar('Record', bound='Rows')


@dataclass(frozen=True, eq=False)
class Rows:
    """Base of records of T tracks: fields are arrays with T rows, tuples of such arrays, or one value for all tracks.

    Subclasses have `ids`, (T,) int64.
    """

    def __len__(self) -> int:
        return len(self.ids)  # type: ignore[attr-defined]

    def select(self: Record, rows: np.ndarray) -> Record:
        """Return some of the tracks, by indices (N,) or a mask (T,), in the order of these."""
        indices = rows.nonzero()[0] if rows.dtype == bool else rows
        if len(indices) == len(self) and (indices == np.arange(len(self))).all():
            return self  # mostly all are
        return type(self)(**{name: _selected(value, indices) for name, value in vars(self).items()})

    def joined(self: Record, others: Record) -> Record:
        """Return these tracks and then others; values for all tracks are those of these."""
        if not len(others):
            return self
        return type(self)(**{name: _joined(value, getattr(others, name)) for name, value in vars(self).items()})


@dataclass(frozen=True, eq=False)
class Tracks(Rows):
    """T tracks; every change makes a new value.

    Attributes:
        joints: filters of the 18 joints of COCO_18.
        root: filter of the middle of the trunk, one point per track.
        ids: (T,) int64, never used again.
        born, last_seen: (T,) stamps [s] of the first and the last detection.
        existence: (T,) probability that the person is there, at `looked`.
        looked: (T,) stamps of the last look [s].
        has: (T, 18) bool, joints that were ever placed.
        seen: (T, 18) stamp of the last keypoint of each joint [s].
        errors: (T, 18) mean square error of each joint at its last correction, all axes together [m^2].
        innovations: (T,) mean square of the innovations, as a share of that of independent errors.
        left, down: (T, 3) unit vectors of the trunk.
        trust: (T,) time for which left and right were the same [s], see `track.sides`.
        sizes: stature and bones.
        clothes: mean colours.
        places: (T, 5) probabilities that the person is at each of `PLACES`.
    """

    joints: JointFilter
    root: JointFilter
    ids: np.ndarray
    born: np.ndarray
    last_seen: np.ndarray
    existence: np.ndarray
    looked: np.ndarray
    has: np.ndarray
    seen: np.ndarray
    errors: np.ndarray
    innovations: np.ndarray
    left: np.ndarray
    down: np.ndarray
    trust: np.ndarray
    sizes: Sizes
    clothes: Clothes
    places: np.ndarray

    @classmethod
    @lru_cache(maxsize=1)
    def none(cls) -> 'Tracks':
        """Return no track."""
        joints = np.zeros((0, len(JOINTS), 3))
        return cls.begun(np.zeros(0, np.int64), 0.0, joints, np.zeros((0, 3)), np.zeros(0))

    @classmethod
    def begun(cls, ids: np.ndarray, stamp: float, xyz: np.ndarray, left: np.ndarray, stature: np.ndarray,
              constants: TrackConstants = METHOD.track) -> 'Tracks':
        """Return N new tracks; none of their joints counts as placed yet.

        Args:
            xyz: (N, 18, 3) [m], NaN where a joint has no keypoint; at least one of each person has one.
            left: (N, 3) unit vectors.
        """
        count, known = len(ids), np.isfinite(xyz).all(axis=2)
        stamps, root = np.full(count, stamp), middle_of_trunk(xyz, known)
        return cls(
            JointFilter.at_rest(np.where(known[..., None], xyz, 0.0), constants.birth_sigma, constants.birth_speed),
            JointFilter.at_rest(root[:, None], constants.birth_sigma, constants.birth_speed),
            ids, born=stamps, last_seen=stamps, existence=np.full(count, EXISTENCE.unseen), looked=stamps,
            has=np.zeros(known.shape, bool), seen=np.full(known.shape, stamp),
            errors=np.full(known.shape, 3 * constants.birth_sigma ** 2), innovations=np.zeros(count), left=left,
            down=np.broadcast_to([0.0, 1.0, 0.0], (count, 3)), trust=np.zeros(count), sizes=Sizes.assumed(stature),
            clothes=Clothes.unknown(count), places=np.broadcast_to(PLACE_WEIGHTS, (count, len(PLACES))))

    def like(self, others: 'Tracks', rows: np.ndarray) -> 'Tracks':
        """Return the tracks with sizes and clothes of others, whose rows (T,) are not negative."""
        same = np.flatnonzero(rows >= 0)
        if not len(same):
            return self
        known, new = others.select(rows[same]), np.flatnonzero(rows < 0)
        back = replace(self.select(same), sizes=known.sizes, clothes=known.clothes)
        return self.select(new).joined(back).select(np.argsort(np.concatenate([new, same])))

    def in_order(self) -> 'Tracks':
        """Return the tracks by their ids."""
        return self if (self.ids[1:] > self.ids[:-1]).all() else self.select(np.argsort(self.ids))

    def predicted(self, elapsed: float, params: SmoothingParams, body: BodyConstants = BODY) -> 'Tracks':
        """Return the tracks after a time [s], with constant velocity."""
        if not len(self) or elapsed <= 0:
            return self
        return replace(self, joints=self.joints.predicted(elapsed, params.acceleration * body.accelerations),
                       root=self.root.predicted(elapsed, np.array([body.walking_acceleration])))

    def transformed(self, rotation: np.ndarray, translation: np.ndarray) -> 'Tracks':
        """Return the tracks in another frame: x' = R x + t."""
        return replace(self, joints=self.joints.transformed(rotation, translation),
                       root=self.root.transformed(rotation, translation), left=self.left @ rotation.T,
                       down=self.down @ rotation.T)


class Observations(NamedTuple):
    """P people of one frame, the row (P,) of each person's track, -1 where there is none, and `Tracks.trust`, (P,)."""

    row: np.ndarray
    observed: ObservedPeople
    clothes: Clothes
    lifted: Lifted
    trust: np.ndarray

    def select(self, people: np.ndarray) -> 'Observations':
        """Return some of the people, by indices, in the order of these."""
        return Observations(self.row[people], self.observed.select(people), self.clothes.select(people),
                            self.lifted.select(people), self.trust[people])

    def others(self, count: int) -> np.ndarray:
        """Return which of the first tracks are of none of these people, (count,) bool."""
        others = np.ones(max(count, self.row.max(initial=-1) + 1), bool)
        others[self.row[self.row >= 0]] = False
        return others[:count]

    @property
    def size_error(self) -> np.ndarray:
        """Error of the depth of people without a measured joint by the stature, (P, 1) [m]; 0 of others."""
        lifted = self.lifted
        return np.where(lifted.measured.any(axis=1), 0.0, lifted.distance_error)[:, None]


def _selected(value: Any, rows: np.ndarray) -> Any:
    if isinstance(value, np.ndarray):
        return value.take(rows, axis=0)
    return type(value)(*[part.take(rows, axis=0) for part in value]) if isinstance(value, tuple) else value


def _joined(first: Any, second: Any) -> Any:
    if isinstance(first, np.ndarray):
        return np.concatenate([first, second])
    return type(first)(*map(_joined, first, second)) if isinstance(first, tuple) else first


def middle_of_trunk(xyz: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the mean of the known joints of the trunk, or of all where there are none, (N, 3) [m]."""
    of_trunk = known & IN_TRUNK
    chosen = np.where(of_trunk.any(axis=1)[:, None], of_trunk, known)
    count = np.maximum(chosen.sum(axis=1), 1)[:, None]
    return np.where(chosen[..., None], xyz, 0.0).sum(axis=1) / count


def frame_change(before: Transform, now: Transform) -> Tuple[np.ndarray, np.ndarray]:
    """Return rotation and translation [m] from the frame of a moving camera to that now; both lead to a still frame."""
    rotation = now[0].T @ before[0]
    return rotation, now[0].T @ (before[1] - now[1])


def without(tracks: Tracks, present: Tracks) -> Tracks:
    """Return tracks without those that have an id of a present one."""
    return tracks.select((tracks.ids[:, None] != present.ids).all(axis=1)) if len(tracks) else tracks


def expect(tracks: Tracks, row: np.ndarray, method: MethodConstants = METHOD) -> Expectation:
    """Return what tracks in rows (P,), predicted to this frame, tell of people before they are lifted."""
    constants, old = method.track.expectation, row >= 0
    if not old.any():
        return Expectation.of_strangers(len(row), method.body)
    row = np.maximum(row, 0)
    sizes = tracks.sizes.select(row)
    variance = tracks.joints.position_covariance[row, :, 2, 2]
    known = Expectation(
        root=tracks.root.position[row, 0, 2],
        depth=np.where(tracks.has[row], tracks.joints.position[row, :, 2], np.nan),
        depth_sigma=constants.depth_factor * np.sqrt(variance + constants.depth_sigma ** 2),
        left=tracks.left[row] * constants.turning_frames, stature=sizes.stature,
        stature_spread=measures.stature_spread(sizes, method),
        lengths=measures.expected_lengths(sizes, method), length_spread=measures.length_spreads(sizes, method))
    if old.all():
        return known
    return Expectation(*(np.where(old if value.ndim == 1 else old[:, None], value, other)
                         for value, other in zip(known, Expectation.of_strangers(len(row), method.body))))
