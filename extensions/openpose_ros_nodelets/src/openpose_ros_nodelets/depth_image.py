"""The depth image of an organized cloud."""
from typing import Any

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.plausibility import summarize
from skeleton_extract_3d.points.point_grid import PointGrid


def depth_pixels(points: PointGrid, encoding: str) -> np.ndarray:
    """Return the depth of a cloud, (H, W), in an encoding of REP 118.

    16UC1: uint16 [mm], 0 where it is missing or more than 65.535 m; 32FC1: float32 [m], NaN where it is missing.

    Raises:
        BadInputError: the cloud has no depth, or not in metres.
    """
    doubt = summarize(points).doubt
    if doubt is not None:
        raise BadInputError(f'{doubt.event}: {doubt.text}')
    depth: Any = points.patch(np.zeros(2, int), np.array([points.width, points.height]), 1)
    with np.errstate(invalid='ignore'):
        if encoding == '32FC1':
            depth[~((depth > 0) & (depth < np.inf))] = np.nan
            return depth
        depth *= 1000
        depth += 0.5
        depth[~((depth >= 1) & (depth < 65536))] = 0
    return depth.astype(np.uint16)
