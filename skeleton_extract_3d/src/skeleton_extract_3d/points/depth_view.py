"""Depth on a coarse grid, for the detection of people in the image."""
from typing import Optional

import numpy as np

from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.plausibility import summarize
from skeleton_extract_3d.points.point_grid import PointGrid

# Greatest width and height of the grid [px], on which a forearm at 5 m is 4 cells broad; it is read within 2 ms.
_MOST_SIDE = 480


def depth_view(points: PointGrid) -> Optional[DepthView]:
    """Return the depth of points on a grid; None where they are no depth of a camera, in metres."""
    try:
        camera = points.camera_model()
    except BadInputError:
        return None  # lifting by window needs no camera
    if camera is None or summarize(points).doubt is not None:
        return None
    step = -(-max(points.width, points.height) // _MOST_SIDE)
    columns, rows = (((np.arange(size // step) + 0.5) * size / (size // step)).astype(np.int64)
                     for size in (points.width, points.height))
    depth = points.depths_on(columns, rows).astype(np.float32)
    return DepthView(depth, float(camera.matrix[0, 0]) * len(columns) / points.width)
