"""How an arm is held, and how it has moved of late."""
import math
from typing import NamedTuple, Sequence

import numpy as np

from openpose_ros_signals.geometry import ARMS, NOSE, TICK, Body, angle, length

# Signs of the axes of a body for the left and the right arm: the first one points outwards.
_OUTWARDS = np.array([[[1.0], [1.0], [1.0]], [[-1.0], [1.0], [1.0]]])


class Arm(NamedTuple):
    """An arm at one time; NaN where joints are hidden.

    Attributes:
        stamp: [s].
        wrist: (3,) from the shoulder outwards (to the person's left of the left arm), forwards and up [statures].
        fore: (3,) unit vector from elbow to wrist, likewise.
        reach, place: (3,) of the wrist from the shoulder, and in space, in the frame of the people [statures].
        elbow: angle of the elbow [deg], 180 straight.
        raised: angle of the line from shoulder to wrist to straight down [deg].
        forearm: angle of the forearm to straight up [deg].
        over_eyes: height of the wrist over the eyes [statures].
        from_nose: distance of the wrist from the nose, or from eyes or ears where it is hidden [statures].
        sure: whether the places of all three joints are known well.
        known: whether shoulder, elbow, wrist and the left of the body are seen.
    """

    stamp: float
    wrist: np.ndarray
    fore: np.ndarray
    reach: np.ndarray
    place: np.ndarray
    elbow: float
    raised: float
    forearm: float
    over_eyes: float
    from_nose: float
    sure: bool
    known: bool


def arm_of(body: Body, side: int) -> Arm:
    """Return the left (0) or right (1) arm of a body."""
    shoulder, elbow, wrist = body.joints[ARMS[side]]
    axes = body.axes * _OUTWARDS[side]
    reach, fore = wrist - shoulder, wrist - elbow
    bend, beside = angle(shoulder - elbow, fore), axes @ reach / body.stature
    nose = body.joints[NOSE] if np.isfinite(body.joints[NOSE, 0]) else body.eyes
    return Arm(body.stamp, beside, axes @ fore / (length(fore) + 1e-12), reach / body.stature,
               wrist / body.stature, bend, angle(reach, -body.up), angle(fore, body.up), body.height(wrist, body.eyes),
               body.distance(wrist, nose), bool(body.sure[ARMS[side]].all()),
               not (math.isnan(bend) or math.isnan(beside[0])))


def held_way(arms: Sequence[Arm], seconds: float) -> float:
    """Return the way of the wrist in this time [statures]; infinite if it was not seen before.

    It is that beside the shoulder or that in space, whichever is less: people walk on, and shoulders are inaccurate.

    Args:
        arms: of one side, the newest last.
    """
    newest, most = arms[-1], 0.0
    for arm in (arm for arm in arms[-2::-1] if arm.known):
        age = newest.stamp - arm.stamp
        most = max(most, min(length(newest.wrist - arm.wrist), length(newest.place - arm.place)))
        if age >= seconds - TICK:
            return most * seconds / age
    return np.inf
