"""How an arm is held, and how it has moved of late."""
from typing import NamedTuple, Sequence

import numpy as np

from openpose_ros_signals.geometry import ARMS, NOSE, TICK, Body, angle


class Arm(NamedTuple):
    """An arm at one time; NaN where joints are hidden.

    Attributes:
        stamp: [s].
        wrist: (3,) from the shoulder to the person's left, forwards and up [statures].
        place: (3,) of the wrist [statures].
        fore: (3,) unit vector from elbow to wrist, likewise.
        elbow: angle of the elbow [deg], 180 straight.
        raised: angle of the line from shoulder to wrist to straight down [deg].
        forearm: angle of the forearm to straight up [deg].
        over_eyes: height of the wrist over the eyes [statures].
        from_nose: distance of the wrist from the nose [statures].
        sigma: the greatest of the three joints [statures]; 0 if not estimated.
    """

    stamp: float
    wrist: np.ndarray
    place: np.ndarray
    fore: np.ndarray
    elbow: float
    raised: float
    forearm: float
    over_eyes: float
    from_nose: float
    sigma: float

    @property
    def known(self) -> bool:
        """Whether shoulder, elbow and wrist are seen."""
        return bool(np.isfinite(self.elbow) and np.isfinite(self.wrist).all())


def arm_of(body: Body, side: int) -> Arm:
    """Return the left (0) or right (1) arm of a body."""
    shoulder, elbow, wrist = body.joints[ARMS[side]]
    axes = np.array([body.left, body.forward, body.up])
    reach, fore = wrist - shoulder, wrist - elbow
    return Arm(body.stamp, axes @ reach / body.stature, wrist / body.stature,
               axes @ fore / (np.linalg.norm(fore) + 1e-12),
               angle(shoulder - elbow, fore), angle(reach, -body.up), angle(fore, body.up),
               body.height(wrist, body.eyes), body.distance(wrist, body.joints[NOSE]),
               float(np.nan_to_num(body.sigma[ARMS[side]]).max()) / body.stature)


def held_way(arms: Sequence[Arm], seconds: float) -> float:
    """Return the way of the wrist in this time [statures]; infinite if it was not seen before.

    It is that beside the shoulder or that in space, whichever is less: people walk on, and shoulders are inaccurate.

    Args:
        arms: of one side, the newest last.
    """
    newest = arms[-1]
    ways = [min(float(np.linalg.norm(newest.wrist - arm.wrist)), float(np.linalg.norm(newest.place - arm.place)))
            for arm in arms]
    most = 0.0
    for arm, way in zip(arms[-2::-1], ways[-2::-1]):
        age = newest.stamp - arm.stamp
        if np.isnan(way):
            continue
        most = max(most, way)
        if age >= seconds - TICK:
            return most * seconds / age
    return np.inf
