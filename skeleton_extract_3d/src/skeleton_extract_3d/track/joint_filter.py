"""Kalman filters with constant velocity for many points at once: position and velocity, each with full covariance.

The state of a point is (x, v), its covariance [[P_xx, P_xv], [P_xv^T, P_vv]]; between frames it is driven by white
acceleration a: Q = a^2 [[dt^4/4, dt^3/2], [dt^3/2, dt^2]] per axis (Bar-Shalom, Li and Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, section 6.3.2). A filter with constant velocity does not lag behind
steady motion.

**Errors of estimates** repeat from frame to frame for an unknown time, which innovations z - x tell, see
docs/method.md#sigma. With their mean square s, the variance p_0 after the frame before, the covariance c of the
errors of x and z, and the share u = s / (p_0 + r):

    u >= 1    no error repeats: c = 0; joints moved otherwise than expected since: p = s - r, but not more than the
              motion model says
    u < 1     errors repeat: p = p_0, c = (1 - u) (p_0 + r) / 2, but not more than (p_0 r)^0.5

As motion adds to innovations, which are estimated from few values, 1 - u counts as 1 up to `repeated`.

`drifted` is the prediction of the covariances; it holds for matrices and for variances per axis alike.
"""
from typing import NamedTuple, Sequence, Tuple, Union

import numpy as np

from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.track.constants import CorrectionConstants

_IDENTITY = np.eye(3)


class JointFilter(NamedTuple):
    """The filters of T tracks with K points each; a value, every method returns a new one.

    Attributes:
        position: (T, K, 3) float64 [m].
        velocity: (T, K, 3) float64 [m/s].
        position_covariance: (T, K, 3, 3) float64 [m^2].
        cross_covariance: (T, K, 3, 3) float64 [m^2/s], of position and velocity.
        velocity_covariance: (T, K, 3, 3) float64 [m^2/s^2].
    """

    position: np.ndarray
    velocity: np.ndarray
    position_covariance: np.ndarray
    cross_covariance: np.ndarray
    velocity_covariance: np.ndarray

    @classmethod
    def moving(cls, position: np.ndarray, velocity: np.ndarray, covariance: np.ndarray, speed: float) -> 'JointFilter':
        """Return filters of points with positions [m], velocities [m/s], covariances of the positions [m^2], and the
        standard deviation of the velocity per axis [m/s].
        """
        return cls(position, velocity, covariance, np.zeros(covariance.shape),
                   np.broadcast_to(speed ** 2 * _IDENTITY, covariance.shape))

    @classmethod
    def at_rest(cls, position: np.ndarray, sigma: float, speed: float) -> 'JointFilter':
        """Return filters of (T, K, 3) points at rest [m]; standard deviations per axis: sigma [m], speed [m/s]."""
        covariance = np.broadcast_to(sigma ** 2 * _IDENTITY, (*position.shape, 3))
        return cls.moving(position, np.zeros(position.shape), covariance, speed)

    def where(self, chosen: np.ndarray, others: 'JointFilter') -> 'JointFilter':
        """Return the others where (T, K) points are chosen, and these elsewhere."""
        return JointFilter(*(np.where(chosen.reshape(*chosen.shape, *(1,) * (value.ndim - 2)), other, value)
                             for value, other in zip(self, others)))

    def predicted(self, elapsed: float, acceleration: np.ndarray) -> 'JointFilter':
        """Return the filters after a time [s], driven by accelerations, (K,) [m/s^2], standard deviation per axis."""
        noise = (acceleration ** 2)[:, None, None] * _IDENTITY
        cross = self.cross_covariance
        return JointFilter(self.position + elapsed * self.velocity, self.velocity,
                           *drifted(self[2:], np.swapaxes(cross, -1, -2), elapsed, noise))

    def corrected(self, measured: np.ndarray, covariance: np.ndarray, mask: np.ndarray,
                  method: MethodConstants = METHOD) -> 'JointFilter':
        """Return the filters with measurements (T, K, 3) [m] of points of a mask (T, K); compiled (joint_filter.cpp).

        Args:
            covariance: (T, K, 3, 3) of the measurements [m^2].
        """
        return JointFilter(*method.compiled.correct(tuple(self), measured, covariance, mask))

    def transformed(self, rotation: np.ndarray, translation: np.ndarray) -> 'JointFilter':
        """Return the filters in another frame: x' = R x + t."""
        return JointFilter(self.position @ rotation.T + translation, self.velocity @ rotation.T,
                           *(rotation @ covariance @ rotation.T for covariance in self[2:]))

    def sigmas(self) -> np.ndarray:
        """Return the root mean square error of each position, (T, K) [m]."""
        return np.sqrt(np.maximum(mean_squares(self.position_covariance), 0.0))


def drifted(covariances: Sequence[np.ndarray], transposed: np.ndarray, elapsed: float,
            noise: Union[float, np.ndarray]) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the covariances of points after a time: of position, of position and velocity, and of velocity.

    Args:
        covariances: the three before, P_xx, P_xv and P_vv: (..., 3, 3), or variances per axis (...).
        transposed: P_xv^T; of variances per axis P_xv itself.
        elapsed: [s].
        noise: a^2, of the same kind [m^2/s^4].
    """
    place, cross, speed = covariances
    return (place + elapsed * (cross + transposed) + elapsed ** 2 * speed + elapsed ** 4 / 4 * noise,
            cross + elapsed * speed + elapsed ** 3 / 2 * noise, speed + elapsed ** 2 * noise)


def along_rays(rays: np.ndarray, across: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return covariances (..., 3, 3) [m^2] of points on rays (..., 3) of any length.

    Args:
        across, along: (...) standard deviations across and along the ray [m].
    """
    across_square = across * across
    more = (along * along - across_square) / (rays * rays).sum(axis=-1)
    return (across_square[..., None, None] * _IDENTITY
            + more[..., None, None] * (rays[..., :, None] * rays[..., None, :]))


def mean_squares(covariance: np.ndarray) -> np.ndarray:
    """Return the mean square errors of points, all axes together, (...) [m^2], by covariances (..., 3, 3)."""
    return covariance[..., 0, 0] + covariance[..., 1, 1] + covariance[..., 2, 2]


def isotropic(sigma: np.ndarray) -> np.ndarray:
    """Return covariances of points with the root mean square error sigma, (..., 3, 3) [m^2]."""
    return (sigma ** 2 / 3)[..., None, None] * _IDENTITY


def mean_innovations(squares: np.ndarray, independent: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Return the mean squares of innovations as shares of that of independent errors, (N,); 0 where no joint is used.

    Args:
        squares, independent: (N, K) of a frame, and their mean with independent errors [m^2].
        used: (N, K) bool.
    """
    shares = np.where(used, squares / np.where(used, independent, 1.0), 0.0)
    return shares.sum(axis=1) / np.maximum(used.sum(axis=1), 1)


def averaged_innovations(shares: np.ndarray, new: np.ndarray, elapsed: np.ndarray,
                         constants: CorrectionConstants = METHOD.track.correction) -> np.ndarray:
    """Return shares (N,) averaged with those of a frame over the time in between (N,) [s], (N,)."""
    weight = 1 - np.exp(-elapsed / constants.memory)
    return shares + weight * (new - shares)


def error_variances(shares: np.ndarray, gains: np.ndarray, before: np.ndarray, measured: np.ndarray,
                    expected: np.ndarray, constants: CorrectionConstants = METHOD.track.correction) -> np.ndarray:
    """Return the variances of estimates, (N, K) [m^2].

    Args:
        shares: (N,) as `averaged_innovations` gives them, u.
        gains: (N, K) k.
        before, measured, expected: (N, K) variances after the frame before, p_0, of what was measured, r, and of what
            was expected by the motion model.
    """
    share, independent = shares[:, np.newaxis], before + measured
    place = np.minimum(before + np.maximum(share - 1, 0.0) * independent, np.maximum(expected, before))
    part = np.minimum(np.maximum((1 - share) / (1 - constants.repeated), 0.0), 1.0)
    repeated = np.minimum(part * independent / 2, np.sqrt(before * measured))
    return (1 - gains) ** 2 * place + gains ** 2 * measured + 2 * gains * (1 - gains) * repeated
