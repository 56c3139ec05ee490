"""From the joints of COCO_18, which are followed, to those of other sets: chest, middle of the hips, feet."""
from typing import Dict, Tuple

import numpy as np

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.observation import grid_positions
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.point_grid import PointGrid

# Joints between two others: share of the way from the first to the second, each the middle of a pair.
_NECK, _HIPS = ('left_shoulder', 'right_shoulder'), ('left_hip', 'right_hip')
_BETWEEN: Dict[str, Tuple[Tuple[str, str], Tuple[str, str], float]] = {
    'mid_hip': (_NECK, _HIPS, 1.0), 'chest': (_NECK, _HIPS, 0.5)}
# Joints at the end of a body: the joint that they hang on, how far it is [m], and the depth under the skin [m].
_AT_THE_END: Dict[str, Tuple[str, float, float]] = {
    'head_top': ('neck', 0.35, 0.03),
    **{f'{side}_{part}': (f'{side}_ankle', 0.25, 0.02) for side in ('left', 'right')
       for part in ('big_toe', 'small_toe', 'heel')}}
# Half the side of the window [m] and its limits [px]: feet are narrow.
_WINDOW, _LIMITS = 0.03, (1.5, 20.0)
# Error of what is measured, and of what has only the depth of the joint that it hangs on [m].
_MEASURED_SIGMA, _INFERRED_SIGMA = 0.04, 0.12


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
    index, count = COCO_18.index, (len(people), len(skeleton.joints))
    result = {'xyz': np.full((*count, 3), np.nan), 'velocity': np.full((*count, 3), np.nan),
              'sigma': np.full(count, np.nan), 'status': np.zeros(count, np.uint8), 'confidence': np.zeros(count)}
    for joint, name in enumerate(skeleton.joints):
        if name in index:
            for key, values in result.items():
                values[:, joint] = getattr(people, key)[:, index[name]]
        elif name in _BETWEEN:
            _between(people, result, joint, *_BETWEEN[name])
        elif name in _AT_THE_END:
            _at_the_end(people, result, joint, uv[:, joint], points, camera, *_AT_THE_END[name])
    result['confidence'][:len(people_2d)] = people_2d.confidence
    return People3D(skeleton, result['xyz'], result['confidence'], result['status'], result['sigma'], people.ids,
                    result['velocity'])


def _between(people: People3D, result: Dict[str, np.ndarray], joint: int, first: Tuple[str, str],
             second: Tuple[str, str], share: float) -> None:
    """Place a joint on the way between the middles of two pairs; it is seen if all that it is made of is."""
    index = COCO_18.index
    rows = [index[name] for name in (*first, *second)]
    weights = np.array([(1 - share) / 2, (1 - share) / 2, share / 2, share / 2])
    used = [row for row, weight in zip(rows, weights) if weight > 0]
    for key in ('xyz', 'velocity'):
        result[key][:, joint] = (getattr(people, key)[:, used] * weights[weights > 0][:, None]).sum(axis=1)
    status = people.status[:, used]
    known = (status != MISSING).all(axis=1)
    of_known = np.where((status == MEASURED).all(axis=1), MEASURED, INFERRED)
    result['status'][:, joint] = np.where(known, of_known, MISSING)
    result['sigma'][:, joint] = np.where(known, people.sigma[:, used].max(axis=1), np.nan)


def _at_the_end(people: People3D, result: Dict[str, np.ndarray], joint: int, uv: np.ndarray, points: PointGrid,
                camera: CameraModel, parent: str, reach: float, under_skin: float) -> None:
    """Place a joint on the surface at its keypoint, or else at the depth of the joint that it hangs on."""
    seen = len(uv)
    row = COCO_18.index[parent]
    near = people.xyz[:seen, row].astype(np.float64)
    known = np.isfinite(uv).all(axis=1) & np.isfinite(near).all(axis=1)
    if not known.any():
        return
    focal = float(camera.matrix[0, 0] + camera.matrix[1, 1]) / 2
    radius = np.clip(_WINDOW * focal / np.where(known, near[:, 2], 1.0), *_LIMITS)
    depth = surfaces.window_depths(points, uv[:, None], radius)[:, 0] + under_skin
    with np.errstate(invalid='ignore'):
        own = np.abs(depth - near[:, 2:]) < reach
    ordered = np.sort(np.where(own, depth, np.inf), axis=1)
    count = own.sum(axis=1)
    surface = np.take_along_axis(ordered, np.maximum(count - 1, 0)[:, None] // 2, axis=1)[:, 0]
    measured = known & (2 * count > np.isfinite(depth).sum(axis=1))
    rays = camera.rays(np.where(known[:, None], uv, 0.0))
    xyz = rays * np.where(measured, np.where(measured, surface, 0.0), near[:, 2])[:, None]
    # an inferred place beyond the reach of the body is a keypoint that is elsewhere
    measured &= np.linalg.norm(xyz - near, axis=1) < 2 * reach
    known &= np.linalg.norm(xyz - near, axis=1) < 2 * reach
    result['xyz'][:seen, joint] = np.where(known[:, None], xyz, np.nan)
    result['velocity'][:seen, joint] = np.where(known[:, None], people.velocity[:seen, row], np.nan)
    result['status'][:seen, joint] = np.where(known, np.where(measured, MEASURED, INFERRED), MISSING)
    result['sigma'][:seen, joint] = np.where(known, np.where(measured, _MEASURED_SIGMA, _INFERRED_SIGMA), np.nan)
