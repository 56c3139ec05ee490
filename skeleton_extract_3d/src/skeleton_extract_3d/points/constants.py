"""Constants of how points are read."""
from dataclasses import dataclass
from typing import Tuple

from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class CameraFitConstants:
    """How the camera of an organized cloud is found."""

    grid: Tuple[int, int] = constant((32, 18), 'Columns and rows of the points that the camera is fitted to.',
                                     unit='points', source='chosen')
    least_points: int = constant(12, 'At least this many of them must be valid.', unit='points', source='chosen')
    tolerance: float = constant(3.0, 'Greatest median distance of the points from their pixels.', unit='px',
                                source='chosen')
    least_square: float = constant(1e-12, 'Slopes x / z whose sum of squares is less fit no camera.', source='chosen')
