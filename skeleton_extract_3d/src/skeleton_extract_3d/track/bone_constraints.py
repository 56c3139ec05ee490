"""Bring joints to where the lengths of bones agree, each as far as it is uncertain.

A length is taken as one more measurement of its two ends (a Kalman update with the length as what is measured), bone
after bone from the trunk outwards.
"""
import numpy as np
import skeleton_extract_3d_lifting as compiled

from skeleton_extract_3d.body.body import BONES, ENDS, HIPS, MIDDLES, ROOTS, SHOULDERS
from skeleton_extract_3d.track.constants import BoneConstraintConstants

_UPPER = [BONES.index(name) for name in ('upper_arm', 'upper_arm', 'thigh', 'thigh')]
_LOWER = [BONES.index(name) for name in ('forearm', 'forearm', 'shin', 'shin')]
_PAIRS = [BONES.index(name) for name in ('shoulders', 'hips')]
# Bones in the order in which they are satisfied: start, end, kind, (14, 3).
_BONES = np.concatenate([np.stack(bones, axis=1) for bones in (
    (np.array([SHOULDERS[0], HIPS[0]]), np.array([SHOULDERS[1], HIPS[1]]), _PAIRS), (ROOTS, MIDDLES, _UPPER),
    (MIDDLES, ENDS, _LOWER), (ROOTS, MIDDLES, _UPPER))])


def satisfy_lengths(xyz: np.ndarray, covariance: np.ndarray, lengths: np.ndarray, spreads: np.ndarray,
                    usable: np.ndarray, constants: BoneConstraintConstants) -> np.ndarray:
    """Return the joints with bones nearer to their lengths, (P, 18, 3) [m].

    Args:
        xyz: (P, 18, 3) [m].
        covariance: (P, 18, 3, 3) [m^2].
        lengths: (P, 8) [m], in the order of `body.BONES`.
        spreads: (P, 8) standard deviations of the lengths, as shares.
        usable: (P, 18) bool, joints that take part.
    """
    return compiled.satisfy_lengths(xyz, covariance, lengths, spreads, usable, bones=_BONES,
                                    change=constants.change, most_violation=constants.most_violation)
