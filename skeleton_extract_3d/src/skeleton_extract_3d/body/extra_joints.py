"""From the joints of COCO_18, which are followed, to those of other sets: chest, middle of the hips, feet."""
from typing import Dict, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.observation import grid_positions
from skeleton_extract_3d.lift.surfaces import lower_median, window_depths
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.point_grid import PointGrid

_EXTRA = METHOD.extra_joints
# Joints in the middle of others.
_TRUNK = ('left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')
_BETWEEN: Dict[str, Tuple[str, ...]] = {'mid_hip': _TRUNK[2:], 'chest': _TRUNK}


class _Hanging(NamedTuple):
    """A joint at the end of a body: the joint that it hangs on, how far it is, and the depth under the skin [m]."""

    parent: str
    reach: float
    offset: float


# Positions, status, sigma and velocity of one joint of the first people: arrays of `People3D` without the joints' axis.
_Joint = Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]

_AT_THE_END: Dict[str, _Hanging] = {
    'head_top': _Hanging('neck', _EXTRA.head_reach, _EXTRA.head_offset),
    **{f'{side}_{part}': _Hanging(f'{side}_ankle', _EXTRA.foot_reach, _EXTRA.foot_offset)
       for side in ('left', 'right') for part in ('big_toe', 'small_toe', 'heel')}}


def in_skeleton(people: People3D, people_2d: People2D, image_size: Tuple[int, int], points: PointGrid,
                camera: CameraModel, floor: Optional[np.ndarray] = None) -> People3D:
    """Return people with the joints of another set.

    Args:
        people: with the joints of COCO_18; the first are those of `people_2d`.
        people_2d: with the joints of the other set.
        image_size: width and height of the image [px].
        floor: (4,) no inferred foot lies below it, see `Frame`; None: it is not known.
    """
    skeleton = people_2d.skeleton
    if skeleton.joints == COCO_18.joints:
        return people
    rows = np.array([COCO_18.index.get(name, -1) for name in skeleton.joints])
    alike = rows >= 0
    xyz, velocity = (np.where(alike[:, None], values[:, rows], np.nan) for values in (people.xyz, people.velocity))
    status, sigma = np.where(alike, people.status[:, rows], MISSING), np.where(alike, people.sigma[:, rows], np.nan)
    confidence = np.where(alike, people.confidence[:, rows], 0.0)
    confidence[:len(people_2d)] = people_2d.confidence
    uv = grid_positions(people_2d.xy, image_size, (points.width, points.height))
    for number, name in enumerate(skeleton.joints):
        if name in _BETWEEN:
            joint = _between(people, _BETWEEN[name])
        elif name in _AT_THE_END:
            joint = _at_the_end(people, uv[:, number], points, camera, _AT_THE_END[name])
            if floor is not None:
                joint = _above(floor, joint)
        else:
            continue
        for values, of_joint in zip((xyz, status, sigma, velocity), joint):
            values[:len(of_joint), number] = of_joint
    return People3D(skeleton, xyz, confidence, status, sigma, people.ids, velocity)


def _between(people: People3D, names: Tuple[str, ...]) -> _Joint:
    """Return the middle of some joints; it is seen if all of them are."""
    rows = [COCO_18.index[name] for name in names]
    status = people.status[:, rows]
    known = (status != MISSING).all(axis=1)
    seen = np.where((status == MEASURED).all(axis=1), MEASURED, INFERRED)
    return (people.xyz[:, rows].mean(axis=1), np.where(known, seen, MISSING),
            np.where(known, people.sigma[:, rows].max(axis=1), np.nan), people.velocity[:, rows].mean(axis=1))


@np.errstate(invalid='ignore', divide='ignore')
def _above(floor: np.ndarray, joint: _Joint) -> _Joint:
    """Return a joint that is on the floor, at its pixel, where it was inferred to be below."""
    xyz, status, sigma, velocity = joint
    height = xyz @ floor[:3] + floor[3]
    below = (status == INFERRED) & (height < 0)
    return xyz * np.where(below, floor[3] / (floor[3] - height), 1.0)[:, None], status, sigma, velocity


@np.errstate(invalid='ignore')
def _at_the_end(people: People3D, uv: np.ndarray, points: PointGrid, camera: CameraModel, hanging: _Hanging) -> _Joint:
    """Return a joint on the surface at its keypoint, or else at the depth of the joint that it hangs on.

    Args:
        uv: (N, 2) its keypoints of the first N people [px of the grid], NaN where there is none.
    """
    parent = COCO_18.index[hanging.parent]
    near = people.xyz[:len(uv), parent].astype(np.float64)
    known = np.isfinite(uv).all(axis=1) & np.isfinite(near).all(axis=1)
    focal = camera.focal_in((points.width, points.height))
    radius = np.clip(_EXTRA.window * focal / np.where(known, near[:, 2], 1.0), *_EXTRA.window_limits)
    depth = window_depths(points, uv[:, None], radius)[:, 0] + hanging.offset
    own = np.abs(depth - near[:, 2:]) < hanging.reach
    measured = known & (2 * own.sum(axis=1) > np.isfinite(depth).sum(axis=1))
    surface = lower_median(np.where(own, depth, np.nan))
    rays = camera.rays(np.where(known[:, None], uv, 0.0))
    xyz = rays * np.where(measured, surface, near[:, 2])[:, None]
    # an inferred place beyond the reach of the body is a keypoint that is elsewhere
    known &= np.linalg.norm(xyz - near, axis=1) < 2 * hanging.reach
    seen = np.where(measured, MEASURED, INFERRED)
    sigma = np.where(measured, _EXTRA.measured_sigma, _EXTRA.inferred_sigma)
    return (np.where(known[:, None], xyz, np.nan), np.where(known, seen, MISSING), np.where(known, sigma, np.nan),
            np.where(known[:, None], people.velocity[:len(uv), parent], np.nan))
