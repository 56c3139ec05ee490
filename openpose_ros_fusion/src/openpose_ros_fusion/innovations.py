"""How far estimates err, by how far what cameras measure is from what was expected.

Errors of a camera repeat from frame to frame, for a time that nobody knows: a filter that takes them for independent
gets too sure, the more so the more frames it gets; one that expects them to repeat is not sure enough where they do
not. An estimate x + k (z - x) of what was expected, x with the variance p, and what is measured, z with the variance r,
has the variance

    (1 - k)^2 p + k^2 r + 2 k (1 - k) c

with c the covariance of the errors of x and z. The mean square s of the innovations z - x is p + r - 2 c, which tells
the two that are unknown. With p_0, the variance after the frame before:

    s >= p_0 + r    no error repeats: c = 0; joints moved otherwise than expected since: p = s - r, but not more than
                    the motion model says
    s < p_0 + r     errors repeat: p = p_0, c = (p_0 + r - s) / 2, but not more than (p_0 r)^0.5
"""
import numpy as np

from openpose_ros_fusion.constants import FUSION, InnovationConstants
from openpose_ros_fusion.estimate import Measurements, mean_variances


class Innovations:
    """What cameras measure of F people at a time, beside what was expected.

    Args:
        people: F.
        measured: by the cameras.
        trust: (M, K) of the measurements [0..1].
        expected: (F, K, 3) [m].
        before: (F, K) variances after the frame before, mean over the axes [m^2].
        known: (F, K) bool, joints of which something was expected.

    Attributes:
        measured: (F, K) r, mean over the axes [m^2]; inf: not all axes are measured.
    """

    def __init__(self, people: int, measured: Measurements, trust: np.ndarray, expected: np.ndarray,
                 before: np.ndarray, known: np.ndarray) -> None:
        of_person = (measured.owner == np.arange(people)[:, np.newaxis]).astype(np.float64)
        trust = trust[..., np.newaxis, np.newaxis]
        information = np.tensordot(of_person, trust * measured.information, 1)
        noise = np.tensordot(of_person, trust ** 2 * measured.information, 1)
        offsets = measured.points - expected[measured.owner]
        surprise = np.tensordot(of_person, np.einsum('mkij,mkj->mki', trust * measured.information, offsets), 1)
        usual = np.trace(noise, axis1=2, axis2=3) + before * (information ** 2).sum(axis=(2, 3))
        used = known & (usual > 0)
        shares = np.where(used, (surprise ** 2).sum(axis=2) / np.where(used, usual, 1.0), 0.0)
        self._before, self.measured, self._some = before, mean_variances(information), used.any(axis=1)
        self._share = shares.sum(axis=1) / np.maximum(used.sum(axis=1), 1)

    def averaged(self, shares: np.ndarray, elapsed: np.ndarray, constants: InnovationConstants = FUSION.innovation
                 ) -> np.ndarray:
        """Return the mean squares of the innovations of people, (F,), as shares of p_0 + r, averaged over time.

        Args:
            shares: (F,) before this frame.
            elapsed: (F,) since then [s].
        """
        weight = np.where(self._some, 1 - np.exp(-elapsed / constants.memory), 0.0)
        return shares + weight * (np.minimum(self._share, constants.most) - shares)

    def variances(self, shares: np.ndarray, gains: np.ndarray, expected: np.ndarray, filtered: np.ndarray
                  ) -> np.ndarray:
        """Return the variances of the estimates, (F, K), mean over the axes [m^2].

        Args:
            shares: (F,) as `averaged` gives them.
            gains: (F, K) k.
            expected: (F, K) variances of what was expected, by the motion model [m^2].
            filtered: (F, K) the result where cameras tell a joint along some axes only, or not at all [m^2].
        """
        known = np.isfinite(self.measured)
        before, measured = self._before, np.where(known, self.measured, 0.0)
        independent = before + measured
        innovation = shares[:, np.newaxis] * independent
        place = np.minimum(before + np.maximum(innovation - independent, 0.0), expected)
        repeated = np.minimum(np.maximum(independent - innovation, 0.0) / 2, np.sqrt(before * measured))
        result = (1 - gains) ** 2 * place + gains ** 2 * measured + 2 * gains * (1 - gains) * repeated
        return np.where(known, result, filtered)
