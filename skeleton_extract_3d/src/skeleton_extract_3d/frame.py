"""What comes in with the people of an image."""
from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

import numpy as np

from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.points.transform import Transform


@dataclass(frozen=True)
class CameraFrame:
    """What a camera gives at one time, beside the people in its image.

    Attributes:
        image_size: width and height of the image [px].
        points: cloud or depth image of the view.
        stamp: [s].
        bgr: (H, W, 3) uint8, the image, for the colours of the clothes; None: people are told apart without.
        tracking_from_points: from the frame of the points to one in which the room stands still, in every frame; None:
            the camera does not move.
        camera: frame_id of the points, which names the camera.
        floor: (4,) the floor in the frame of the points: normal up, of unit length, and height of the camera [m]; None:
            it is not known.
    """

    image_size: Tuple[int, int]
    points: PointGrid
    stamp: float
    bgr: Optional[np.ndarray] = None
    tracking_from_points: Optional[Transform] = None
    camera: str = ''
    floor: Optional[np.ndarray] = None


class View(NamedTuple):
    """Where and when a frame was taken.

    Attributes:
        points: cloud or depth image.
        camera: of the points.
        stamp: [s].
        elapsed: time since the frame before [s], 0 in the first one.
        floor: as in `CameraFrame`.
    """

    points: PointGrid
    camera: CameraModel
    stamp: float
    elapsed: float
    floor: Optional[np.ndarray] = None
