"""Tracks of fused people: each joint moves at a constant velocity, disturbed by an acceleration."""
from dataclasses import dataclass, replace
from typing import Iterator, Union

import numpy as np

from openpose_ros_fusion.constants import MotionConstants
from openpose_ros_fusion.estimate import Measurements
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import BODY
from skeleton_extract_3d.body.measures import Sizes
from skeleton_extract_3d.track.joint_filter import drifted
from skeleton_extract_3d.track.tracks import Rows

_JOINTS = len(COCO_18.joints)
# Covariance of a joint whose motion is not known, see `Tracks`.
_UNKNOWN = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class Tracks(Rows):
    """The tracks of F people at one time.

    The covariance of a joint is the same along all axes: where rays alone tell it, that of the worst one.

    Attributes:
        stamp: [s].
        sizes: lengths of their bones.
        ids: (F,) int64.
        positions: (F, 18, 3) [m]; NaN where unknown.
        velocities: (F, 18, 3) [m/s].
        covariance: (F, 18, 3): variance of the position [m^2], covariance of position and velocity [m^2/s], variance
            of the velocity [m^2/s^2], of an axis.
        variance: (F, 18) of the position when it was corrected last, mean over the axes [m^2].
        innovations: (F,) mean square, as a share of what independent errors make.
        born, seen: (F,) stamps of the first and the last detection of each [s].
        cameras: (F,) int, greatest number of cameras that saw each at a time.
    """

    stamp: float
    sizes: Sizes
    ids: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    covariance: np.ndarray
    variance: np.ndarray
    innovations: np.ndarray
    born: np.ndarray
    seen: np.ndarray
    cameras: np.ndarray

    @classmethod
    def empty(cls, stamp: float) -> 'Tracks':
        """Return no tracks."""
        return cls.begun(stamp, iter(()), np.zeros((0, _JOINTS, 3)))

    @classmethod
    def begun(cls, stamp: float, ids: Iterator[int], positions: np.ndarray) -> 'Tracks':
        """Return new tracks of adults at positions (N, 18, 3) [m], with the next ids; their joints are unsure."""
        number, times = len(positions), np.full(len(positions), stamp)
        unknown = np.broadcast_to(_UNKNOWN, positions.shape)
        return cls(stamp, Sizes.assumed(np.full(number, BODY.adult_stature)),
                   np.array([next(ids) for _ in positions], np.int64), positions, np.zeros(positions.shape), unknown,
                   np.ones(positions.shape[:2]), np.zeros(number), times, times, np.zeros(number, np.int64))

    def placed(self, row: int, joints: np.ndarray, velocity: Union[float, np.ndarray] = 0.0,
               covariance: np.ndarray = _UNKNOWN) -> 'Tracks':
        """Return these tracks, with one of them at other joints (18, 3) [m], and its motion unknown or as given."""
        chosen = (np.arange(len(self)) == row)[:, np.newaxis, np.newaxis]
        return replace(self, positions=np.where(chosen, joints, self.positions),
                       velocities=np.where(chosen, velocity, self.velocities),
                       covariance=np.where(chosen, covariance, self.covariance))

    @property
    def assumed_positions(self) -> np.ndarray:
        """Return the positions of the joints, (F, 18, 3) [m]; unknown ones are in the middle of the others."""
        known = np.isfinite(self.positions)
        middle = (np.where(known, self.positions, 0.0).sum(axis=1, keepdims=True)
                  / np.maximum(known.sum(axis=1, keepdims=True), 1))
        return np.where(known, self.positions, middle)

    @property
    def known(self) -> np.ndarray:
        """Joints of which something is expected, (F, 18) bool: not those of tracks that begin now."""
        return (self.born < self.stamp)[:, np.newaxis] & np.isfinite(self.positions).all(axis=2)

    @property
    def expected(self) -> Measurements:
        """The expected joints as measurements, one of each person."""
        information = np.where(self.known, 1 / self.covariance[..., 0], 0.0)[..., np.newaxis, np.newaxis] * np.eye(3)
        return Measurements(np.arange(len(self)), self.assumed_positions, information)

    def at(self, stamp: float, constants: MotionConstants) -> np.ndarray:
        """Return where the joints are expected, (F, 18, 3) [m]."""
        return self.positions + self.moves(stamp - self.stamp, constants)

    def moves(self, step: float, constants: MotionConstants) -> np.ndarray:
        """Return by how much the joints move in a time [s], which may be negative, (F, 18, 3) [m].

        Bodies go on; what a joint moves beside its body, as a swinging arm, fades. Covariances are those of joints
        that go on by themselves.
        """
        if step == 0:
            return np.zeros_like(self.velocities)
        fading = constants.swing
        body = self.velocities.mean(axis=1, keepdims=True)
        return step * body + np.sign(step) * fading * (1 - np.exp(-abs(step) / fading)) * (self.velocities - body)

    def spread_after(self, step: float, constants: MotionConstants) -> np.ndarray:
        """Return the variance per axis of how far joints move otherwise than expected in a time [s], (F, 18) [m^2]."""
        noise = constants.acceleration ** 2 * step ** 4 / 4
        return step ** 2 * self.covariance[..., 2] + (noise if step > 0 else 0.0)

    def predicted(self, stamp: float, constants: MotionConstants) -> 'Tracks':
        """Return the tracks as they are expected at a later time [s]."""
        step = max(stamp - self.stamp, 0.0)
        place, mixed, speed = np.moveaxis(self.covariance, 2, 0)
        covariance = np.stack(drifted((place, mixed, speed), mixed, step, constants.acceleration ** 2), axis=2)
        body = self.velocities.mean(axis=1, keepdims=True)
        velocities = body + np.exp(-step / constants.swing) * (self.velocities - body)
        return replace(self, stamp=self.stamp + step, positions=self.positions + self.moves(step, constants),
                       velocities=velocities, covariance=covariance)

    def corrected(self, positions: np.ndarray, variance: np.ndarray, independent: np.ndarray,
                  constants: MotionConstants) -> 'Tracks':
        """Return the tracks after a frame.

        Args:
            positions: (F, 18, 3) [m], estimates that the prediction is a part of; NaN where there are none.
            variance: (F, 18) [m^2], their variance per axis.
            independent: (F, 18) [m^2], the same if errors of frames were independent.
        """
        place, mixed, speed = np.moveaxis(self.covariance, 2, 0)
        known = np.isfinite(self.positions).all(axis=2)
        new = np.isfinite(positions).all(axis=2)
        both = (known & new)[..., np.newaxis]
        gain = mixed / np.maximum(place, 1e-12)
        moved = np.where(both, positions - self.positions, 0.0)
        velocities = self.velocities + gain[..., np.newaxis] * moved
        rest = independent / np.maximum(place, 1e-12)
        after = np.stack([variance, mixed * rest, speed - gain * mixed * (1 - rest)], axis=2)
        # of a new joint: the speed that it may have reached since it was last reported
        first = np.stack([variance, np.zeros_like(variance),
                          np.full_like(variance, (constants.acceleration * constants.reported_gap) ** 2)], axis=2)
        covariance = np.where(both, after, np.where(new[..., np.newaxis], first, self.covariance))
        return replace(self, positions=np.where(new[..., np.newaxis], positions, self.positions),
                       velocities=np.where((new & ~known)[..., np.newaxis], 0.0, velocities), covariance=covariance)
