"""Gestures of one arm or both; how far each one holds, by the joints of the last second."""
from typing import Dict, List, NamedTuple, Optional, Sequence

import numpy as np

from openpose_ros_signals.arms import Arm, held_way
from openpose_ros_signals.constants import GestureConstants, SignalConstants, SwingConstants
from openpose_ros_signals.geometry import TICK, Body, angle, least, ramp, unless_hidden
from openpose_ros_signals.records import ARM_GESTURES
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
                   ramp(arm.elbow, constants.open_elbow), ramp(arm.from_nose, constants.off_face), held, 1 - wave)
    stop = least(_says_stop(arms, palm, body, constants), 1 - wave, 1 - beckon, 1 - raised)
    over_hips = body.height(arm.place * body.stature, body.hips)
    point = least(extended(arm, constants), 1 - ramp(arm.raised, constants.steep_arm), held, 1 - wave, 1 - beckon,
                  1 - stop, unless_hidden(1 - extended(other, constants)),
                  unless_hidden(ramp(over_hips, constants.over_hips)))
    return {'wave': wave, 'raise_hand': raised, 'beckon': beckon, 'stop': stop, 'point': point}


def _says_stop(arms: Sequence[Arm], palm: Optional[Palm], body: Body, constants: GestureConstants) -> float:
    """Return how far a hand says stop: by its palm, or without one by the arm."""
    arm = arms[-1]
    held = least(ramp(held_way(arms, constants.stop_time), constants.held), ramp(arm.wrist[1], constants.stop_ahead))
    if palm is None:
        return least(held, 1 - ramp(arm.elbow, constants.straight_arm), ramp(arm.forearm, constants.forearm_up),
                     ramp(arm.wrist[2], constants.hand_up), ramp(arm.from_nose, constants.off_face))
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
        degrees.append(ramp(-arm.wrist[2], constants.chest_height))
    return least(*degrees)


def wave_degree(arms: Sequence[Arm], constants: SwingConstants, held: GestureConstants) -> float:
    """Return how far a hand that is up goes to and fro sideways, 0 to 1; NaN if the arm is hidden.

    Args:
        arms: of one side, in the last second, the newest last.
    """
    arm = arms[-1]
    posture = least(ramp(arm.wrist[2], held.hand_up), ramp(arm.forearm, held.forearm_up),
                    unless_hidden(ramp(arm.from_nose, held.off_face)))
    if not posture > 0:
        return posture
    run = _while(arms, [one.fore[2] > 0 for one in arms])
    if not run:
        return 0.0
    ways = _smoothed(run, np.array([one.wrist for one in run]), constants.smooth)
    ends = turns(ways[:, 0], constants.wave[0] / 2)
    if not _lively(run, ends, constants):
        return 0.0
    before, last = np.diff(ways[ends[-3:]], axis=0)
    # a hand that is raised and lowered again by the side does not wave; at the top, a straight arm moves level
    lowered = last[0] > 0 and _level(before) < constants.wave_level
    if lowered or _level(last) < constants.wave_level:
        return 0.0
    if run[ends[-2]].elbow > held.straight_arm[1] and len(ends) < 4:
        return 0.0
    shorter, longer = sorted((abs(before[0]), abs(last[0])))
    return least(posture, ramp(longer, constants.wave), ramp(2 * shorter, constants.wave))


def _level(way: np.ndarray) -> float:
    """Return how many times as far a way goes to the side as forwards or up."""
    return float(abs(way[0]) / (max(abs(way[1]), abs(way[2])) + 1e-9))


def beckon_degree(arms: Sequence[Arm], constants: SwingConstants, held: GestureConstants) -> float:
    """Return how far the elbow of an arm before the body bends and stretches, 0 to 1; NaN if the arm is hidden.

    Args:
        arms: of one side, in the last second, the newest last.
    """
    arm = arms[-1]
    posture = least(ramp(arm.wrist[1], constants.beckon_ahead), ramp(arm.from_nose, held.off_face),
                    1 - ramp(arm.over_eyes, held.over_eyes))
    if not posture > 0:
        return posture
    run = _while(arms, [one.elbow < held.straight_arm[1] for one in arms])
    if not run:
        return 0.0
    elbows = _smoothed(run, np.array([one.elbow for one in run]), constants.smooth)
    ends = turns(elbows, constants.beckon[0])
    if not _lively(run, ends, constants):
        return 0.0
    before, last = np.abs(np.diff(elbows[ends[-3:]]))
    ways = np.diff([run[row].wrist for row in ends[-3:]], axis=0)
    along = (np.abs(ways[:, 0]) <= constants.beckon_side * np.linalg.norm(ways, axis=1)).all()
    bent = ramp(elbows[ends[-3:]].min(), constants.beckon_bent)
    return least(posture, bent, ramp(min(before, last), constants.beckon)) if along else 0.0


def turns(values: np.ndarray, least_way: float) -> List[int]:
    """Return the rows where values (N,) turn, between ways of at least a length, with the begin and the newest end."""
    low = high = 0
    ends: List[int] = []
    rising = 0
    for row, value in enumerate(values):
        if rising >= 0 and value > values[high]:
            high = row
        if rising <= 0 and value < values[low]:
            low = row
        if rising >= 0 and value <= values[high] - least_way:  # it has turned downwards
            ends.append(high)
            rising, low = -1, row
        elif rising <= 0 and value >= values[low] + least_way:
            ends.append(low)
            rising, high = 1, row
    return [*ends, high if rising > 0 else low]


def _smoothed(run: Sequence[Arm], values: np.ndarray, smooth: float) -> np.ndarray:
    """Return values (N, ...) of an arm over time without their noise, whatever the rate of the frames."""
    stamps = np.array([arm.stamp for arm in run])
    near = np.abs(stamps[:, np.newaxis] - stamps) <= smooth + TICK
    return np.asarray(near @ values / near.sum(axis=1).reshape(-1, *(1,) * (values.ndim - 1)))


def _lively(run: Sequence[Arm], ends: List[int], constants: SwingConstants) -> bool:
    """Return whether a motion goes to and fro, still does, and is seen well where it turns."""
    if len(ends) < 3:
        return False
    begin, turn, end = (run[row] for row in ends[-3:])
    return (max(turn.stamp - begin.stamp, run[-1].stamp - turn.stamp) <= constants.pause and turn.sure and end.sure)


def _while(arms: Sequence[Arm], holds: Sequence[bool]) -> List[Arm]:
    """Return the newest arms in a row for which something holds; hidden ones are left out."""
    run: List[Arm] = []
    for arm, one in zip(arms[::-1], holds[::-1]):
        if arm.known and not one:
            break
        if arm.known:
            run.append(arm)
    return run[::-1]
