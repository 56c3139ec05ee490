"""Constants of how points are read."""
from dataclasses import dataclass
from typing import Tuple

from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class CameraFitConstants:
    """How the camera of an organized cloud is found."""

    grid: Tuple[int, int] = constant(
        (32, 18), 'Columns and rows of the points that the camera is fitted to, and that are judged.', unit='points',
        source='chosen')
    least_points: int = constant(12, 'At least this many of them must be valid.', unit='points', source='chosen')
    tolerance: float = constant(3.0, 'Greatest median distance of the points from their pixels.', unit='px',
                                source='chosen')


@dataclass(frozen=True)
class PlausibilityConstants:
    """Faults of points: no depth of the view, or not that of the image."""

    least_valid: int = constant(3, 'With fewer valid ones of these there is no depth.', unit='points', source='chosen')
    depths: Tuple[float, float] = constant(
        (0.05, 60.0), 'Limits of the median depth: beyond, the unit is not the metre. A view in millimetres is 200 m '
                      'deep or more, and some drivers write 65535 mm where nothing was measured.', unit='m',
        source='chosen')
    changed: float = constant(0.02, 'The image has changed if this share of its pixels has.', source='chosen')
    changed_by: int = constant(30, 'A pixel has changed if its green has by more; noise does less.', unit='grey levels',
                               source='chosen')
    still_frames: int = constant(5, 'Depth stands still if it is the same to the bit in so many frames in a row that '
                                    'have another image.', unit='frames', source='chosen')
    sizes: Tuple[float, float] = constant(
        (0.57, 1.6), 'Limits of the depth at the trunk over that at which an adult would look as large: without '
                     'faults it is 0.80 to 1.39, of small children from 0.55 on.', unit='share')
    sightings: int = constant(30, 'The last people who are judged together: colour and depth do not belong together if '
                                  'most of them do not fit the depth at their joints. Without faults up to 3 % do not, '
                                  'of depth elsewhere 40 to 100 %.', unit='people', source='chosen')
