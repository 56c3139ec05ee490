"""Occluders of keypoints: other people, the scenery, or another part of the same body."""
from typing import Optional

import numpy as np

from skeleton_extract_3d.body.body import ENDS, MIDDLES, SIDES
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.constants import OccluderConstants
from skeleton_extract_3d.lift.records import ObservedPeople, Ownership

_OUTER, _OUTER_SIDES = np.concatenate([MIDDLES, ENDS]), np.concatenate([SIDES, SIDES])


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


def ownership(observed: ObservedPeople, root: np.ndarray, left: np.ndarray, foreign: Optional[np.ndarray],
              method: MethodConstants = METHOD) -> Ownership:
    """Return which body the samples belong to, by depths of trunks (P,) [m] and directions to the left (P, 3), zero
    where unknown.
    """
    constants = method.occluders
    covered = method.compiled.covered_by_self(observed.uv, root, observed.focal)
    away = left[:, 2] / np.maximum(np.sqrt((left * left).sum(axis=1)), 1e-6)
    far = np.zeros(covered.shape, bool)  # joints of limbs on the far side of the body
    far[:, _OUTER] = _OUTER_SIDES * away[:, None] > constants.turned_away
    return Ownership(np.where(covered & far, constants.covered, 1.0), covered, foreign)
