"""Which person of a camera is which fused person."""
from typing import Mapping, Tuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from openpose_ros_fusion.constants import FUSION, AssociationConstants
from openpose_ros_fusion.observations import Sighting
from skeleton_extract_3d.people import MEASURED

# More than any distance [m].
_FAR = 1e6
# Share of the joints whose rays have to meet.
_MOST_JOINTS = 0.75
# A person of a camera: its name and the id there.
CameraPerson = Tuple[str, int]


def associate(sighting: Sighting, joints: np.ndarray, ids: np.ndarray, gates: np.ndarray,
              known: Mapping[CameraPerson, int], constants: AssociationConstants = FUSION.association) -> np.ndarray:
    """Return the row of each person's fused person, (P,) int; -1: none of them.

    Args:
        joints: (F, 18, 3) [m], where the fused people are expected at the time of the sighting.
        ids: (F,) of the fused people.
        gates: (F,) greatest median distance [m].
        known: ids of fused people by persons of cameras, as they were associated before.
    """
    rows = np.full(len(sighting), -1)
    if not len(sighting) or not len(joints):
        return rows
    was = ids == np.array([known.get((sighting.camera, number), -1) for number in sighting.ids.tolist()])[:, np.newaxis]
    # a person who was known before is recognized by any joint
    distances = median_distances(sighting, joints, constants.least_joints, np.where(was, 1, constants.least_joints))
    cost = np.where(was, constants.known_share, 1.0) * distances
    cost[distances > gates] = _FAR
    for person, row in zip(*linear_sum_assignment(cost)):
        if cost[person, row] < _FAR:
            rows[person] = row
    return rows


def median_distances(sighting: Sighting, joints: np.ndarray, least: int, common: np.ndarray) -> np.ndarray:
    """Return the median distance of people, or of their rays, from fused ones, (P, F) [m]; far where they share little.

    Measured joints count, or all, where fewer than `least` were measured.

    Args:
        joints: (F, 18, 3) [m].
        common: (P, F) joints that two must share.
    """
    distances = sighting.distances(joints)
    found = np.isfinite(distances)
    measured = found & (sighting.status == MEASURED)[:, np.newaxis]
    use = np.where((measured.sum(axis=2) >= least)[..., np.newaxis], measured, found)
    count = use.sum(axis=2)
    ordered = np.sort(np.where(use, distances, _FAR), axis=2)
    people, fused = np.ogrid[:len(sighting), :len(joints)]
    medians = (ordered[people, fused, np.maximum(count - 1, 0) // 2] + ordered[people, fused, count // 2]) / 2
    return np.where(count >= common, medians, _FAR)


def pair_rays(first: Sighting, second: Sighting, constants: AssociationConstants = FUSION.association
              ) -> Tuple[np.ndarray, np.ndarray]:
    """Return which people of two cameras' rays meet in space, indices (N,) and (N,); each once."""
    cost = ray_distances(first, second, constants)
    rows, columns = linear_sum_assignment(cost)
    near = cost[rows, columns] <= constants.ray_gate
    return rows[near], columns[near]


def ray_distances(first: Sighting, second: Sighting, constants: AssociationConstants = FUSION.association
                  ) -> np.ndarray:
    """Return how far the rays of two cameras' people pass by each other, (P, Q) [m]; far where they can not meet.

    It is the distance within which those of three of four joints meet: joints that are as high as the cameras meet
    those of other people too.
    """
    gaps, in_front = ray_gaps(first.origin, first.directions[:, np.newaxis], second.origin, second.directions)
    common = np.isfinite(gaps).sum(axis=2)
    usable = np.isfinite(gaps) & in_front
    count = usable.sum(axis=2)
    ordered = np.sort(np.where(usable, gaps, _FAR), axis=2)
    last = np.maximum(np.ceil(_MOST_JOINTS * count).astype(int) - 1, 0)[..., np.newaxis]
    meet = (count >= constants.least_joints) & (count >= _MOST_JOINTS * common)
    return np.where(meet, np.take_along_axis(ordered, last, axis=2)[..., 0], _FAR)


def ray_gaps(origin: np.ndarray, rays: np.ndarray, other: np.ndarray, others: np.ndarray
             ) -> Tuple[np.ndarray, np.ndarray]:
    """Return how near rays come to each other, (..., K) [m], and whether that is before both cameras, (..., K) bool.

    Args:
        origin, other: (3,) [m], where the rays begin.
        rays, others: (..., K, 3), unit vectors; NaN where missing.
    """
    base = other - origin
    cosine = (rays * others).sum(axis=-1)
    along, along_other = rays @ base, others @ base
    with np.errstate(invalid='ignore', divide='ignore'):
        scale = 1.0 - cosine ** 2
        depth = (along - cosine * along_other) / scale
        depth_other = (cosine * along - along_other) / scale
        gap = np.linalg.norm(depth[..., np.newaxis] * rays - base - depth_other[..., np.newaxis] * others, axis=-1)
        return np.where(scale > 1e-4, gap, np.nan), (depth > 0) & (depth_other > 0)
