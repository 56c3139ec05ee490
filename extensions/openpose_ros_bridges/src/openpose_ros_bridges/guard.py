"""What a camera sees: a pyramid in space, outside of which people may be that no message tells of."""
from dataclasses import dataclass

import numpy as np

from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import Transform

# Pixels along each side of an image, whose rays bend where its lens does.
_SAMPLES = 33


@dataclass(frozen=True)
class View:
    """What a camera sees."""

    planes: np.ndarray  # (4, 3) unit vectors inwards from its sides, which meet in the camera, in its optical frame
    pose: Transform  # from the optical frame to that of the people

    @classmethod
    def of(cls, camera: CameraModel, pose: Transform) -> 'View':
        """Return what a camera sees of the image: the upright pyramid within all rays of its border."""
        columns, rows = (np.linspace(-0.5, size - 0.5, _SAMPLES) for size in (camera.width, camera.height))
        left, right = (camera.rays(np.stack([np.full(_SAMPLES, u), rows], axis=1))[:, 0] for u in columns[[0, -1]])
        top, bottom = (camera.rays(np.stack([columns, np.full(_SAMPLES, v)], axis=1))[:, 1] for v in rows[[0, -1]])
        planes = np.array([[1.0, 0.0, -np.nanmax(left)], [-1.0, 0.0, np.nanmin(right)],
                           [0.0, 1.0, -np.nanmax(top)], [0.0, -1.0, np.nanmin(bottom)]])
        return cls(planes / np.linalg.norm(planes, axis=1, keepdims=True), pose)

    def depths_inside(self, points: np.ndarray, reach: float) -> np.ndarray:
        """Return how far points (N, 3) [m] are inside what is seen up to a depth [m], (N,) [m]."""
        rotation, translation = self.pose
        own = (points - translation) @ rotation
        return np.asarray(np.minimum((own @ self.planes.T).min(axis=1), reach - own[:, 2]))

    def hidden_distances(self, points: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
        """Return how far points (N, 3) are at least from what spheres (M, 3) of radii (M,) hide, all [m]; (N,) [m].

        A sphere hides a cone from its middle on. Negative: hidden; inf: there is no sphere.
        """
        rotation, translation = self.pose
        own, spheres = (points - translation) @ rotation, (centres - translation) @ rotation
        away = np.maximum(np.linalg.norm(spheres, axis=1), 1e-9)
        half = np.arcsin(np.minimum(radii / away, 1.0))
        along = own @ (spheres / away[:, np.newaxis]).T
        across = np.sqrt(np.maximum((own ** 2).sum(axis=1)[:, np.newaxis] - along ** 2, 0.0))
        aside = across * np.cos(half) - along * np.sin(half)
        return np.asarray(np.maximum(aside, away - along).min(axis=1, initial=np.inf))
