"""Where a person points, and what is there.

People hold the wrist on the line from their eyes to the target when they aim (Herbort and Kunde 2016: eye, finger and
target are in line), or stretch out the arm towards it. Both rays are 20 to 30 degrees apart, and one gesture does not
tell which is meant. The ray in the middle errs by half the angle between them in either case.
"""
from dataclasses import replace
from typing import Optional, Sequence, Tuple

import numpy as np

from openpose_ros_signals.constants import SIGNALS, PointingConstants
from openpose_ros_signals.geometry import ARMS, EYES, Body, angle, length, unit
from openpose_ros_signals.records import Hit, PointedTarget, Pointing, Ray, Target


def pointing_of(body: Body, side: int, constants: PointingConstants = SIGNALS.pointing) -> Optional[Pointing]:
    """Return the rays of the left (0) or right (1) arm; None if shoulder, wrist or head are hidden."""
    (shoulder, _, wrist), eyes = body.joints[ARMS[side]], body.eyes
    if not np.isfinite(wrist - shoulder - eyes).all():
        return None
    arm, head, aim = body.sigma[ARMS[side, [0, 2]]], body.sigma[EYES], np.radians(constants.aim)
    eye_ray = _ray(wrist, wrist - eyes, np.append(arm[1], head), aim)
    arm_ray = _ray(wrist, wrist - shoulder, arm, aim)
    middle = unit(eye_ray.direction + arm_ray.direction)
    reach = (length(wrist - eyes) + length(wrist - shoulder)) / 2
    style = np.radians(angle(eye_ray.direction, arm_ray.direction)) / 2
    ray = _ray(wrist, reach * middle, np.append(arm, head), np.hypot(style, aim))
    return Pointing(ray.origin, ray.direction, ray.sigma, None, eye_ray, arm_ray)


def _ray(wrist: np.ndarray, reach: np.ndarray, sigmas: np.ndarray, error: float) -> Ray:
    """Return the ray that reaches the wrist, with the error by its joints' sigmas [m] and another one [rad]."""
    # sigma is that of the position; two of its three axes are across the ray
    joints = np.sqrt(4 / 3) * np.nanmean(sigmas) / length(reach) if np.isfinite(sigmas).any() else 0.0
    return Ray(wrist - reach, unit(reach), float(np.hypot(joints, error)), None)


def targets_in_cone(pointing: Pointing, targets: Sequence[Target], constants: PointingConstants = SIGNALS.pointing
                    ) -> Tuple[PointedTarget, ...]:
    """Return the known targets in the cone round the middle ray, the most probable first.

    Probabilities are those of a normal distribution round each of the two rays, which are equally probable.
    """
    inside = [(target, off) for target, off in ((one, _off(pointing, one.position) / pointing.sigma) for one in targets)
              if off <= constants.cone]
    # sigma is a root mean square angle, of two axes
    density = np.array([sum(np.exp(-(_off(ray, target.position) / ray.sigma) ** 2) / ray.sigma ** 2
                            for ray in (pointing.eye_ray, pointing.arm_ray)) for target, _ in inside])
    shares = density / max(density.sum(), np.finfo(float).tiny)
    found = [PointedTarget(*target, off, float(share)) for (target, off), share in zip(inside, shares)]
    return tuple(sorted(found, key=lambda one: -one.probability))


def with_targets(pointing: Pointing, targets: Sequence[Target], constants: PointingConstants = SIGNALS.pointing
                 ) -> Pointing:
    """Return a pointing arm with the known targets in its cone; it hits the most probable one before the cloud."""
    found = targets_in_cone(pointing, targets, constants)
    hit = Hit(found[0].position, found[0].name, _off(pointing, found[0].position)) if found else pointing.hit
    return replace(pointing, hit=hit, targets=found)


def with_points(pointing: Pointing, points: np.ndarray, wrist: np.ndarray, stature: float,
                constants: PointingConstants = SIGNALS.pointing) -> Pointing:
    """Return a pointing arm with what each of its rays meets; arguments as of `hit_points`."""
    hit, *hits = (hit_points(ray, points, wrist, stature, constants)
                  for ray in (pointing, pointing.eye_ray, pointing.arm_ray))
    return replace(pointing, hit=hit, eye_ray=replace(pointing.eye_ray, hit=hits[0]),
                   arm_ray=replace(pointing.arm_ray, hit=hits[1]))


def _off(ray: Ray, position: np.ndarray) -> float:
    """Return the angle between a ray and a position, at the origin of the ray [rad]."""
    return float(np.radians(angle(position - ray.origin, ray.direction)))


def hit_points(ray: Ray, points: np.ndarray, wrist: np.ndarray, stature: float,
               constants: PointingConstants = SIGNALS.pointing) -> Optional[Hit]:
    """Return where the ray meets the first surface beyond the hand, None if there is none.

    Args:
        points: (N, 3) [m] of a cloud; NaN where missing.
        wrist: (3,) [m]; with the stature [m] it tells where the hand ends.
    """
    away = points.astype(np.float64) - ray.origin
    along = away @ ray.direction
    across = np.linalg.norm(away - along[:, np.newaxis] * ray.direction, axis=1)
    begin = float((wrist - ray.origin) @ ray.direction) + constants.beyond * stature
    with np.errstate(invalid='ignore'):
        near = (along > begin) & (across <= along * np.tan(np.radians(constants.width)))
    order = np.flatnonzero(near)[np.argsort(along[near])]
    last = constants.least_points - 1
    for first, further in zip(order, order[last:]):
        if along[further] - along[first] <= constants.surface:
            surface = order[(along[order] >= along[first]) & (along[order] <= along[first] + constants.surface)]
            return Hit(ray.origin + float(np.median(along[surface])) * ray.direction)
    return None
