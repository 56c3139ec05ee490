"""Where a person points, and what is there.

People hold the wrist on the line from their eyes to the target when they aim (Herbort and Kunde 2016: eye, finger and
target are in line), or stretch out the arm towards it. Both rays are 20 to 30 degrees apart, and one gesture does not
tell which is meant. The ray in the middle errs by half the angle between them in either case.
"""
from dataclasses import replace
from typing import Optional, Sequence

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
    return Pointing(ray.origin, ray.direction, ray.sigma, eye_ray, arm_ray)


def _ray(wrist: np.ndarray, reach: np.ndarray, sigmas: np.ndarray, error: float) -> Ray:
    """Return the ray that reaches the wrist, with the error by its joints' sigmas [m] and another one [rad]."""
    # sigma is that of the position; two of its three axes are across the ray
    joints = np.sqrt(4 / 3) * np.nanmean(sigmas) / length(reach) if np.isfinite(sigmas).any() else 0.0
    return Ray(wrist - reach, unit(reach), float(np.hypot(joints, error)))


def with_targets(pointing: Pointing, targets: Sequence[Target], constants: PointingConstants = SIGNALS.pointing
                 ) -> Pointing:
    """Return a pointing arm with the known targets in the cone round the middle ray; it hits the most probable one.

    Probabilities are those of a normal distribution round each of the two rays, which are equally probable.
    """
    inside = [(target, off) for target, off in ((one, _off(pointing, one.position) / pointing.sigma) for one in targets)
              if off <= constants.cone]
    # sigma is a root mean square angle, of two axes
    density = np.array([sum(np.exp(-(_off(ray, target.position) / ray.sigma) ** 2) / ray.sigma ** 2
                            for ray in (pointing.eye_ray, pointing.arm_ray)) for target, _ in inside])
    shares = density / max(density.sum(), np.finfo(float).tiny)
    found = sorted((PointedTarget(*target, off, float(share)) for (target, off), share in zip(inside, shares)),
                   key=lambda one: -one.probability)
    hit = Hit(found[0].position, found[0].name, _off(pointing, found[0].position)) if found else None
    return replace(pointing, hit=hit, targets=tuple(found))


def _off(ray: Ray, position: np.ndarray) -> float:
    """Return the angle between a ray and a position, at the origin of the ray [rad]."""
    return float(np.radians(angle(position - ray.origin, ray.direction)))
