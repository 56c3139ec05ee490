"""Occluders of keypoints: other people, the scenery, or another part of the same body."""
from typing import Optional, Tuple

import numpy as np

from skeleton_extract_3d.body.body import ENDS, JOINTS, MIDDLES, SIDES
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.constants import OccluderConstants
from skeleton_extract_3d.lift.records import ObservedPeople, Ownership
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
    surface = samples[person, joint] + constants.skin
    # few of the others are at one pixel, and infinite depths come last
    there = np.sort(others[person, joint], axis=1)[:, :count.max()]
    gap = np.abs(surface[..., None] - there[:, None]).min(axis=2)
    own = np.broadcast_to(expected, samples.shape[:2])[person, joint]
    lies_there = (gap < constants.others_reach) & (gap + constants.others_lead < np.abs(surface - own[:, None]))
    if not lies_there.any():
        return None
    foreign = np.zeros(samples.shape, bool)
    foreign[person, joint] = lies_there
    return foreign


def ownership(points: PointGrid, observed: ObservedPeople, root: np.ndarray, left: np.ndarray,
              foreign: Optional[np.ndarray], method: MethodConstants = METHOD) -> Ownership:
    """Return which body the samples belong to, by depths of trunks (P,) [m] and directions to the left (P, 3), zero
    where unknown.
    """
    constants = method.occluders
    covered = method.compiled.covered_by_self(observed.uv, root, observed.focal)
    own = likely_own(points, observed, root, covered, method)
    own = np.where(covered & _on_far_side(left, constants.turned_away), own * constants.covered, own)
    return Ownership(own, covered, foreign)


def likely_own(points: PointGrid, observed: ObservedPeople, root: np.ndarray, covered: np.ndarray,
               method: MethodConstants = METHOD) -> np.ndarray:
    """Return the likelihood that the surface at each keypoint belongs to the joint's limb, (P, 18) of 0..1.

    A surface before the body that goes on to both sides is furniture; an arm before the trunk stands out from it.
    """
    constants, likely = method.occluders, np.ones(observed.known.shape)
    ones = np.ones(observed.samples.shape[2])
    count = np.isfinite(observed.samples) @ ones
    # the median is in front where half of the samples are
    in_front = (observed.samples < (root - method.trunk.reach)[:, None, None]) @ ones
    in_front = (2 * in_front >= count) & (in_front > 0)
    on_trunk = covered & _ARMS & (count > 0)
    person, joint = np.nonzero(in_front | on_trunk)
    if not len(person):
        return likely
    surface = lower_median(observed.samples[person, joint])
    beside = depths_at(points, _beside(observed, (person, joint), surface, constants)) - surface
    goes_on = (np.abs(beside[:, 1:]) < constants.continues).any(axis=1).all(axis=0)
    flat = (beside[:, 0] < constants.stands_out).all(axis=0)
    likely[person, joint] = np.where(goes_on & in_front[person, joint], constants.furniture,
                                     np.where(flat & on_trunk[person, joint], constants.covered, 1.0))
    return likely


def _beside(observed: ObservedPeople, where: Tuple[np.ndarray, np.ndarray], surface: np.ndarray,
            constants: OccluderConstants) -> np.ndarray:
    """Return pixels beside limbs at joints (N,) of persons (N,) with depths (N,) [m]: (2 sides, 3 distances, N, 2)."""
    person, joint = where
    here = observed.uv[person, joint]
    along = observed.uv[person, _LIMB_TO[joint]] - here
    length = np.sqrt((along * along).sum(axis=1))[:, None]
    # a limb that points at the camera, or whose other end is unknown, is taken to hang down
    along = np.where(length > 0, along / np.maximum(length, 1e-6), [0.0, 1.0])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) * (observed.focal / surface)[:, None]
    reach = np.array([[-1.0], [1.0]]) * np.array([constants.just_beside, *constants.beyond])
    return here + reach[..., None, None] * across


def _on_far_side(left: np.ndarray, turned_away: float) -> np.ndarray:
    """Return which joints of limbs are on the far side of the body, (P, 18) bool; `left`: (P, 3), zero where unknown.
    """
    away = left[:, 2] / np.maximum(np.sqrt((left * left).sum(axis=1)), 1e-6)
    far = np.zeros((len(left), len(JOINTS)), bool)
    far[:, _OUTER] = _OUTER_SIDES * away[:, None] > turned_away
    return far
