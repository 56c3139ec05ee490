"""Pinhole cameras in the room."""
from typing import NamedTuple

import numpy as np


class Intrinsics(NamedTuple):
    """Image size and pinhole model [px]."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def halved(self) -> 'Intrinsics':
        """Return the same view with half the pixels per axis."""
        return Intrinsics(self.width // 2, self.height // 2, self.fx / 2, self.fy / 2, (self.cx + 0.5) / 2 - 0.5,
                          (self.cy + 0.5) / 2 - 0.5)


class Camera:
    """A camera at (x, y, height) [m]; pitch [deg] down, yaw [deg] to its left, 0 looks along +y."""

    def __init__(self, intrinsics: Intrinsics, height: float, pitch: float, x: float = 0.0, y: float = 0.0,
                 yaw: float = 0.0) -> None:
        self.intrinsics, self.height, self.pitch = intrinsics, height, pitch
        sine, cosine = np.sin(np.deg2rad(pitch)), np.cos(np.deg2rad(pitch))
        tilt = np.array([[1, 0, 0], [0, -sine, -cosine], [0, cosine, -sine]])
        sine, cosine = np.sin(np.deg2rad(-yaw)), np.cos(np.deg2rad(-yaw))
        self.rotation = tilt @ np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])  # world to camera
        self.origin = np.array([x, y, height], float)

    def to_camera(self, points: np.ndarray) -> np.ndarray:
        """Return (..., 3) world points in the optical frame [m]."""
        return (points - self.origin) @ self.rotation.T

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the (..., 2) pixels of points in the optical frame."""
        model, depth = self.intrinsics, np.maximum(points[..., 2], 1e-3)
        return np.stack([points[..., 0] / depth * model.fx + model.cx, points[..., 1] / depth * model.fy + model.cy],
                        -1)

    def rays(self, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Return (N, 3) float32 world directions of pixels with a depth of 1: a ray's length is the depth it hits."""
        model = self.intrinsics
        directions = np.stack([(columns - model.cx) / model.fx, (rows - model.cy) / model.fy,
                               np.ones(np.shape(columns))], -1).reshape(-1, 3)
        return (directions @ self.rotation).astype(np.float32)

    def pose(self) -> np.ndarray:
        """Return the (4, 4) transform camera to world."""
        transform = np.eye(4)
        transform[:3, :3], transform[:3, 3] = self.rotation.T, self.origin
        return transform
