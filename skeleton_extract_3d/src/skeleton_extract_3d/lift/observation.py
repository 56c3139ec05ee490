"""Observation of people: keypoints on the grid of the points, their rays, and the surfaces around them."""
from dataclasses import replace
from typing import Tuple

import numpy as np

from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import ENDS, HIPS, MIDDLES, NECK, ROOTS, SHOULDERS
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.detached import detached_samples
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.point_grid import PointGrid


def observe(people: People2D, image_size: Tuple[int, int], points: PointGrid, camera: CameraModel,
            method: MethodConstants = METHOD) -> ObservedPeople:
    """Read the points around the keypoints [px of the image] of people, each with at least one."""
    grid_xy = grid_positions(people.xy, image_size, (points.width, points.height))
    keypoints, uv = people.keypoints, grid_xy
    if people.skeleton.joints != COCO_18.joints:
        keypoints = keypoints_in(keypoints, people.skeleton, COCO_18)
        uv = grid_positions(keypoints[..., :2], image_size, (points.width, points.height))
    known = np.isfinite(uv).all(axis=2)
    scores = np.where(known, keypoints[..., 2].astype(np.float64), 0.0)
    places = _with_guesses(uv, known)
    rays = camera.rays(places.reshape(-1, 2)).reshape(*known.shape, 3)
    finite = np.isfinite(rays).all(axis=2)
    if not finite.all():  # where the lens can not be inverted there is no ray
        known = known & finite
        rays = np.where(finite[..., None], rays, [0.0, 0.0, 1.0])
    scores, uv = np.where(known, scores, 0.0), np.where(known[..., None], uv, np.nan)
    focal = camera.focal_in((points.width, points.height))
    adult_depth = surfaces.size_depth(rays, scores, method)
    windows = method.windows
    least, most = windows.limits
    radius = np.minimum(np.maximum(windows.half_side * focal / adult_depth, least), most)
    samples = surfaces.window_depths(points, uv, radius, windows)
    none = np.zeros(known.shape)
    observed = ObservedPeople(people, image_size, grid_xy, uv, scores, known, rays, samples,
                              np.zeros(samples.shape, bool), adult_depth, none, none, none > 0, focal)
    detached = detached_samples(points, observed, method)
    return replace(observed, detached=detached,
                   trunk_evidence=method.compiled.root_evidence(samples, scores, detached))


def grid_positions(xy: np.ndarray, image_size: Tuple[int, int], grid_size: Tuple[int, int]) -> np.ndarray:
    """Return where (..., 2) positions in the image [px] lie on another grid of the same view, float64 [px]."""
    scale = np.asarray(grid_size, np.float64) / np.asarray(image_size)
    return (np.asarray(xy, np.float64) + 0.5) * scale - 0.5


def _sources() -> np.ndarray:
    """Return where the position of each joint comes from, the best first, (18, 5); see `_with_guesses`."""
    middle, origin = len(COCO_18.joints), len(COCO_18.joints) + 1
    chains = [[joint, origin] for joint in range(len(COCO_18.joints))]
    for pair, others in ((SHOULDERS, [NECK]), (HIPS, [])):
        for one, other in (pair, pair[::-1]):
            chains[one] = [one, other, *others, middle]
    for joint, parent in (*zip(MIDDLES, ROOTS), *zip(ENDS, MIDDLES)):
        chains[joint] = [joint, *chains[parent]]
    return np.array([chain + chain[-1:] * (6 - len(chain)) for chain in chains])


# The last but one row of positions is the middle of the person, the last one is 0: the head's rays are not used.
_SOURCES = _sources()


def _with_guesses(uv: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the positions with missing ones put where the next joint towards the trunk is, (P, 18, 2) [px]."""
    if known.all():
        return uv
    people, joints = known.shape
    count = np.maximum(known.sum(axis=1), 1)[:, None]
    places = np.zeros((people, joints + 2, 2))
    places[:, :joints] = np.where(known[..., None], uv, 0.0)
    places[:, joints] = places[:, :joints].sum(axis=1) / count
    there = np.ones((people, joints + 2), bool)
    there[:, :joints] = known
    source = _SOURCES[np.arange(joints), there[:, _SOURCES].argmax(axis=2)]
    result = places[np.arange(people)[:, None], source]
    result[:, NECK] = np.where(known[:, NECK, None], uv[:, NECK], result[:, SHOULDERS].mean(axis=1))
    return result
