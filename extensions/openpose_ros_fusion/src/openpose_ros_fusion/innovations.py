"""What cameras measure of people at a time beside what was expected, which tells how far fused joints err.

See skeleton_extract_3d.track.joint_filter. All cameras make one innovation together: the sum of L_i (z_i - x) with the
information L_i of each, also of rays.
"""
import numpy as np

from openpose_ros_fusion.estimate import Measurements, mean_variances
from skeleton_extract_3d.track.joint_filter import averaged_innovations, error_variances, mean_innovations


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
        measured: (F, K) variances of what was measured, mean over the axes [m^2]; inf: not all axes were.
    """

    def __init__(self, people: int, measured: Measurements, trust: np.ndarray, expected: np.ndarray,
                 before: np.ndarray, known: np.ndarray) -> None:
        of_person = (measured.owner == np.arange(people)[:, np.newaxis]).astype(np.float64)
        trust = trust[..., np.newaxis, np.newaxis]
        information = np.tensordot(of_person, trust * measured.information, 1)
        noise = np.tensordot(of_person, trust ** 2 * measured.information, 1)
        offsets = measured.points - expected[measured.owner]
        surprise = np.tensordot(of_person, np.einsum('mkij,mkj->mki', trust * measured.information, offsets), 1)
        independent = np.trace(noise, axis1=2, axis2=3) + before * (information ** 2).sum(axis=(2, 3))
        used = known & (independent > 0)
        self._before, self.measured, self._some = before, mean_variances(information), used.any(axis=1)
        self._share = mean_innovations((surprise ** 2).sum(axis=2), independent, used)

    def averaged(self, shares: np.ndarray, elapsed: np.ndarray) -> np.ndarray:
        """Return the mean squares of the innovations of people, (F,), as shares, averaged over time.

        Args:
            shares: (F,) before this frame.
            elapsed: (F,) since then [s].
        """
        return averaged_innovations(shares, self._share, np.where(self._some, elapsed, 0.0))

    def variances(self, shares: np.ndarray, gains: np.ndarray, expected: np.ndarray, filtered: np.ndarray
                  ) -> np.ndarray:
        """Return the variances of the estimates, (F, K), mean over the axes [m^2].

        Args:
            shares: (F,) as `averaged` gives them.
            gains: (F, K) by how much an estimate moves with what is measured [0..1].
            expected: (F, K) variances of what was expected, by the motion model [m^2].
            filtered: (F, K) the result where cameras tell a joint along some axes only, or not at all [m^2].
        """
        known = np.isfinite(self.measured)
        measured = np.where(known, self.measured, 0.0)
        return np.where(known, error_variances(shares, gains, self._before, measured, expected), filtered)
