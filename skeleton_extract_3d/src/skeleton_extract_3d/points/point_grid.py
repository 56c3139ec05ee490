"""What lifting asks of a cloud or a depth image: a point per pixel."""
from typing import Optional, Protocol

import numpy as np

from skeleton_extract_3d.points.camera import CameraModel


class PointGrid(Protocol):
    """A point per pixel: `OrganizedCloud` or `DepthImage`."""

    @property
    def width(self) -> int:
        """Points per row."""

    @property
    def height(self) -> int:
        """Rows."""

    def window(self, u: np.ndarray, v: np.ndarray, size: int) -> np.ndarray:
        """Return the points of windows around pixels, (M, size * size, 3) [m], NaN where missing."""

    def depths(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return z at pixels inside the grid, the shape of u and v, float [m]; NaN where missing."""

    def camera_model(self) -> Optional[CameraModel]:
        """Return the camera in whose optical frame the points are; None if there are too few points to tell."""

    def valid_range(self) -> np.ndarray:
        """Return least and greatest coordinates, (2, 3) [m]."""
