"""Move joints towards the lengths of bones, each as far as it is uncertain.

A length is one more measurement of both ends of its bone (a Kalman update), bone after bone from the trunk outwards.
"""
import numpy as np

from skeleton_extract_3d.constants import METHOD, MethodConstants


def satisfy_lengths(xyz: np.ndarray, covariance: np.ndarray, lengths: np.ndarray, spreads: np.ndarray,
                    usable: np.ndarray, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the joints with bones nearer to their lengths, (P, 18, 3) [m].

    Args:
        xyz: (P, 18, 3) [m].
        covariance: (P, 18, 3, 3) [m^2].
        lengths: (P, 8) [m], in the order of `body.BONES`.
        spreads: (P, 8) standard deviations of the lengths, as shares.
        usable: (P, 18) bool, joints that take part.
    """
    return method.compiled.satisfy_lengths(xyz, covariance, lengths, spreads, usable)
