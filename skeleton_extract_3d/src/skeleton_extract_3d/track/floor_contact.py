"""Feet and the floor: hidden feet of standing people are on it, and no inferred ankle lies below it."""
from dataclasses import replace

import numpy as np

from skeleton_extract_3d.body.body import ENDS, HIPS, LOWER_KINDS, MIDDLES, UPPER_KINDS
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.track.completion import Completion

_KNEES, _ANKLES = MIDDLES[2:], ENDS[2:]


def stand(seen: Completion, measured: np.ndarray, floor: np.ndarray, method: MethodConstants = METHOD) -> Completion:
    """Return people with their hidden ankles on or above the floor.

    An ankle with a keypoint is moved along its ray; one without is moved upright, and a knee without goes half the way.

    Args:
        measured: (N, 18) bool, joints on the person's own surface; they stay.
        floor: (4,) plane in the frame of the points: normal up, height of the camera [m].
    """
    constants, body, joints = method.track.standing, method.body, seen.tracks.joints
    leg = body.bone_lengths[UPPER_KINDS[2:]] + body.bone_lengths[LOWER_KINDS[2:]]
    height = joints.position @ floor[:3] + floor[3]
    scale = (seen.tracks.sizes.stature / body.adult_stature)[:, None]
    least = constants.ankle_height * scale
    ankle = joints.position[:, _ANKLES]
    stands = seen.placed[:, HIPS] & (height[:, HIPS] > constants.straight * leg * scale + least)
    free = seen.placed[:, _ANKLES] & ~seen.trusted[:, _ANKLES]
    on_ray = seen.trusted[:, _ANKLES] & ~measured[:, _ANKLES]
    missing = np.where(free & stands, least, np.maximum(height[:, _ANKLES], least)) - height[:, _ANKLES]
    missing = np.where(free | on_ray, np.clip(missing, -constants.reach, constants.reach), 0.0)
    # a step of 1 along the ray, from the camera on, changes the height by this
    fall = np.minimum(height[:, _ANKLES] - floor[3], -constants.least_fall)
    direction = np.where(on_ray[..., None], ankle / fall[..., None], floor[:3])
    knee_free = (seen.placed & ~seen.trusted)[:, _KNEES, None]
    step = missing[..., None] * direction
    position = joints.position.copy()
    position[:, _ANKLES] += step
    position[:, _KNEES] += np.where(knee_free, step / 2, 0.0)
    return seen._replace(tracks=replace(seen.tracks, joints=joints._replace(position=position)))
