"""Gestures of one arm or both; how far each one holds, by the joints of the last second."""
from typing import Dict, List, Sequence, Tuple

import numpy as np

from openpose_ros_signals.constants import GestureConstants
from openpose_ros_signals.geometry import ARMS, EYES, Body, angle, ramp

ARM_GESTURES = ('wave', 'raise_hand', 'beckon', 'stop', 'point')
# Time over which a speed is measured [s].
_SPEED_TIME = 0.2
# Time in which a hand goes to and fro [s].
_SWING_TIME = 0.6


def arms_crossed(body: Body, constants: GestureConstants) -> float:
    """Return how far the arms are crossed: both wrists before the chest, beyond its middle, elbows bent."""
    degrees = []
    for side, (shoulder, elbow, wrist) in zip((1, -1), ARMS):
        offset = (body.joints[wrist] - body.shoulders) / body.stature
        bend = angle(body.joints[shoulder] - body.joints[elbow], body.joints[wrist] - body.joints[elbow])
        degrees.append(min(ramp(-side * offset @ body.left, constants.crossed),
                           ramp(offset @ body.forward, constants.before_chest),
                           ramp(-offset @ body.up, constants.wrist_height), ramp(bend, constants.bent_elbow)))
    return min(degrees)


def arm_degrees(bodies: Sequence[Body], arm: int, constants: GestureConstants) -> Dict[str, float]:
    """Return how far each gesture of `ARM_GESTURES` holds for the left (0) or right (1) arm; NaN if unknown.

    Args:
        bodies: of the last second, the newest last.
    """
    body = bodies[-1]
    shoulder, elbow, wrist = (body.joints[joint] for joint in ARMS[arm])
    fore = angle(wrist - elbow, body.up)
    straight = angle(shoulder - elbow, wrist - elbow)
    raised = angle(wrist - shoulder, -body.up)
    speed, (across, ahead) = _motion(bodies, arm)
    held = ramp(speed, constants.still)
    over_head = ramp(body.height(ARMS[arm][2], body.joints[EYES].mean(axis=0)), constants.over_head)
    up = min(ramp(body.height(ARMS[arm][2], body.joints[ARMS[arm][0]]), constants.hand_up),
             ramp(fore, constants.forearm_up))
    waving, beckoning = ramp(across, constants.swing), ramp(ahead, constants.swing)
    extended = min(ramp(straight, constants.straight_arm), ramp(raised, constants.arm_away),
                   ramp(raised, constants.arm_not_up))
    return {'wave': min(up, waving, float(across >= ahead)),
            'raise_hand': min(over_head, 1 - waving),
            'beckon': min(1 - over_head, beckoning, float(ahead > across), ramp(raised, (20.0, 35.0)),
                          ramp(straight, (165.0, 150.0))),
            'stop': 0.0,
            'point': min(extended, held)}


def _motion(bodies: Sequence[Body], arm: int) -> Tuple[float, Tuple[float, float]]:
    """Return speed of a wrist [statures/s], and its way to and fro, across and not, relative to the shoulder."""
    body = bodies[-1]
    shoulder, _, wrist = ARMS[arm]
    way = np.array([(one.joints[wrist] - one.joints[shoulder]) / body.stature for one in bodies])
    stamps = np.array([one.stamp for one in bodies])
    before = way[stamps >= body.stamp - _SPEED_TIME - 1e-3]
    duration = body.stamp - stamps[stamps >= body.stamp - _SPEED_TIME - 1e-3][0]
    speed = np.linalg.norm(before[-1] - before[0]) / duration if duration > 0 else np.inf
    recent = way[stamps >= body.stamp - _SWING_TIME - 1e-3]
    left = body.left
    across = recent @ left
    along = recent - across[:, np.newaxis] * left
    forward = np.stack([along @ body.up, along @ body.forward], axis=1)
    return float(speed), (_swing(across), max(_swing(forward[:, 0]), _swing(forward[:, 1])))


def _swing(way: np.ndarray) -> float:
    """Return how far something goes to and fro: the smaller of its greatest ways in the two directions."""
    if len(way) < 3 or not np.isfinite(way).all():
        return 0.0
    there = float((way - np.minimum.accumulate(way)).max())
    back = float((np.maximum.accumulate(way) - way).max())
    return min(there, back)


def strongest(degrees: Dict[str, float]) -> List[str]:
    """Return gestures of one arm in the order of how far they hold."""
    return sorted((name for name in degrees if degrees[name] > 0), key=lambda name: -degrees[name])
