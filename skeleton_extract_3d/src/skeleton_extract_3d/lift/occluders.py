"""Occluders of keypoints: other people, the scenery, or another part of the same body."""
from typing import Optional, Tuple

import numpy as np

from skeleton_extract_3d.body.body import ENDS, JOINTS, MIDDLES, SIDES
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.constants import OccluderConstants
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.lift.surfaces import depths_at, lower_median
from skeleton_extract_3d.points.point_grid import PointGrid

_ARMS = np.isin(np.arange(len(JOINTS)), [*MIDDLES[:2], *ENDS[:2]])
_OUTER, _OUTER_SIDES = np.concatenate([MIDDLES, ENDS]), np.concatenate([SIDES, SIDES])
# The joint towards which a limb runs from each joint, in the order of COCO_18.
_LIMB_TO = np.array([1, 0, 5, 2, 3, 2, 5, 6, 11, 8, 9, 8, 11, 12, 0, 0, 0, 0])


def foreign_samples(samples: np.ndarray, others: np.ndarray, expected: np.ndarray,
                    constants: OccluderConstants = METHOD.occluders) -> Optional[np.ndarray]:
    """Return which samples lie on other people, (P, 18, 25); None if no sample does.

    Args:
        others: (P, 18, Q) depths of other bodies there [m], infinite where there is none.
        expected: (P, 18) or (P, 1) expected depths of the joints of the person [m].
    """
    count = np.isfinite(others).sum(axis=2)
    person, joint = np.nonzero(count)
    if not len(person):
        return None
    surface = samples[person, joint]
    # few of the others are at one pixel, and infinite depths come last
    there = np.sort(others[person, joint], axis=1)[:, :count.max()]
    gap = np.abs(surface[..., None] - there[:, None]).min(axis=2)
    own = np.broadcast_to(expected, samples.shape[:2])[person, joint]
    lies_there = (gap < constants.others_reach) & (gap < np.abs(surface - own[:, None]))
    if not lies_there.any():
        return None
    foreign = np.zeros(samples.shape, bool)
    foreign[person, joint] = lies_there
    return foreign


def ownership(points: PointGrid, observed: ObservedPeople, root: np.ndarray, left: np.ndarray,
              method: MethodConstants = METHOD) -> Tuple[np.ndarray, np.ndarray]:
    """Return the likelihood that the surface at a keypoint is the person's, (P, 18), and which joints another part of
    the same body may cover, (P, 18) bool; by depths of trunks (P,) [m] and directions to the left (P, 3), zero where
    unknown.
    """
    constants = method.occluders
    covered = method.compiled.covered_by_self(observed.uv, root, observed.focal)
    away = left[:, 2] / np.maximum(np.sqrt((left * left).sum(axis=1)), 1e-6)
    far = np.zeros(covered.shape, bool)  # joints of limbs on the far side of the body
    far[:, _OUTER] = _OUTER_SIDES * away[:, None] > constants.turned_away
    doubted = covered & far | flat_arms(points, observed, covered, constants)
    return np.where(doubted, constants.covered, 1.0), covered


def flat_arms(points: PointGrid, observed: ObservedPeople, covered: np.ndarray,
              constants: OccluderConstants = METHOD.occluders) -> np.ndarray:
    """Return which joints of arms lie on the trunk in the image and do not stand out from it, (P, 18) bool.

    Args:
        covered: (P, 18) bool, joints that another part of the same body may cover.
    """
    flat = np.zeros(covered.shape, bool)
    person, joint = np.nonzero(covered & _ARMS & np.isfinite(observed.samples).any(axis=2))
    if len(person):
        surface, here = lower_median(observed.samples[person, joint]), observed.uv[person, joint]
        along = observed.uv[person, _LIMB_TO[joint]] - here
        length = np.sqrt((along * along).sum(axis=1))[:, None]
        # a limb that points at the camera, or whose other end is unknown, is taken to hang down
        along = np.where(length > 0, along / np.maximum(length, 1e-6), [0.0, 1.0])
        across = np.stack([-along[:, 1], along[:, 0]], axis=1) * (constants.beside * observed.focal / surface)[:, None]
        beside = depths_at(points, here + np.stack([-across, across])) - surface
        flat[person, joint] = (beside < constants.stands_out).all(axis=0)
    return flat
