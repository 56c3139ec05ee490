"""Kalman filters with constant velocity for many points at once: position and velocity, each with full covariance.

The state of a point is (x, v), its covariance [[P_xx, P_xv], [P_xv^T, P_vv]]; between frames it is driven by white
acceleration a: Q = a^2 [[dt^4/4, dt^3/2], [dt^3/2, dt^2]] per axis (Bar-Shalom, Li and Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, section 6.3.2). A filter with constant velocity does not lag behind
steady motion.
"""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.constants import COMPILED

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
        """Return filters of points.

        Args:
            position: (T, K, 3) [m].
            velocity: (T, K, 3) [m/s].
            covariance: (T, K, 3, 3) of the position [m^2].
            speed: standard deviation of the velocity per axis [m/s].
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
        cross, speed = self.cross_covariance, self.velocity_covariance
        return JointFilter(
            self.position + elapsed * self.velocity, self.velocity,
            self.position_covariance + elapsed * (cross + np.swapaxes(cross, -1, -2)) + elapsed ** 2 * speed
            + elapsed ** 4 / 4 * noise,
            cross + elapsed * speed + elapsed ** 3 / 2 * noise, speed + elapsed ** 2 * noise)

    def corrected(self, measured: np.ndarray, covariance: np.ndarray, mask: np.ndarray) -> 'JointFilter':
        """Return the filters with measurements taken in; compiled (joint_filter.cpp).

        Args:
            measured: (T, K, 3) [m]; anything where the mask is false.
            covariance: (T, K, 3, 3) of the measurements [m^2].
            mask: (T, K) bool, which points were measured.
        """
        return JointFilter(*COMPILED.correct(tuple(self), measured, covariance, mask))

    def transformed(self, rotation: np.ndarray, translation: np.ndarray) -> 'JointFilter':
        """Return the filters in another frame: x' = R x + t."""
        return JointFilter(self.position @ rotation.T + translation, self.velocity @ rotation.T,
                           *(rotation @ covariance @ rotation.T for covariance in self[2:]))

    def sigmas(self) -> np.ndarray:
        """Return the root mean square error of each position, (T, K) [m]."""
        return np.sqrt(np.maximum(np.trace(self.position_covariance, axis1=2, axis2=3), 0.0))


def along_rays(rays: np.ndarray, across: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return covariances of points whose error along their ray differs from that across it, (..., 3, 3) [m^2].

    Args:
        rays: (..., 3) of any length.
        across, along: (...) standard deviations [m].
    """
    across_square = across * across
    more = (along * along - across_square) / (rays * rays).sum(axis=-1)
    return (across_square[..., None, None] * _IDENTITY
            + more[..., None, None] * (rays[..., :, None] * rays[..., None, :]))


def isotropic(sigma: np.ndarray) -> np.ndarray:
    """Return covariances of points with the root mean square error sigma, (..., 3, 3) [m^2]."""
    return (sigma ** 2 / 3)[..., None, None] * _IDENTITY
