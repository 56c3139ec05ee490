"""From the joints of COCO_18, which are tracked, to those of other sets: chest, middle of the hips, feet."""
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.lift.surfaces import lower_median, window_depths
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

# Joints in the middle of others.
_TRUNK = ('left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')
_BETWEEN: Dict[str, Tuple[str, ...]] = {'mid_hip': _TRUNK[2:], 'chest': _TRUNK}
# Joints at the end of a body.
_FEET = tuple(f'{side}_{part}' for side in ('left', 'right') for part in ('big_toe', 'small_toe', 'heel'))


class _Hanging(NamedTuple):
    """A joint at the end of a body: the joint that it hangs on, and how far it is at most [m]."""

    parent: str
    reach: float


# Positions, status, sigma and velocity of one joint of the first people: arrays of `People3D` without the joints' axis.
_Joint = Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def in_skeleton(people: People3D, observed: ObservedPeople, view: FrameView, method: MethodConstants = METHOD
                ) -> People3D:
    """Return people with the joints of their network; the first are those of `observed`. Feet are not below the
    floor."""
    detected, skeleton = observed.people_2d, observed.people_2d.skeleton
    if skeleton.joints == COCO_18.joints:
        return people
    joints: List[_Joint] = [_joint(name, people, observed, view, method) for name in skeleton.joints]
    xyz, status, sigma, velocity = (np.stack(values, axis=1) for values in zip(*joints))
    rows = np.array([COCO_18.index.get(name, -1) for name in skeleton.joints])
    confidence = np.where(rows >= 0, people.confidence[:, rows], 0.0)
    confidence[:len(detected)] = detected.confidence
    return People3D(skeleton, xyz, confidence, status, sigma, people.ids, velocity)


def _joint(name: str, people: People3D, observed: ObservedPeople, view: FrameView, method: MethodConstants) -> _Joint:
    """Return one joint of all people; MISSING where nothing tells it."""
    if name in COCO_18.index:
        row = COCO_18.index[name]
        return people.xyz[:, row], people.status[:, row], people.sigma[:, row], people.velocity[:, row]
    if name in _BETWEEN:
        return _between(people, _BETWEEN[name])
    hanging = _hanging(name, method)
    unknown = np.full((len(people), 3), np.nan)
    missing = unknown, np.full(len(people), MISSING), unknown[:, 0], unknown
    if hanging is None:
        return missing
    joint = _at_the_end(people, observed.grid_xy[:, observed.people_2d.skeleton.index[name]], view, hanging, method)
    joint = joint if view.floor is None else _above(view.floor, joint)
    # people without a detection have no such joint
    return tuple(np.concatenate([values, rest[len(values):]])  # type: ignore[return-value]
                 for values, rest in zip(joint, missing))


def _hanging(name: str, method: MethodConstants) -> Optional[_Hanging]:
    if name == 'head_top':
        return _Hanging('neck', method.body.neck_to_head + method.body.head_axes[1])
    if name in _FEET:
        return _Hanging(f'{name.split("_")[0]}_ankle', method.extra_joints.foot_reach)
    return None


def _between(people: People3D, names: Tuple[str, ...]) -> _Joint:
    """Return the middle of some joints; it is measured if all of them are."""
    rows = [COCO_18.index[name] for name in names]
    status = people.status[:, rows]
    known = (status != MISSING).all(axis=1)
    seen = np.where((status == MEASURED).all(axis=1), MEASURED, INFERRED)
    return (people.xyz[:, rows].mean(axis=1), np.where(known, seen, MISSING),
            np.where(known, people.sigma[:, rows].max(axis=1), np.nan), people.velocity[:, rows].mean(axis=1))


@np.errstate(invalid='ignore', divide='ignore')
def _above(floor: np.ndarray, joint: _Joint) -> _Joint:
    """Return a joint, on the floor at its pixel where it was inferred below."""
    xyz, status, sigma, velocity = joint
    height = xyz @ floor[:3] + floor[3]
    below = (status == INFERRED) & (height < 0)
    return xyz * np.where(below, floor[3] / (floor[3] - height), 1.0)[:, None], status, sigma, velocity


@np.errstate(invalid='ignore')
def _at_the_end(people: People3D, uv: np.ndarray, view: FrameView, hanging: _Hanging, method: MethodConstants
                ) -> _Joint:
    """Return a joint on the surface at its keypoint (N, 2) [px of the grid], or else at its parent's depth."""
    constants, points, parent = method.extra_joints, view.points, COCO_18.index[hanging.parent]
    near = people.xyz[:len(uv), parent].astype(np.float64)
    known = np.isfinite(uv).all(axis=1) & np.isfinite(near).all(axis=1)
    focal = view.camera.focal_in((points.width, points.height))
    radius = np.clip(constants.window * focal / np.where(known, near[:, 2], 1.0), *method.windows.limits)
    depth = window_depths(points, uv[:, None], radius, method.windows)[:, 0] + constants.offset
    own = np.abs(depth - near[:, 2:]) < hanging.reach
    measured = known & (2 * own.sum(axis=1) > np.isfinite(depth).sum(axis=1))
    surface = lower_median(np.where(own, depth, np.nan))
    rays = view.camera.rays(np.where(known[:, None], uv, 0.0))
    xyz = rays * np.where(measured, surface, near[:, 2])[:, None]
    # an inferred place beyond the reach of the body means a wrong keypoint
    known &= np.linalg.norm(xyz - near, axis=1) < 2 * hanging.reach
    seen = np.where(measured, MEASURED, INFERRED)
    sigma = people.sigma[:len(uv), parent] + np.where(measured, constants.offset, hanging.reach / 2)
    return (np.where(known[:, None], xyz, np.nan), np.where(known, seen, MISSING), np.where(known, sigma, np.nan),
            np.where(known[:, None], people.velocity[:len(uv), parent], np.nan))
