"""A person as a whole: walking, facing, falling, where on the floor."""
import math
from collections import deque
from typing import Deque, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_signals.constants import FloorConstants, MotionConstants, SignalConstants
from openpose_ros_signals.geometry import EARS, EYES, LEGS, NOSE, TICK, Body, unit
from openpose_ros_signals.records import Facing, Fall, FloorPose, Walk
from skeleton_extract_3d.body.body import SHOULDERS, TRUNK
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.points.transform import quaternions

_ANKLES = LEGS[:, 2]


def floor_velocity(bodies: Sequence[Body], constants: MotionConstants) -> Optional[np.ndarray]:
    """Return the level velocity of a trunk (3,) [m/s], by bodies, the newest last; None: not seen for long enough."""
    newest = bodies[-1]
    before = [body for body in bodies if newest.stamp - body.stamp <= constants.time + TICK]
    for body in before:
        elapsed = newest.stamp - body.stamp
        moved = newest.joints[TRUNK] - body.joints[TRUNK]
        moved = moved[np.isfinite(moved[:, 0])]
        if elapsed >= constants.least_time - TICK and len(moved):
            velocity = np.median(moved, axis=0) / elapsed
            return np.asarray(velocity - (velocity @ newest.up) * newest.up)
    return None


def facing_of(body: Body, frame: np.ndarray, head: bool) -> Optional[Facing]:
    """Return which way trunk or head face, by the frame (3, 3) of neck or nose; None if their joints are hidden."""
    known = np.isfinite(body.joints[:, 0])
    pairs = [pair for pair in ((EARS, EYES) if head else (SHOULDERS,)) if known[pair].all()]
    if not pairs or (head and not known[NOSE]) or not np.isfinite(frame).all():
        return None
    left, right = pairs[0]
    apart = float(np.linalg.norm(body.joints[left] - body.joints[right]))
    if apart == 0:
        return None
    # sigma is that of the position; one of its three axes turns the pair
    error = np.sqrt(2 / 3) * float(np.nan_to_num(body.sigma[[left, right]]).mean())
    return Facing(frame[:, 0], error / apart, body.joints[NOSE] if head else None)


def place_of(body: Body, joints: np.ndarray) -> Optional[np.ndarray]:
    """Return the middle of the trunk (3,) [m], where it is hidden of uncertain joints (18, 3) [m]; None: no joint."""
    guesses = (guess[np.isfinite(guess[:, 0])] for guess in (body.place[np.newaxis], joints[TRUNK], joints))
    return next((np.asarray(guess.mean(axis=0)) for guess in guesses if len(guess)), None)


def height_over_floor(body: Body, place: np.ndarray, lying: bool, floor: Optional[np.ndarray],
                      constants: SignalConstants) -> float:
    """Return the height of the middle of the trunk over the floor [m].

    Where the plane is not known: the trunk of a person that lies is near the floor, otherwise the lower ankle stands on
    it; where the ankles are hidden, the height is that of a standing person.

    Args:
        place: (3,) [m] the middle of the trunk.
        floor: (4,) plane, see `Surroundings`; None: not known.
    """
    human, ankles = constants.body, body.joints[_ANKLES] @ body.up
    scale = body.stature / human.adult_stature
    if floor is not None:
        return float(place @ floor[:3] + floor[3]) / float(body.up @ floor[:3])
    if lying:
        return constants.floor.lying * body.stature
    if np.isfinite(ankles).any():
        return float(place @ body.up - np.nanmin(ankles)) + METHOD.track.standing.ankle_height * scale
    return (METHOD.track.standing.ankle_height + human.shin + human.thigh + human.trunk_length / 2) * scale


def floor_pose(place: np.ndarray, height: float, forward: np.ndarray, up: np.ndarray) -> FloorPose:
    """Return the pose on the floor below a place (3,) [m] at a height [m], x along `forward`, z along `up` (3,)."""
    axes = np.column_stack([forward, np.cross(up, forward), up])
    return FloorPose(np.asarray(place - height * up), np.asarray(quaternions(axes[np.newaxis])[0]))


def level_direction(body: Body, facing: Optional[Facing], walk: Optional[Walk], constants: FloorConstants
                    ) -> np.ndarray:
    """Return where a body is turned on the floor, a level unit vector (3,): where it faces, else where it walks.

    Where neither is known, it is x of the frame, or its z if x is upwards.
    """
    if facing is not None and abs(facing.direction @ body.up) < math.sin(math.radians(constants.most_rise)):
        return _level(facing.direction, body.up)
    if walk is not None and walk.moving:
        return walk.direction
    return _level(np.eye(3)[2 if abs(body.up[0]) > 0.9 else 0], body.up)


def _level(direction: np.ndarray, up: np.ndarray) -> np.ndarray:
    return unit(direction - (direction @ up) * up)


class FallWatch:
    """Whether a person fell."""

    def __init__(self, constants: MotionConstants) -> None:
        self._constants = constants
        self.fall: Optional[Fall] = None  # of a person that lies after a fall
        self._heights: Deque[Tuple[float, float]] = deque()  # stamps [s], and heights of the shoulders [statures]

    def watch(self, body: Body, posture: str, since: float) -> None:
        """Take a body and its posture, which holds since a time [s]."""
        height = float(body.shoulders @ body.up) / body.stature
        if np.isfinite(height):
            self._heights.append((body.stamp, height))
        while self._heights and self._heights[0][0] < body.stamp - self._constants.fall_time:
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
        if top - floor < self._constants.fall_height:
            return None
        begin = float(stamps[heights > top - self._constants.fall_begin * (top - floor)][-1])
        speed = _fastest(stamps, heights, self._constants.least_time)
        if speed < self._constants.fall_speed:
            return None
        return Fall(stamp, max(stamp - begin, 0.0), speed * stature)


def _fastest(stamps: np.ndarray, heights: np.ndarray, time: float) -> float:
    """Return the greatest speed downwards [statures/s], over a time [s]."""
    earlier = np.searchsorted(stamps, stamps - time + TICK) - 1
    rows = np.flatnonzero(earlier >= 0)
    earlier = earlier[rows]
    return float(((heights[earlier] - heights[rows]) / (stamps[rows] - stamps[earlier])).max()) if len(rows) else 0.0
