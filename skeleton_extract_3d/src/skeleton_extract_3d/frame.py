"""What a camera gives at one time."""
from dataclasses import dataclass
from typing import Any, Hashable, NamedTuple, Optional, Tuple, TypeVar

import numpy as np

from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import NoDepth
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.points.transform import Transform

Value = TypeVar('Value')


@dataclass(frozen=True, eq=False)
class Frame:
    """What one camera gives at one time.

    Attributes:
        camera: names the camera, as the frame_id of its points does: people are tracked for each camera alone.
        stamp: of the points, or of the image where there are none [s]; 0 or less: the frame has no history.
        bgr: (H, W, 3) uint8, the image; None: people are told apart without the colours of their clothes.
        points: organized cloud or depth image of the same view; `NoDepth`: people are placed in space by the image and
            its camera alone; None: no joint has a place in space.
        tracking_from_points: from the frame of the points to one in which the room stands still, in every frame; None:
            the camera does not move.
        floor: (4,) plane of the floor in the frame of the points: unit normal that points up, and height of the camera
            [m]; None: not known.
        source: what the image was made from, which a detection elsewhere may need; no step reads it.
        image_stamp: of the image, where it is not that of the points [s].
        size: width and height of the image [px] where `bgr` is None.
    """

    camera: Hashable
    stamp: float
    bgr: Optional[np.ndarray]
    points: Optional[PointGrid] = None
    tracking_from_points: Optional[Transform] = None
    floor: Optional[np.ndarray] = None
    source: Any = None
    image_stamp: Optional[float] = None
    size: Optional[Tuple[int, int]] = None

    @property
    def image_size(self) -> Tuple[int, int]:
        """Width and height of the image [px]; ValueError where the frame has neither image nor size."""
        return _given(self.size, 'image nor size') if self.bgr is None else (self.bgr.shape[1], self.bgr.shape[0])

    @property
    def image_time(self) -> float:
        """Stamp of the image [s]."""
        return self.stamp if self.image_stamp is None else self.image_stamp

    @property
    def image(self) -> np.ndarray:
        """(H, W, 3) uint8 BGR; ValueError where the frame has none."""
        return _given(self.bgr, 'image')

    @property
    def is_monocular(self) -> bool:
        """Whether people are placed in space by the image and its camera alone."""
        return isinstance(self.points, NoDepth)

    @property
    def grid(self) -> PointGrid:
        """The points; ValueError where the frame has none."""
        return _given(self.points, 'points')


def _given(value: Optional[Value], name: str) -> Value:
    if value is None:
        raise ValueError(f'the frame has no {name}')
    return value


class FrameView(NamedTuple):
    """Where and when a frame was taken: its points, their camera, stamp [s], time since the frame before [s], 0 in the
    first one, and the floor as in `Frame`.
    """

    points: PointGrid
    camera: CameraModel
    stamp: float
    elapsed: float
    floor: Optional[np.ndarray] = None
