"""How a person moves as a whole: walking, facing, falling."""
from collections import deque
from typing import Deque, NamedTuple, Optional, Sequence

import numpy as np

from openpose_ros_signals.constants import SIGNALS
from openpose_ros_signals.geometry import EARS, EYES, NOSE, TICK, Body
from openpose_ros_signals.records import Facing, Fall
from skeleton_extract_3d.body.body import SHOULDERS, TRUNK

_MOTION = SIGNALS.motion


def floor_velocity(bodies: Sequence[Body]) -> Optional[np.ndarray]:
    """Return the level velocity of the trunk (3,) [m/s]; None if it was not seen for long enough.

    Args:
        bodies: of one person, the newest last.
    """
    newest = bodies[-1]
    before = [body for body in bodies if newest.stamp - body.stamp <= _MOTION.time + TICK]
    for body in before:
        elapsed = newest.stamp - body.stamp
        moved = newest.joints[TRUNK] - body.joints[TRUNK]
        moved = moved[np.isfinite(moved[:, 0])]
        if elapsed >= _MOTION.least_time - TICK and len(moved):
            velocity = np.median(moved, axis=0) / elapsed
            return np.asarray(velocity - (velocity @ newest.up) * newest.up)
    return None


def rising_speed(bodies: Sequence[Body]) -> float:
    """Return the speed of the trunk up or down [statures/s]; 0 if it is not known.

    Args:
        bodies: of one person, the newest last.
    """
    newest = bodies[-1]
    for body in bodies:
        elapsed = newest.stamp - body.stamp
        if TICK < elapsed <= _MOTION.least_time + TICK:
            return float(np.nan_to_num(abs(newest.height(newest.place, body.place)))) / elapsed
    return 0.0


def facing_of(body: Body, frame: np.ndarray, head: bool) -> Optional[Facing]:
    """Return which way trunk or head face; None if their joints are hidden.

    Args:
        frame: (3, 3), of the neck or the nose, see `joint_frames`.
    """
    known = np.isfinite(body.joints[:, 0])
    pairs = [pair for pair in ((EARS, EYES) if head else (SHOULDERS,)) if known[pair].all()]
    if not pairs or (head and not known[NOSE]) or not np.isfinite(frame).all():
        return None
    left, right = pairs[0]
    # sigma is that of the position; one of its three axes turns the pair
    error = np.sqrt(2 / 3) * float(np.nan_to_num(body.sigma[[left, right]]).mean())
    return Facing(frame[:, 0], error / float(np.linalg.norm(body.joints[left] - body.joints[right])))


class _Height(NamedTuple):
    """Height of the shoulders [statures] at a time [s]."""

    stamp: float
    height: float


class FallWatch:
    """Whether a person fell.

    Attributes:
        fall: of who lies after a fall; None: no fall.
    """

    def __init__(self) -> None:
        self.fall: Optional[Fall] = None
        self._heights: Deque[_Height] = deque()

    def update(self, body: Body, posture: str, since: float) -> None:
        """Take a body and its posture, which holds since a time [s]."""
        height = float(body.shoulders @ body.up) / body.stature
        if np.isfinite(height):
            self._heights.append(_Height(body.stamp, height))
        while self._heights and self._heights[0].stamp < body.stamp - _MOTION.fall_time:
            self._heights.popleft()
        if posture == 'lying' and self.fall is None and self._heights:
            self.fall = self._fall(since, body.stature)
        elif posture not in ('lying', 'unknown') and self.fall is not None:
            self.fall = None
            self._heights.clear()

    def _fall(self, stamp: float, stature: float) -> Optional[Fall]:
        """Return the fall that ended at a time; None if the person came down slowly, or was never up."""
        stamps, heights = np.array(self._heights).T
        top, floor = heights.max(), heights[-1]
        if top - floor < _MOTION.fall_height:
            return None
        begin = float(stamps[heights > top - _MOTION.fall_begin * (top - floor)][-1])
        speed = _fastest(stamps, heights)
        if speed < _MOTION.fall_speed:
            return None
        return Fall(stamp, max(stamp - begin, 0.0), speed * stature)


def _fastest(stamps: np.ndarray, heights: np.ndarray) -> float:
    """Return the greatest speed downwards, over the least time of a speed."""
    earlier = np.searchsorted(stamps, stamps - _MOTION.least_time + TICK) - 1
    rows = np.flatnonzero(earlier >= 0)
    if not len(rows):
        return 0.0
    earlier = earlier[rows]
    return float(((heights[earlier] - heights[rows]) / (stamps[rows] - stamps[earlier])).max())
