"""From the joints of COCO_18, which are tracked, to those of other sets: chest, middle of the hips, top of the head."""
from typing import Dict, List, Mapping, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.lift.surfaces import lower_median, window_depths
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

# Depth of the top of the head under the surface, and how much greater than the neck's its error is [m].
_UNDER_SURFACE = 0.02
# Half the side of the window around its keypoint [m].
_WINDOW = 0.03
# Joints in the middle of others.
_TRUNK = ('left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')
_BETWEEN: Dict[str, Tuple[str, ...]] = {'mid_hip': _TRUNK[2:], 'chest': _TRUNK}

Joint = Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Positions, status, sigma and velocity of one joint of people: arrays of `People3D` without the joints' axis."""


def in_skeleton(people: People3D, observed: ObservedPeople, feet: Mapping[str, Joint], view: FrameView,
                method: MethodConstants = METHOD) -> People3D:
    """Return people with the joints of their network; the first are those of `observed`; `feet` by their names."""
    detected, skeleton = observed.people_2d, observed.people_2d.skeleton
    if skeleton.joints == COCO_18.joints:
        return people
    joints: List[Joint] = [feet[name] if name in feet else _joint(name, people, observed, view, method)
                           for name in skeleton.joints]
    xyz, status, sigma, velocity = (np.stack(values, axis=1) for values in zip(*joints))
    rows = np.array([COCO_18.index.get(name, -1) for name in skeleton.joints])
    confidence = np.where(rows >= 0, people.confidence[:, rows], 0.0)
    confidence[:len(detected)] = detected.confidence
    return People3D(skeleton, xyz, confidence, status, sigma, people.ids, velocity, people.existence)


def _joint(name: str, people: People3D, observed: ObservedPeople, view: FrameView, method: MethodConstants) -> Joint:
    """Return one joint of all people; MISSING where nothing tells it."""
    if name in COCO_18.index:
        row = COCO_18.index[name]
        return people.xyz[:, row], people.status[:, row], people.sigma[:, row], people.velocity[:, row]
    if name in _BETWEEN:
        return _between(people, _BETWEEN[name])
    unknown = np.full((len(people), 3), np.nan)
    missing = unknown, np.full(len(people), MISSING), unknown[:, 0], unknown
    if name != 'head_top':  # and where there are no people
        return missing
    joint = _head_top(people, observed.grid_xy[:, observed.people_2d.skeleton.index[name]], view, method)
    # people without a detection have no such joint
    return tuple(np.concatenate([values, rest[len(values):]])  # type: ignore[return-value]
                 for values, rest in zip(joint, missing))


def _between(people: People3D, names: Tuple[str, ...]) -> Joint:
    """Return the middle of some joints; it is measured if all of them are."""
    rows = [COCO_18.index[name] for name in names]
    status = people.status[:, rows]
    known = (status != MISSING).all(axis=1)
    seen = np.where((status == MEASURED).all(axis=1), MEASURED, INFERRED)
    return (people.xyz[:, rows].mean(axis=1), np.where(known, seen, MISSING),
            np.where(known, people.sigma[:, rows].max(axis=1), np.nan), people.velocity[:, rows].mean(axis=1))


@np.errstate(invalid='ignore')
def _head_top(people: People3D, uv: np.ndarray, view: FrameView, method: MethodConstants) -> Joint:
    """Return the top of heads on the surface at its keypoint (N, 2) [px of the grid], or else at the neck's depth."""
    points, parent = view.points, COCO_18.index['neck']
    reach = method.body.neck_to_head + method.body.head_axes[1]
    near = people.xyz[:len(uv), parent].astype(np.float64)
    known = np.isfinite(uv).all(axis=1) & np.isfinite(near).all(axis=1)
    focal = view.camera.focal_in((points.width, points.height))
    radius = np.clip(_WINDOW * focal / np.where(known, near[:, 2], 1.0), *method.windows.limits)
    depth = window_depths(points, uv[:, None], radius, method.windows)[:, 0] + _UNDER_SURFACE
    own = np.abs(depth - near[:, 2:]) < reach
    measured = known & (2 * own.sum(axis=1) > np.isfinite(depth).sum(axis=1))
    surface = lower_median(np.where(own, depth, np.nan))
    rays = view.camera.rays(np.where(known[:, None], uv, 0.0))
    xyz = rays * np.where(measured, surface, near[:, 2])[:, None]
    # an inferred place beyond the reach of the body means a wrong keypoint
    known &= np.linalg.norm(xyz - near, axis=1) < 2 * reach
    seen = np.where(measured, MEASURED, INFERRED)
    sigma = people.sigma[:len(uv), parent] + np.where(measured, _UNDER_SURFACE, reach / 2)
    return (np.where(known[:, None], xyz, np.nan), np.where(known, seen, MISSING), np.where(known, sigma, np.nan),
            np.where(known[:, None], people.velocity[:len(uv), parent], np.nan))
