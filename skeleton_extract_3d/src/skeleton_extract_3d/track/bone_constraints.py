"""Bring joints to where the lengths of bones agree, each as far as it is uncertain.

A length is taken as one more measurement of its two ends (a Kalman update with the length as what is measured), bone
after bone from the trunk outwards.
"""
from typing import Tuple

import numpy as np

from skeleton_extract_3d import compiled
from skeleton_extract_3d.body.body import BONES, ENDS, HIPS, MIDDLES, ROOTS, SHOULDERS

# How far the length of a person's bone changes, by clothes and by where annotators see joints (share).
_CHANGE = 0.03
# More violated bones have a keypoint elsewhere, which a length does not mend (share).
_MOST_VIOLATION = 0.4
_UPPER = [BONES.index(name) for name in ('upper_arm', 'upper_arm', 'thigh', 'thigh')]
_LOWER = [BONES.index(name) for name in ('forearm', 'forearm', 'shin', 'shin')]
_PAIRS = [BONES.index(name) for name in ('shoulders', 'hips')]
# Bones in the order in which they are satisfied: starts, ends, kinds.
_ROUNDS: Tuple[Tuple[np.ndarray, np.ndarray, list], ...] = (
    (np.array([SHOULDERS[0], HIPS[0]]), np.array([SHOULDERS[1], HIPS[1]]), _PAIRS), (ROOTS, MIDDLES, _UPPER),
    (MIDDLES, ENDS, _LOWER), (ROOTS, MIDDLES, _UPPER))
# The same one by one: start, end, kind, (14, 3).
_BONES = np.concatenate([np.stack(bones, axis=1) for bones in _ROUNDS])


def satisfy_lengths(xyz: np.ndarray, covariance: np.ndarray, lengths: np.ndarray, spreads: np.ndarray,
                    usable: np.ndarray) -> np.ndarray:
    """Return the joints with bones nearer to their lengths, (P, 18, 3) [m].

    Args:
        xyz: (P, 18, 3) [m].
        covariance: (P, 18, 3, 3) [m^2].
        lengths: (P, 8) [m], in the order of `body.BONES`.
        spreads: (P, 8) how well they are known, as shares.
        usable: (P, 18) joints that take part.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.satisfy_lengths(xyz, covariance, lengths, spreads, usable, bones=_BONES, change=_CHANGE,
                                    most_violation=_MOST_VIOLATION)
    xyz = xyz.copy()
    for starts, ends, kinds in _ROUNDS:
        length = lengths[:, kinds]
        along = xyz[:, ends] - xyz[:, starts]
        distance = np.maximum(np.sqrt((along * along).sum(axis=2)), 1e-6)
        excess = distance - length
        usable_bones = usable[:, starts] & usable[:, ends] & (np.abs(excess) < _MOST_VIOLATION * length)
        unit = (along / distance[..., None])[..., None]
        start_pull = (covariance[:, starts] @ unit)[..., 0]
        end_pull = (covariance[:, ends] @ unit)[..., 0]
        variance = ((start_pull + end_pull) * unit[..., 0]).sum(axis=2)
        uncertainty = (np.maximum(_CHANGE, spreads[:, kinds]) * length) ** 2
        share = np.where(usable_bones, excess / (variance + uncertainty), 0.0)[..., None]
        xyz[:, starts] += share * start_pull
        xyz[:, ends] -= share * end_pull
    return xyz
