"""From the joints of COCO_18, which are followed, to those of other sets: chest, middle of the hips, feet."""
from typing import Dict, NamedTuple, Tuple

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


_AT_THE_END: Dict[str, _Hanging] = {
    'head_top': _Hanging('neck', _EXTRA.head_reach, _EXTRA.head_offset),
    **{f'{side}_{part}': _Hanging(f'{side}_ankle', _EXTRA.foot_reach, _EXTRA.foot_offset)
       for side in ('left', 'right') for part in ('big_toe', 'small_toe', 'heel')}}


class _Joint(NamedTuple):
    """One joint of P people: the arrays of `People3D` without the axis of the joints."""

    xyz: np.ndarray
    confidence: np.ndarray
    status: np.ndarray
    sigma: np.ndarray
    velocity: np.ndarray


def in_skeleton(people: People3D, people_2d: People2D, image_size: Tuple[int, int], points: PointGrid,
                camera: CameraModel) -> People3D:
    """Return people with the joints of another set.

    Args:
        people: with the joints of COCO_18; the first are those of `people_2d`.
        people_2d: with the joints of the other set.
        image_size: width and height of the image [px].
    """
    skeleton = people_2d.skeleton
    if skeleton.joints == COCO_18.joints:
        return people
    uv = grid_positions(people_2d.xy, image_size, (points.width, points.height))
    joints = []
    for number, name in enumerate(skeleton.joints):
        if name in COCO_18.index:
            joints.append(_joint_of(people, name))
        elif name in _BETWEEN:
            joints.append(_between(people, _BETWEEN[name]))
        elif name in _AT_THE_END:
            joints.append(_at_the_end(people, uv[:, number], points, camera, _AT_THE_END[name]))
        else:
            joints.append(_missing(len(people)))
    xyz, confidence, status, sigma, velocity = (np.stack(values, axis=1) for values in zip(*joints))
    confidence[:len(people_2d)] = people_2d.confidence
    return People3D(skeleton, xyz, confidence, status, sigma, people.ids, velocity)


def _missing(people: int) -> _Joint:
    """Return a joint of which nothing is known."""
    nowhere = np.full((people, 3), np.nan)
    return _Joint(nowhere, np.zeros(people), np.full(people, MISSING), nowhere[:, 0], nowhere)


def _joint_of(people: People3D, name: str) -> _Joint:
    """Return a joint of COCO_18."""
    row = COCO_18.index[name]
    return _Joint(people.xyz[:, row], people.confidence[:, row], people.status[:, row], people.sigma[:, row],
                  people.velocity[:, row])


def _between(people: People3D, names: Tuple[str, ...]) -> _Joint:
    """Return the middle of some joints; it is seen if all of them are."""
    rows = [COCO_18.index[name] for name in names]
    status = people.status[:, rows]
    known = (status != MISSING).all(axis=1)
    seen = np.where((status == MEASURED).all(axis=1), MEASURED, INFERRED)
    return _missing(len(people))._replace(
        xyz=people.xyz[:, rows].mean(axis=1), velocity=people.velocity[:, rows].mean(axis=1),
        status=np.where(known, seen, MISSING), sigma=np.where(known, people.sigma[:, rows].max(axis=1), np.nan))


@np.errstate(invalid='ignore')
def _at_the_end(people: People3D, uv: np.ndarray, points: PointGrid, camera: CameraModel, hanging: _Hanging) -> _Joint:
    """Return a joint on the surface at its keypoint, or else at the depth of the joint that it hangs on.

    Args:
        uv: (N, 2) its keypoints of the first N people [px of the grid], NaN where there is none.
    """
    result, count = _missing(len(people)), len(uv)
    parent = _joint_of(people, hanging.parent)
    near = parent.xyz[:count].astype(np.float64)
    known = np.isfinite(uv).all(axis=1) & np.isfinite(near).all(axis=1)
    if not known.any():
        return result
    focal = float(camera.matrix[0, 0] + camera.matrix[1, 1]) / 2
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
    shown = _Joint(np.where(known[:, None], xyz, np.nan), result.confidence[:count], np.where(known, seen, MISSING),
                   np.where(known, sigma, np.nan), np.where(known[:, None], parent.velocity[:count], np.nan))
    # those after the first N have no keypoint
    return _Joint(*(np.concatenate([first, rest[count:]]) for first, rest in zip(shown, result)))
