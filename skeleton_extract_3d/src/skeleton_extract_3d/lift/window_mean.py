"""The original's way of lifting: each joint at the mean of the points around its pixel."""
from typing import Tuple

import numpy as np

from openpose_ros_pkg.people import People2D
from skeleton_extract_3d.people import MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import check_same_aspect
from skeleton_extract_3d.points.point_grid import PointGrid


def lift_by_window(people: People2D, image_size: Tuple[int, int], points: PointGrid, window: int = 3,
                   statistic: str = 'mean') -> People3D:
    """Return the people in the frame of the points, which are of the same view at any resolution.

    A joint is MEASURED where its window of `window` x `window` px holds a valid point; sigma is not estimated.

    Raises:
        BadInputError: image and points differ in aspect ratio.
    """
    check_same_aspect('image', image_size, 'cloud', (points.width, points.height))
    # integers are pixel centres, so pixel 0 reaches from -0.5 to 0.5
    corner = (np.asarray(people.xy, np.float64) + 0.5) * np.divide((points.width, points.height), image_size)
    pixels = np.floor(np.where(np.isfinite(corner), corner, -1)).astype(np.int64)
    u, v = pixels[..., 0], pixels[..., 1]
    seen = people.present & (u >= 0) & (u < points.width) & (v >= 0) & (v < points.height)
    xyz = np.full((*people.xy.shape[:2], 3), np.nan)
    around = points.window(u[seen], v[seen], window)
    found = np.isfinite(around[..., 2]).any(axis=1)
    seen[seen] = found
    xyz[seen] = np.nanmedian(around[found], axis=1) if statistic == 'median' else np.nanmean(around[found], axis=1)
    return People3D(people.skeleton, xyz, people.confidence, np.where(seen, MEASURED, MISSING),
                    np.full(seen.shape, np.nan), people.ids, existence=people.existence)
