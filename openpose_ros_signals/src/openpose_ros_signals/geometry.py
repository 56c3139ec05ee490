"""Lengths and angles of a body, from its joints; all in one frame with a known vertical."""
from typing import NamedTuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.constants import Ramp
from skeleton_extract_3d.body.body import HIPS, SHOULDERS
from skeleton_extract_3d.people import MEASURED, MISSING

INDEX = COCO_18.index
# Length of the trunk (middle of the shoulders to middle of the hips) of an adult, as a share of the stature:
# 0.51 m of 1.75 m, see `skeleton_extract_3d.body.constants`.
TRUNK_SHARE = 0.291
# Shoulder, elbow, wrist and hip, knee, ankle of the left and the right side, (2, 3).
ARMS = np.array([[INDEX[f'{side}_{joint}'] for joint in ('shoulder', 'elbow', 'wrist')] for side in ('left', 'right')])
LEGS = np.array([[INDEX[f'{side}_{joint}'] for joint in ('hip', 'knee', 'ankle')] for side in ('left', 'right')])
EYES = np.array([INDEX['left_eye'], INDEX['right_eye']])
SIDES = ('left', 'right')


class Body(NamedTuple):
    """A person at one time.

    Attributes:
        stamp: [s].
        joints: (18, 3) [m]; NaN where missing.
        measured: (18,) bool.
        up: (3,) unit vector.
        stature: [m].
    """

    stamp: float
    joints: np.ndarray
    measured: np.ndarray
    up: np.ndarray
    stature: float

    @property
    def shoulders(self) -> np.ndarray:
        """Middle of the shoulders, (3,) [m]."""
        return np.asarray(self.joints[SHOULDERS].mean(axis=0))

    @property
    def hips(self) -> np.ndarray:
        """Middle of the hips, (3,) [m]."""
        return np.asarray(self.joints[HIPS].mean(axis=0))

    @property
    def left(self) -> np.ndarray:
        """Level unit vector to the person's left, by shoulders and hips, (3,)."""
        across = (self.joints[SHOULDERS[0]] - self.joints[SHOULDERS[1]]
                  + self.joints[HIPS[0]] - self.joints[HIPS[1]])
        return _unit(across - (across @ self.up) * self.up)

    @property
    def forward(self) -> np.ndarray:
        """Level unit vector out of the chest, (3,)."""
        return np.cross(self.left, self.up)

    def height(self, joint: int, over: np.ndarray) -> float:
        """Return how far a joint is over a point (3,), in statures."""
        return float((self.joints[joint] - over) @ self.up) / self.stature


def body_of(stamp: float, xyz: np.ndarray, status: np.ndarray, up: np.ndarray, stature: float) -> Body:
    """Return a person of People3D as a body.

    Args:
        xyz: (18, 3) [m].
        status: (18,) uint8.
    """
    joints = np.where((status == MISSING)[:, np.newaxis], np.nan, xyz.astype(np.float64))
    return Body(stamp, joints, status == MEASURED, up, stature)


def stature_of(joints: np.ndarray) -> float:
    """Return the stature by the length of the trunk [m]; NaN where it is not known.

    Args:
        joints: (18, 3) [m].
    """
    return float(np.linalg.norm(joints[SHOULDERS].mean(axis=0) - joints[HIPS].mean(axis=0))) / TRUNK_SHARE


def angle(first: np.ndarray, second: np.ndarray) -> float:
    """Return the angle between two vectors (3,) [deg]; NaN where one is not known."""
    cosine = first @ second / (np.linalg.norm(first) * np.linalg.norm(second) + 1e-12)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def ramp(value: float, ends: Ramp) -> float:
    """Return how far a condition holds: 0 at the first end, 1 at the second, linear between; NaN of NaN."""
    return float(np.clip((value - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0))


def _unit(vector: np.ndarray) -> np.ndarray:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-9))
