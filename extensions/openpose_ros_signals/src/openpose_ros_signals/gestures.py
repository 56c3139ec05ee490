"""Gestures of one arm or both; how far each one holds, by the joints of the last second."""
from typing import Dict, NamedTuple, Optional, Sequence

import numpy as np

from openpose_ros_signals.arms import Arm, held_way
from openpose_ros_signals.constants import GestureConstants, SignalConstants
from openpose_ros_signals.geometry import Body, angle, least, ramp, unless_hidden
from openpose_ros_signals.records import ARM_GESTURES
from openpose_ros_signals.swings import beckon_degree, wave_degree
from skeleton_extract_3d.landmarks import Hands3D
from skeleton_extract_3d.people import MISSING

# Points of a hand: wrist, first joints of index, middle and little finger.
_PALM = np.array([0, 5, 9, 17])


class Palm(NamedTuple):
    """How a hand is held: unit vectors (3,) out of the palm, and from the wrist along the fingers."""

    normal: np.ndarray
    fingers: np.ndarray


def palm_of(hands: Hands3D, person: int, left: bool) -> Optional[Palm]:
    """Return how the hand of a person is held, None if it was not found."""
    for row in np.flatnonzero((hands.people == person) & (hands.left == left)):
        points = hands.points.xyz[row, _PALM].astype(np.float64)
        if (hands.points.status[row, _PALM] != MISSING).all():
            normal = np.cross(points[1] - points[0], points[3] - points[0])
            return Palm(-normal if left else normal, points[2] - points[0])
    return None


def extended(arm: Arm, constants: GestureConstants) -> float:
    """Return how far an arm is straight and away from the body, 0 to 1; NaN if it is hidden."""
    return least(ramp(arm.elbow, constants.straight_arm), ramp(arm.raised, constants.arm_away))


def arm_degrees(arms: Sequence[Arm], other: Arm, palm: Optional[Palm], body: Body, signals: SignalConstants
                ) -> Dict[str, float]:
    """Return how far each of `ARM_GESTURES` holds for one arm, 0 to 1; NaN if the arm is hidden.

    Args:
        arms: in the last second, the newest last.
        other: the other arm: two arms that are stretched out do not point.
        palm: of this arm's hand; None: not known.
        body: at the time of the newest.
    """
    arm = arms[-1]
    if not arm.known:
        return dict.fromkeys(ARM_GESTURES, np.nan)
    constants = signals.gesture
    held = ramp(held_way(arms, constants.held_time), constants.held)
    wave = wave_degree(arms, signals.swing, constants)
    beckon = least(beckon_degree(arms, signals.swing, constants), 1 - wave)
    raised = least(ramp(arm.over_eyes, constants.over_eyes), ramp(arm.raised, constants.steep_arm),
                   ramp(arm.elbow, constants.open_elbow), ramp(arm.from_nose, constants.off_head), held, 1 - wave)
    stop = least(_says_stop(arms, palm, body, constants), 1 - wave, 1 - beckon, 1 - raised)
    over_hips = body.height(arm.place * body.stature, body.hips)
    point = least(extended(arm, constants), ramp(arm.raised, constants.arm_not_up), held, 1 - wave, 1 - beckon,
                  1 - stop, unless_hidden(1 - extended(other, constants)),
                  unless_hidden(ramp(over_hips, constants.over_hips)))
    return {'wave': wave, 'raise_hand': raised, 'beckon': beckon, 'stop': stop, 'point': point}


def _says_stop(arms: Sequence[Arm], palm: Optional[Palm], body: Body, constants: GestureConstants) -> float:
    """Return how far a hand says stop: by its palm, or without one by the arm."""
    arm = arms[-1]
    held = least(ramp(held_way(arms, constants.stop_time), constants.held), ramp(arm.wrist[1], constants.stop_ahead))
    if palm is None:
        return least(held, 1 - ramp(arm.elbow, constants.straight_arm), ramp(arm.forearm, constants.stop_forearm),
                     ramp(arm.wrist[2], constants.stop_height), ramp(arm.from_nose, constants.off_face))
    outwards = arm.reach - (arm.reach @ body.up) * body.up
    return least(held, ramp(angle(palm.normal, outwards), constants.palm),
                 ramp(angle(palm.fingers, body.up), constants.palm))


def crossed_degree(left: Arm, right: Arm, body: Body, constants: GestureConstants) -> float:
    """Return how far the arms are crossed before the chest, 0 to 1; NaN if an arm is hidden."""
    if not (left.known and right.known):
        return np.nan
    apart = float((left.place - right.place) @ body.left)
    degrees = [ramp(apart, constants.crossed), ramp(-left.fore[0], constants.inward),
               ramp(-right.fore[0], constants.inward)]
    for arm in (left, right):
        degrees += [ramp(abs(arm.fore[2]), constants.level_forearm), ramp(-arm.wrist[2], constants.chest_height),
                    ramp(arm.wrist[1], constants.before_chest)]
    return least(*degrees)
