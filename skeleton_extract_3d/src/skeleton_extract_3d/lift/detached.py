"""Surfaces that are detached from the body: cloth, a box or a tray that a person holds, or a table, before the joints.

The front of a body is one surface, from the shoulders to the hips and along the legs. Where its depth falls by a step
on the way to a joint and does not rise again, as it does behind an arm, what is seen there is in front of the body.
"""
import numpy as np

from skeleton_extract_3d.body.body import ENDS, HEAD, HIPS, MIDDLES, NECK, SHOULDERS
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.constants import DetachedConstants
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.lift.surfaces import depths_at, lower_median
from skeleton_extract_3d.points.point_grid import PointGrid

_KNEES, _ANKLES, _UPPER = MIDDLES[2:], ENDS[2:], np.append(SHOULDERS, NECK)
# Ways on the body, of the left and the right side: to a hip from the neck and both shoulders, along thigh and shin, and
# from a knee to the neck.
_STARTS = np.stack([[NECK, NECK], SHOULDERS, SHOULDERS[::-1], _KNEES, _ANKLES, _KNEES], axis=1)
_ENDS_OF_WAYS = np.stack([HIPS, HIPS, HIPS, HIPS, _KNEES, [NECK, NECK]], axis=1)
_PLACES = np.linspace(0.0, 1.0, 25)[:, None]


def detached_samples(points: PointGrid, seen: ObservedPeople, method: MethodConstants = METHOD) -> np.ndarray:
    """Return which samples are on surfaces before the own body, (P, 18, 25) bool."""
    joints = detached_joints(points, seen, method)
    if not joints.any():
        return np.zeros(seen.samples.shape, bool)
    surface = depths_at(points, np.where(joints[..., None], seen.uv, -1e6))
    surface = np.where(np.isfinite(surface), surface, lower_median(seen.samples))
    return seen.samples < np.where(joints, surface + method.detached.step / 2, -np.inf)[..., None]


def detached_joints(points: PointGrid, seen: ObservedPeople, method: MethodConstants = METHOD) -> np.ndarray:
    """Return which joints have a surface before them that is detached from the body, (P, 18) bool."""
    constants, body, people = method.detached, method.body, len(seen.uv)
    falls = falls_along(points, seen.uv[:, _STARTS], seen.uv[:, _ENDS_OF_WAYS], constants)
    to_hip, thighs, shins, to_neck = lower_median(falls[..., :3]), falls[..., 3], falls[..., 4], falls[..., 5]
    middle = falls_along(points, seen.uv[:, NECK], seen.uv[:, HIPS].mean(axis=1), constants)  # a hand is not there
    hips = (to_hip > constants.step) & (middle > constants.step / 2)[:, None] | (
        np.minimum(thighs, to_neck) > constants.step)
    # trunk, and trunk and thigh, that do not point at the camera, as those of people who lie or sit may
    from_neck = seen.rays[:, NECK, None, None] - seen.rays[:, np.stack([HIPS, _KNEES], axis=1)]
    whole = body.trunk_length + np.array([0.0, body.thigh])
    flat = np.sqrt((from_neck ** 2).sum(axis=3)) * seen.adult_depth[:, None, None] > constants.flat * whole
    # one surface before both hips and a knee, or an ankle
    knees = hips.all(axis=1)[:, None] & (np.abs(thighs) < constants.step / 2) & flat[..., 1]
    ankles = knees & (np.abs(shins) < constants.step / 2)
    # one surface before shoulders and neck, but not before a face: from the hips, or from the knees
    above = np.fmax(-lower_median(falls[..., :3].reshape(people, 6)), lower_median(to_neck))
    head, neck = lower_median(lower_median(seen.samples[:, HEAD])), lower_median(seen.samples[:, NECK])
    face = (lower_median(seen.scores[:, HEAD]) > constants.face) & (np.abs(head - neck) < constants.step)
    shoulders = (above > constants.step) & flat[..., 0].any(axis=1) & ~face
    joints = np.zeros(seen.scores.shape, bool)
    for places, values in ((HIPS, hips), (_KNEES, knees), (_ANKLES, ankles), (_UPPER, shoulders[:, None])):
        joints[:, places] = values
    return joints


def falls_along(points: PointGrid, start: np.ndarray, end: np.ndarray, constants: DetachedConstants = METHOD.detached
                ) -> np.ndarray:
    """Return by how much the depth falls in steps on straight ways in the image, less by how much it rises, (...) [m].

    It is at most the fall from start to end.

    Args:
        start, end: (..., 2) [px of the grid]; NaN: the way is not known, nor is the result.
    """
    way = start[..., None, :] + (end - start)[..., None, :] * _PLACES
    depth = depths_at(points, np.where(np.isfinite(way), way, -1e6))
    for place in range(1, len(_PLACES)):  # what is missing is as before
        depth[..., place] = np.where(np.isfinite(depth[..., place]), depth[..., place], depth[..., place - 1])
    # without single outliers
    depth = np.sort(np.stack([depth[..., :-2], depth[..., 1:-1], depth[..., 2:]]), axis=0)[1]
    change = depth[..., :-1] - depth[..., 1:]
    steps, whole = np.where(np.abs(change) > constants.steep, change, 0.0).sum(axis=-1), depth[..., 0] - depth[..., -1]
    return np.sign(whole) * np.clip(steps * np.sign(whole), 0.0, np.abs(whole))
