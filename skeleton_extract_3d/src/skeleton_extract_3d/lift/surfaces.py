"""Depth evidence: surfaces in windows around the keypoints, and the likelihood of depths given them.

A window holds the surface of a visible joint, a surface in front of a hidden one, or one behind where the keypoint lies
beside the body; see docs/method.md, sections 2 and 3.
"""
from typing import Tuple

import numpy as np

from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.constants import CostConstants, WindowConstants
from skeleton_extract_3d.lift.records import Expectation
from skeleton_extract_3d.points.point_grid import PointGrid

# Bones that look shorter than this on the plane z = 1 have no size.
_LEAST_LENGTH = 1e-4


def window_depths(points: PointGrid, uv: np.ndarray, radius: np.ndarray, windows: WindowConstants = METHOD.windows
                  ) -> np.ndarray:
    """Return the depths of the surfaces around keypoints, (P, K, 25) float64 [m], NaN where missing.

    Args:
        uv: (P, K, 2) [px of the grid], NaN where unknown.
        radius: (P,) half the side of the windows [px].
    """
    known = np.where(np.isfinite(uv), uv, -1e6)
    pixels = np.rint(known[..., None] + windows.offsets * radius[:, None, None, None]).astype(np.int64)
    u, v = pixels[:, :, 0], pixels[:, :, 1]
    # columns and rows apart, so that the 25 samples are only read
    columns, rows = (u >= 0) & (u < points.width), (v >= 0) & (v < points.height)
    if columns.all() and rows.all():
        depth = points.depths(u[..., None, :], v[..., None])
    else:
        depth = points.depths(np.where(columns, u, 0)[..., None, :], np.where(rows, v, 0)[..., None])
        depth[~(columns[..., None, :] & rows[..., None])] = np.nan
    return depth.reshape(*uv.shape[:2], len(windows.weights))


def depths_at(points: PointGrid, uv: np.ndarray) -> np.ndarray:
    """Return z at the pixels in which (..., 2) positions lie, (...) float64 [m]; NaN where missing or outside."""
    pixels = np.rint(uv).astype(np.int64)
    u, v = pixels[..., 0], pixels[..., 1]
    inside = (u >= 0) & (u < points.width) & (v >= 0) & (v < points.height)
    if inside.all():
        return points.depths(u, v)
    depth = points.depths(np.where(inside, u, 0), np.where(inside, v, 0))
    return np.where(inside, depth, np.nan)


def lower_median(values: np.ndarray) -> np.ndarray:
    """Return the lower median of the finite ones of (..., N) values, (...); NaN where there is none."""
    ordered = np.sort(np.where(np.isfinite(values), values, np.nan), axis=-1)  # NaN last
    middle = (np.isfinite(ordered).sum(axis=-1, keepdims=True) - 1) // 2
    return np.take_along_axis(ordered, middle, axis=-1)[..., 0]


def size_depth(rays: np.ndarray, scores: np.ndarray, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the depth at which an adult would look as large as each person, (P,) [m]; infinite where unknown.

    It is the second least limit that a bone gives: no bone looks longer than it is, but a keypoint may be wrong.

    Args:
        rays: (P, 18, 3) with z = 1.
        scores: (P, 18) of the keypoints, 0 where there is none.
    """
    start, end = method.body.sized_pairs.T
    along = rays.take(start, axis=1) - rays.take(end, axis=1)
    lengths = np.sqrt(np.einsum('pbi,pbi->pb', along, along))
    sure = scores > method.sizes.least_score
    usable = sure.take(start, axis=1) & sure.take(end, axis=1) & (lengths > _LEAST_LENGTH)
    depths = np.sort(np.where(usable, method.body.sized_lengths / np.where(usable, lengths, 1.0), np.inf), axis=1)
    return np.where(usable.sum(axis=1) >= method.sizes.least_bones, depths[:, 1], depths[:, 0])


def size_evidence(size: np.ndarray, spread: np.ndarray, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the log likelihood of the trunk's depths given the size in the image, (..., depths).

    Args:
        size: (...) depth at which the person would look as large [m]; not finite: unknown.
        spread: (...) standard deviation of the person's size, as a share.
    """
    trunk, known = method.trunk, np.isfinite(size)
    off = np.log(trunk.depths) - np.log(np.where(known, size, 1.0))[..., None]
    # nearer than it looks, a person may be turned or bent; further, the size itself is another one
    weight = np.sqrt(0.5) * known
    further, nearer = weight / spread, weight / (trunk.foreshortening + spread)
    off *= np.where(off > 0, further[..., None], nearer[..., None])
    return np.maximum(-off * off, -method.costs.limit)


def with_memory(costs: np.ndarray, root: np.ndarray, expected: Expectation, constants: CostConstants = METHOD.costs
                ) -> np.ndarray:
    """Return costs of depths `root + CostConstants.deltas` plus those of the distance from the expected depths; `root`:
    (P,) of the trunk [m].
    """
    known = np.isfinite(expected.depth)
    if not known.any():
        return costs
    off = np.where(known, root[:, None] - expected.depth, 0.0)[..., None] + constants.deltas
    off *= (known / expected.depth_sigma)[..., None]
    return costs + np.minimum(off * off, constants.limit).astype(np.float32)


def foreground(samples: np.ndarray) -> np.ndarray:
    """Return the depth of the nearest surface of each window, the lower quartile, (P, K) [m]; NaN without any."""
    ordered = np.sort(samples, axis=2)  # missing ones come last
    quarter = np.isfinite(samples).sum(axis=2) // 4
    return np.take_along_axis(ordered, quarter[..., None], axis=2)[..., 0]


def mean_within(off: np.ndarray, usable: np.ndarray, reach: float, weights: np.ndarray = METHOD.windows.weights
                ) -> Tuple[np.ndarray, np.ndarray]:
    """Return the weighted mean of usable distances (P, J, 25) [m] within a reach, (P,) [m], and their weight, (P,)."""
    fits = (np.abs(off) < reach) & usable
    total = (fits @ weights).sum(axis=1)
    return (np.where(fits, off, 0.0) @ weights).sum(axis=1) / np.maximum(total, 1e-9), total
