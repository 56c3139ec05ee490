"""Bring joints to where the lengths of bones agree, each as far as it is uncertain.

A length is taken as one more measurement of its two ends (a Kalman update with the length as what is measured), bone
after bone from the trunk outwards.
"""
import numpy as np

from skeleton_extract_3d.constants import COMPILED


def satisfy_lengths(xyz: np.ndarray, covariance: np.ndarray, lengths: np.ndarray, spreads: np.ndarray,
                    usable: np.ndarray) -> np.ndarray:
    """Return the joints with bones nearer to their lengths, (P, 18, 3) [m].

    Args:
        xyz: (P, 18, 3) [m].
        covariance: (P, 18, 3, 3) [m^2].
        lengths: (P, 8) [m], in the order of `body.BONES`.
        spreads: (P, 8) standard deviations of the lengths, as shares.
        usable: (P, 18) bool, joints that take part.
    """
    return COMPILED.satisfy_lengths(xyz, covariance, lengths, spreads, usable)
