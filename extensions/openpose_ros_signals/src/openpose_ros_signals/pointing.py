"""Where a person points, and what is there."""
from typing import Optional, Sequence

import numpy as np

from openpose_ros_signals.constants import SIGNALS, PointingConstants
from openpose_ros_signals.geometry import ARMS, EYES, Body, angle, length, unit
from openpose_ros_signals.records import Hit, Pointing, Target


def pointing_of(body: Body, side: int) -> Optional[Pointing]:
    """Return the ray of the left (0) or right (1) arm; None if shoulder, wrist or head are hidden.

    People point with eyes and finger in line, or with the arm. The ray begins in the middle between the shoulder and
    the eyes and passes through the wrist, so that it errs by half the angle between both in either case.
    """
    shoulder, _, wrist = body.joints[ARMS[side]]
    origin = (shoulder + body.eyes) / 2
    reach = wrist - origin
    if not np.isfinite(reach).all():
        return None
    style = np.radians(angle(wrist - body.eyes, wrist - shoulder)) / 2
    # sigma is that of the position; two of its three axes are across the ray
    errors = np.append(body.sigma[ARMS[side, [0, 2]]], body.sigma[EYES])
    joints = np.sqrt(4 / 3) * np.nanmean(errors) / length(reach) if np.isfinite(errors).any() else 0.0
    return Pointing(origin, unit(reach), float(np.hypot(style, joints)))


def hit_target(pointing: Pointing, targets: Sequence[Target], constants: PointingConstants = SIGNALS.pointing
               ) -> Optional[Hit]:
    """Return the known target that is nearest to the ray, None if none is within its cone."""
    hits = [Hit(target.position, target.name, np.radians(angle(target.position - pointing.origin, pointing.direction)))
            for target in targets]
    inside = [hit for hit in hits if hit.off <= constants.cone * pointing.sigma]
    return min(inside, key=lambda hit: hit.off, default=None)


def hit_points(pointing: Pointing, points: np.ndarray, wrist: np.ndarray, stature: float,
               constants: PointingConstants = SIGNALS.pointing) -> Optional[Hit]:
    """Return where the ray meets the first surface beyond the hand, None if there is none.

    Args:
        points: (N, 3) [m] of a cloud; NaN where missing.
        wrist: (3,) [m]; with the stature [m] it tells where the hand ends.
    """
    away = points.astype(np.float64) - pointing.origin
    along = away @ pointing.direction
    across = np.linalg.norm(away - along[:, np.newaxis] * pointing.direction, axis=1)
    begin = float((wrist - pointing.origin) @ pointing.direction) + constants.beyond * stature
    with np.errstate(invalid='ignore'):
        near = (along > begin) & (across <= along * np.tan(np.radians(constants.width)))
    order = np.flatnonzero(near)[np.argsort(along[near])]
    last = constants.least_points - 1
    for first, further in zip(order, order[last:]):
        if along[further] - along[first] <= constants.surface:
            surface = order[(along[order] >= along[first]) & (along[order] <= along[first] + constants.surface)]
            place = pointing.origin + float(np.median(along[surface])) * pointing.direction
            return Hit(place)
    return None
