"""The direction of a head, by the mesh of its face.

The network gives the mesh in orthographic projection along the line of sight to the face. Three axes are taken from
points of both sides and of top and bottom, and turned with the line of sight.
"""
from typing import Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.constants import LandmarkConstants
from skeleton_extract_3d.lift.observation import grid_positions
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.points.transform import quaternions

# Points of the mesh on the person's left and on the right that mirror each other: corners of eyes and mouth, jaw.
_LEFT, _RIGHT = np.array([263, 362, 291, 454, 389, 397]), np.array([33, 133, 61, 234, 162, 172])
# Corners of the eyes, corners of the mouth.
_EYES, _MOUTH = np.array([33, 133, 263, 362]), np.array([61, 291])


def orientations(mesh: np.ndarray, image_size: Tuple[int, int], points: PointGrid, camera: CameraModel,
                 constants: LandmarkConstants = METHOD.landmarks) -> Tuple[np.ndarray, np.ndarray]:
    """Return the orientations of heads, (F, 4) quaternions, and their errors, (F,) [rad]; see `Faces3D`.

    Args:
        mesh: (F, 468, 3) [px of an image of a width and height].
    """
    mesh = mesh.astype(np.float64)
    left = _unit((mesh[:, _LEFT] - mesh[:, _RIGHT]).mean(axis=1))
    up = mesh[:, _EYES].mean(axis=1) - mesh[:, _MOUTH].mean(axis=1)
    up = _unit(up - (up * left).sum(axis=1, keepdims=True) * left)
    axes = np.stack([np.cross(left, up), left, up], axis=2)
    middle = grid_positions(mesh[..., :2].mean(axis=1), image_size, (points.width, points.height))
    axes = _turned(axes, camera.rays(middle))
    return quaternions(axes).astype(np.float32), np.full(len(mesh), constants.face_angle_sigma, np.float32)


def _turned(axes: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Turn axes (F, 3, 3) as the optical axis is turned onto rays (F, 3)."""
    rays = _unit(np.where(np.isfinite(rays), rays, [0.0, 0.0, 1.0]))
    around = np.cross([0.0, 0.0, 1.0], rays)
    sine = np.linalg.norm(around, axis=1, keepdims=True)
    turn = np.arctan2(sine, rays[:, 2:])
    rotation = Rotation.from_rotvec(around * np.where(sine > 1e-9, turn / np.maximum(sine, 1e-9), 0.0))
    return np.stack([rotation.apply(axes[:, :, axis]) for axis in range(3)], axis=2)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
