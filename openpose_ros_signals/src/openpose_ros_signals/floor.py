"""Where on the floor a person is, and how turned: what a robot drives round."""
import math
from typing import Optional

import numpy as np

from openpose_ros_signals.constants import SIGNALS
from openpose_ros_signals.geometry import LEGS, Body, unit
from openpose_ros_signals.records import Facing, FloorPose, Walk
from skeleton_extract_3d.body.body import BODY, TRUNK
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.points.transform import quaternions

_FLOOR = SIGNALS.floor
_ANKLES = LEGS[:, 2]
# Heights over the floor of an adult's ankle, and of the middle of the trunk of an adult who stands [m].
_ANKLE = METHOD.track.standing.ankle_height
_STANDING = _ANKLE + BODY.shin + BODY.thigh + BODY.trunk_length / 2


def floor_pose(body: Body, joints: np.ndarray, posture: str, forward: np.ndarray, floor: Optional[np.ndarray],
               ) -> Optional[FloorPose]:
    """Return the pose on the floor below the middle of the trunk; None if no joint is known.

    Where the trunk is hidden, its inferred joints tell where it is, then all others: who is half hidden is there too.
    The floor is the plane. Where that is not known, the trunk of who lies is near it; the lower ankle of others stands
    on it; where the ankles are hidden, the trunk is as high over it as that of who stands.

    Args:
        joints: (18, 3) [m] of this body, with those that are too uncertain for `body`.
        forward: (3,) level unit vector.
        floor: see `Surroundings`.
    """
    guesses = (guess[np.isfinite(guess[:, 0])] for guess in (body.place[np.newaxis], joints[TRUNK], joints))
    place = next((guess.mean(axis=0) for guess in guesses if len(guess)), None)
    if place is None:
        return None
    ankles, scale = body.joints[_ANKLES] @ body.up, body.stature / BODY.adult_stature
    if floor is not None:
        height = float(place @ floor[:3] + floor[3]) / float(body.up @ floor[:3])
    elif posture == 'lying':
        height = _FLOOR.lying * body.stature
    elif np.isfinite(ankles).any():
        height = float(place @ body.up - np.nanmin(ankles)) + _ANKLE * scale
    else:
        height = _STANDING * scale
    axes = np.column_stack([forward, np.cross(body.up, forward), body.up])
    return FloorPose(np.asarray(place - height * body.up), np.asarray(quaternions(axes[np.newaxis])[0]))


def level_direction(body: Body, facing: Optional[Facing], walk: Optional[Walk]) -> np.ndarray:
    """Return where a body is turned on the floor, a level unit vector (3,).

    It is where the body faces; where that is hidden, or up or down as of who lies, where the person walks; else x of
    the frame, or its z if x is upwards.
    """
    if facing is not None and abs(facing.direction @ body.up) < math.sin(math.radians(_FLOOR.most_rise)):
        return _level(facing.direction, body.up)
    if walk is not None and walk.moving:
        return walk.direction
    return _level(np.eye(3)[2 if abs(body.up[0]) > 0.9 else 0], body.up)


def _level(direction: np.ndarray, up: np.ndarray) -> np.ndarray:
    return unit(direction - (direction @ up) * up)
