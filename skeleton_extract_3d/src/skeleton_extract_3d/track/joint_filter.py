"""Kalman filters with constant velocity for many points at once: position and velocity, each with full covariance.

The state of a point is (x, v), its covariance [[P_xx, P_xv], [P_xv^T, P_vv]]; between frames it is driven by white
acceleration a: Q = a^2 [[dt^4/4, dt^3/2], [dt^3/2, dt^2]] per axis (Bar-Shalom, Li and Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, section 6.3.2). A filter with constant velocity does not lag behind
steady motion.
"""
from typing import Iterable, Tuple

import numpy as np

from skeleton_extract_3d import compiled

# A measurement this many standard deviations off counts as a little less certain, and so on: jumps are taken over
# within frames, but a single wild measurement does not throw the joint.
_TRUSTED_DEVIATIONS = 4.0
_IDENTITY = np.eye(3)


class JointFilter:
    """The filters of T tracks with K points each.

    Args:
        points: K.

    Attributes:
        position, velocity: (T, K, 3) [m], [m/s].
        position_covariance, cross_covariance, velocity_covariance: (T, K, 3, 3).
    """

    _STATE = ('position', 'velocity', 'position_covariance', 'cross_covariance', 'velocity_covariance')

    def __init__(self, points: int) -> None:
        self.position = np.zeros((0, points, 3))
        self.velocity = np.zeros((0, points, 3))
        self.position_covariance = np.zeros((0, points, 3, 3))
        self.cross_covariance = np.zeros((0, points, 3, 3))
        self.velocity_covariance = np.zeros((0, points, 3, 3))

    def _state(self) -> Tuple[np.ndarray, ...]:
        return tuple(getattr(self, name) for name in self._STATE)

    def _set(self, state: Iterable[np.ndarray]) -> None:
        for name, value in zip(self._STATE, state):
            setattr(self, name, value)

    def keep(self, tracks: np.ndarray) -> None:
        """Forget all tracks but those of a mask or list of rows."""
        self._set(value[tracks] for value in self._state())

    def append(self, position: np.ndarray, sigma: float, speed: float) -> None:
        """Begin (N, K, 3) points at rest [m], known up to sigma [m] and speed [m/s]."""
        shape = position.shape[:2]
        new = (position, np.zeros_like(position), np.broadcast_to(sigma ** 2 * _IDENTITY, (*shape, 3, 3)),
               np.zeros((*shape, 3, 3)), np.broadcast_to(speed ** 2 * _IDENTITY, (*shape, 3, 3)))
        self._set(np.concatenate(both) for both in zip(self._state(), new))

    def predict(self, elapsed: float, acceleration: np.ndarray) -> None:
        """Move on by a time [s], driven by accelerations, (K,) [m/s^2] (standard deviation per axis)."""
        twin = compiled.load()[0]
        if twin is not None:
            self._set(twin.predict(self._state(), elapsed, acceleration))
            return
        noise = (acceleration ** 2)[:, None, None] * _IDENTITY
        cross, speed = self.cross_covariance, self.velocity_covariance
        self.position = self.position + elapsed * self.velocity
        self.position_covariance = (self.position_covariance + elapsed * (cross + np.swapaxes(cross, -1, -2))
                                    + elapsed ** 2 * speed + elapsed ** 4 / 4 * noise)
        self.cross_covariance = cross + elapsed * speed + elapsed ** 3 / 2 * noise
        self.velocity_covariance = speed + elapsed ** 2 * noise

    def correct(self, rows: np.ndarray, measured: np.ndarray, covariance: np.ndarray, mask: np.ndarray) -> None:
        """Take measurements in.

        Args:
            rows: (N,) tracks.
            measured: (N, K, 3) [m]; anything where the mask is false.
            covariance: (N, K, 3, 3) of the measurements [m^2].
            mask: (N, K) which points were measured.
        """
        twin = compiled.load()[0]
        if twin is not None:
            self._set(twin.correct(self._state(), rows, measured, covariance, mask,
                                   trusted_deviations=_TRUSTED_DEVIATIONS))
            return
        where, points = np.nonzero(mask)
        if not len(where):
            return
        tracks = rows[where]
        prior, cross = self.position_covariance[tracks, points], self.cross_covariance[tracks, points]
        noise = covariance[where, points]
        innovation = (measured[where, points] - self.position[tracks, points])[..., None]
        inverse = np.linalg.inv(prior + noise)
        off = (np.swapaxes(innovation, 1, 2) @ inverse @ innovation)[:, 0, 0]
        wild = off > _TRUSTED_DEVIATIONS ** 2
        if wild.any():
            scale = np.where(wild, off / _TRUSTED_DEVIATIONS ** 2, 1.0)[:, None, None]
            inverse = np.linalg.inv(prior + scale * noise)
        gain, speed_gain = prior @ inverse, np.swapaxes(cross, 1, 2) @ inverse
        self.position[tracks, points] += (gain @ innovation)[..., 0]
        self.velocity[tracks, points] += (speed_gain @ innovation)[..., 0]
        self.velocity_covariance[tracks, points] = _symmetric(self.velocity_covariance[tracks, points]
                                                              - speed_gain @ cross)
        self.position_covariance[tracks, points] = _symmetric(prior - gain @ prior)
        self.cross_covariance[tracks, points] = cross - gain @ cross

    def place(self, tracks: np.ndarray, points: np.ndarray, position: np.ndarray, velocity: np.ndarray,
              covariance: np.ndarray, speed: float) -> None:
        """Set points anew.

        Args:
            tracks, points: (N,) which.
            position, velocity: (N, 3) [m], [m/s].
            covariance: (N, 3, 3) of the position [m^2].
            speed: standard deviation of the velocity [m/s].
        """
        self.position[tracks, points], self.velocity[tracks, points] = position, velocity
        self.position_covariance[tracks, points] = covariance
        self.cross_covariance[tracks, points] = 0.0
        self.velocity_covariance[tracks, points] = speed ** 2 * _IDENTITY

    def transform(self, rotation: np.ndarray, translation: np.ndarray) -> None:
        """Express all in another frame: x' = R x + t."""
        self.position = self.position @ rotation.T + translation
        self.velocity = self.velocity @ rotation.T
        for name in ('position_covariance', 'cross_covariance', 'velocity_covariance'):
            setattr(self, name, rotation @ getattr(self, name) @ rotation.T)

    def sigmas(self) -> np.ndarray:
        """Return the root mean square error of each position, (T, K) [m]."""
        return np.sqrt(np.maximum(np.trace(self.position_covariance, axis1=2, axis2=3), 0.0))


def _symmetric(matrices: np.ndarray) -> np.ndarray:
    """Return symmetric matrices: without, what rounding leaves would grow from frame to frame."""
    return (matrices + np.swapaxes(matrices, -1, -2)) / 2


def along_rays(rays: np.ndarray, across: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return covariances of points that are known better across their ray than along it, (..., 3, 3) [m^2].

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
