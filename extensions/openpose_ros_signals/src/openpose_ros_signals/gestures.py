"""Gestures of one arm or both; how far each one holds, by the joints of the last second."""
import math
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_signals.constants import GestureConstants, SwingConstants
from openpose_ros_signals.geometry import ARMS, NOSE, TICK, Body, angle, least, length, ramp, unless_hidden
from skeleton_extract_3d.landmarks import Hands3D
from skeleton_extract_3d.people import MISSING

# Signs of the axes of a body for the left and the right arm: the first one points outwards.
_OUTWARDS = np.array([[[1.0], [1.0], [1.0]], [[-1.0], [1.0], [1.0]]])
# Points of a hand: wrist, first joints of index, middle and little finger.
_PALM = np.array([0, 5, 9, 17])


class Arm(NamedTuple):
    """An arm at one time; NaN where joints are hidden."""

    stamp: float  # [s]
    wrist: np.ndarray  # (3,) from the shoulder outwards (to the person's left of the left arm), forwards, up [statures]
    fore: np.ndarray  # (3,) unit vector from elbow to wrist, likewise
    reach: np.ndarray  # (3,) of the wrist from the shoulder, in the frame of the people [statures]
    place: np.ndarray  # (3,) of the wrist, in the frame of the people [statures]
    elbow: float  # angle of the elbow [deg], 180 straight
    raised: float  # angle of the line from shoulder to wrist to straight down [deg]
    forearm: float  # angle of the forearm to straight up [deg]
    over_eyes: float  # height of the wrist over the eyes [statures]
    from_nose: float  # distance of the wrist from the nose, or from eyes or ears where it is hidden [statures]
    error: float  # of the wrist from other joints, along a line [statures]
    turn_error: float  # of `raised` [deg]
    fore_error: float  # of `forearm` [deg]
    bend_error: float  # of `elbow` [deg]
    sure: bool  # whether the places of all three joints are known well
    known: bool  # whether shoulder, elbow, wrist and the left of the body are seen


class Palm(NamedTuple):
    """How a hand is held: unit vectors (3,) out of the palm, and from the wrist along the fingers."""

    normal: np.ndarray
    fingers: np.ndarray


class View(NamedTuple):
    """What gestures of an arm are told from."""

    arms: Sequence[Arm]  # in the last second, the newest last
    other: Arm  # the other arm
    palm: Optional[Palm]  # of this arm's hand; None: not known
    body: Body  # at the time of the newest
    gesture: GestureConstants
    swing: SwingConstants

    @property
    def arm(self) -> Arm:
        """The newest."""
        return self.arms[-1]


def arm_of(body: Body, side: int) -> Arm:
    """Return the left (0) or right (1) arm of a body."""
    shoulder, elbow, wrist = body.joints[ARMS[side]]
    axes = body.axes * _OUTWARDS[side]
    reach, fore = wrist - shoulder, wrist - elbow
    bend, from_shoulder = angle(shoulder - elbow, fore), axes @ reach / body.stature
    sigma = body.sigma[ARMS[side]]
    # of two places along one of three axes
    error = math.sqrt(2 / 3 * float(np.mean(sigma ** 2))) if np.isfinite(sigma).all() else 0.0
    fore_error = math.degrees(error / (length(fore) + 1e-12))
    nose = body.joints[NOSE] if np.isfinite(body.joints[NOSE, 0]) else body.eyes
    return Arm(body.stamp, from_shoulder, axes @ fore / (length(fore) + 1e-12), reach / body.stature,
               wrist / body.stature, bend, angle(reach, -body.up), angle(fore, body.up), body.height(wrist, body.eyes),
               length(wrist - nose) / body.stature, error / body.stature, math.degrees(error / (length(reach) + 1e-12)),
               # the elbow counts twice for its angle
               fore_error, math.sqrt(3) * fore_error, bool(body.sure[ARMS[side]].all()),
               not (math.isnan(bend) or math.isnan(from_shoulder[0])))


def palm_of(hands: Hands3D, person: int, left: bool) -> Optional[Palm]:
    """Return how the hand of a person is held, None if it was not found."""
    for row in np.flatnonzero((hands.people == person) & (hands.left == left)):
        points = hands.points.xyz[row, _PALM].astype(np.float64)
        if (hands.points.status[row, _PALM] != MISSING).all():
            normal = np.cross(points[1] - points[0], points[3] - points[0])
            return Palm(-normal if left else normal, points[2] - points[0])
    return None


def arm_degrees(view: View) -> Dict[str, float]:
    """Return how far each of `ARM_GESTURES` holds for one arm, 0 to 1; NaN if the arm is hidden."""
    degrees: Dict[str, float] = {}
    for gesture in ARM_GESTURES:
        degrees[gesture.name] = (least(gesture.degree(view), *(1 - degrees[name] for name in gesture.unless))
                                 if view.arm.known else np.nan)
    return degrees


def crossed_degree(left: Arm, right: Arm, body: Body, constants: GestureConstants) -> float:
    """Return how far the arms are crossed before the chest, 0 to 1; NaN if an arm is hidden."""
    if not (left.known and right.known):
        return np.nan
    gap = float((left.place - right.place) @ body.left)
    return least(ramp(gap, constants.crossed), *(ramp(-arm.fore[0], constants.inward) for arm in (left, right)),
                 *(ramp(-arm.wrist[2], constants.chest_height) for arm in (left, right)))


def _wave(view: View) -> float:
    """Return how far a hand that is up goes to and fro sideways."""
    arm, held, constants = view.arm, view.gesture, view.swing
    posture = least(ramp(arm.wrist[2], held.hand_up, arm.error), ramp(arm.forearm, held.forearm_up, arm.fore_error),
                    unless_hidden(ramp(arm.from_nose, held.off_face, arm.error)))
    if not posture > 0:
        return posture
    run = _newest_run(view.arms, lambda one: one.fore[2] > 0)
    if not run:
        return 0.0
    stamps = np.array([one.stamp for one in run])
    # without noise, whatever the rate of the frames
    near = np.abs(stamps[:, np.newaxis] - stamps) <= constants.smooth + TICK
    wrists = near @ np.array([one.wrist for one in run]) / near.sum(axis=1)[:, np.newaxis]
    ends = turns(wrists[:, 0], constants.wave[0] / 2)
    if not _is_swinging(run, ends, constants):
        return 0.0
    before, last = np.diff(wrists[ends[-3:]], axis=0)
    # a hand that is raised and lowered again by the side does not wave; at the top, a straight arm moves level
    lowered = last[0] > 0 and _level(before) < constants.wave_level
    if lowered or _level(last) < constants.wave_level:
        return 0.0
    if run[ends[-2]].elbow > held.straight_arm[1] and len(ends) < 4:
        return 0.0
    shorter, longer = sorted((abs(before[0]), abs(last[0])))
    return least(posture, ramp(longer, constants.wave), ramp(2 * shorter, constants.wave))


def _raise_hand(view: View) -> float:
    """Return how far a hand is above the eyes, its arm steep and still."""
    arm, constants = view.arm, view.gesture
    return least(ramp(arm.over_eyes, constants.over_eyes, arm.error),
                 ramp(arm.raised, constants.steep_arm, arm.turn_error),
                 ramp(arm.elbow, constants.open_elbow, arm.bend_error),
                 ramp(arm.from_nose, constants.off_face, arm.error), _held(view))


def _stop(view: View) -> float:
    """Return how far a hand says stop: by its palm, or without one by the arm."""
    arm, palm, body, constants = view.arm, view.palm, view.body, view.gesture
    held = least(ramp(_wrist_motion(view.arms, constants.stop_time), constants.held),
                 ramp(arm.wrist[1], constants.stop_ahead, arm.error))
    if palm is None:
        return least(held, 1 - ramp(arm.elbow, constants.straight_arm, arm.bend_error),
                     ramp(arm.forearm, constants.forearm_up, arm.fore_error),
                     ramp(arm.wrist[2], constants.hand_up, arm.error),
                     ramp(arm.from_nose, constants.off_face, arm.error))
    outwards = arm.reach - (arm.reach @ body.up) * body.up
    return least(held, ramp(angle(palm.normal, outwards), constants.palm),
                 ramp(angle(palm.fingers, body.up), constants.palm))


def _point(view: View) -> float:
    """Return how far an arm alone is stretched out and still, neither steep nor below the hips."""
    arm, body, constants = view.arm, view.body, view.gesture
    over_hips = body.height(arm.place * body.stature, body.hips)
    return least(_extended(arm, constants), 1 - ramp(arm.raised, constants.steep_arm, arm.turn_error),
                 _held(view),
                 unless_hidden(1 - _extended(view.other, constants)),
                 unless_hidden(ramp(over_hips, constants.over_hips, arm.error)))


class ArmGesture(NamedTuple):
    """A gesture of one arm."""

    name: str  # as PersonGesture.msg has it
    degree: Callable[[View], float]  # how far it holds, 0 to 1; NaN: not known
    unless: Tuple[str, ...] = ()  # gestures above it in the table that exclude it
    is_swing: bool = False  # a motion to and fro, which its degree sees as a whole
    also_lying: bool = False  # counts of a person that lies, too


ARM_GESTURES = (
    ArmGesture('wave', _wave, is_swing=True, also_lying=True),
    ArmGesture('raise_hand', _raise_hand, unless=('wave',), also_lying=True),
    ArmGesture('stop', _stop, unless=('wave', 'raise_hand')),
    ArmGesture('point', _point, unless=('wave', 'stop')))
"""All gestures of one arm."""


def _extended(arm: Arm, constants: GestureConstants) -> float:
    """Return how far an arm is straight and away from the body."""
    return least(ramp(arm.elbow, constants.straight_arm, arm.bend_error),
                 ramp(arm.raised, constants.arm_away, arm.turn_error))


def _held(view: View) -> float:
    return ramp(_wrist_motion(view.arms, view.gesture.held_time), view.gesture.held)


def _level(motion: np.ndarray) -> float:
    """Return how many times as far a motion goes to the side as forwards or up."""
    return float(abs(motion[0]) / (max(abs(motion[1]), abs(motion[2])) + 1e-9))


def _wrist_motion(arms: Sequence[Arm], seconds: float) -> float:
    """Return how far the wrist moved in this time [statures]; infinite if it was not seen before.

    From the shoulder or in space, whichever is less: people walk on, and shoulders are inaccurate.
    """
    newest, most = arms[-1], 0.0
    for arm in (arm for arm in arms[-2::-1] if arm.known):
        age = newest.stamp - arm.stamp
        most = max(most, min(length(newest.wrist - arm.wrist), length(newest.place - arm.place)))
        if age >= seconds - TICK:
            return most * seconds / age
    return np.inf


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


def _is_swinging(run: Sequence[Arm], ends: List[int], constants: SwingConstants) -> bool:
    """Return whether a motion goes to and fro, still does, and is seen well where it turns."""
    if len(ends) < 3:
        return False
    begin, turn, end = (run[row] for row in ends[-3:])
    return max(turn.stamp - begin.stamp, run[-1].stamp - turn.stamp) <= constants.pause and turn.sure and end.sure


def _newest_run(arms: Sequence[Arm], holds: Callable[[Arm], bool]) -> List[Arm]:
    """Return the newest arms in a row for which something holds; hidden ones are left out."""
    run: List[Arm] = []
    for arm in arms[::-1]:
        if arm.known and not holds(arm):
            break
        if arm.known:
            run.append(arm)
    return run[::-1]
