"""What the points say of a person's depth: surfaces in windows around the keypoints, and how well a depth explains
them.

A joint lies a little under the skin. If it is seen, its window holds a surface at the joint's depth less its offset; if
it is hidden, a surface in front of that; a surface behind means that the keypoint lies beside the body. So a window
gives a likelihood for each depth that the joint may have, and a person's windows together one for the depth of the
trunk.
"""
from typing import Optional, Tuple

import numpy as np

from skeleton_extract_3d.constants import COMPILED, METHOD
from skeleton_extract_3d.lift.records import Expectation, ObservedPeople, Ownership
from skeleton_extract_3d.points.point_grid import PointGrid

_WINDOWS, _TRUNK, _COSTS = METHOD.windows, METHOD.trunk, METHOD.costs
# Places of the rows and columns of samples in a window [half sides], and the weights of all, (25,), with sum 1.
_OFFSETS, WEIGHTS = _WINDOWS.offsets, _WINDOWS.weights
# Candidate depths of the trunk, and depths of a joint's candidates from that of the trunk [m].
ROOT_DEPTHS, DELTAS = _TRUNK.depths, _COSTS.deltas
_LOG_ROOT_DEPTHS = np.log(ROOT_DEPTHS)
_SIZED_PAIRS, _SIZED_LENGTHS = METHOD.body.sized_pairs.T, METHOD.body.sized_lengths
# Bones that look shorter than this on the plane z = 1 have no size.
_LEAST_LENGTH = 1e-4


def window_depths(points: PointGrid, uv: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Read the surfaces around keypoints.

    Args:
        uv: (P, K, 2) [px of the grid], NaN where unknown.
        radius: (P,) half the side of the windows [px].

    Returns:
        (P, K, 25) float64 [m], NaN where missing.
    """
    known = np.where(np.isfinite(uv), uv, -1e6)
    pixels = np.rint(known[..., None] + _OFFSETS * radius[:, None, None, None]).astype(np.int64)
    u, v = pixels[:, :, 0], pixels[:, :, 1]
    # columns and rows apart, so that the 25 samples are only read
    columns, rows = (u >= 0) & (u < points.width), (v >= 0) & (v < points.height)
    if columns.all() and rows.all():
        depth = points.depths(u[..., None, :], v[..., None])
    else:
        depth = points.depths(np.where(columns, u, 0)[..., None, :], np.where(rows, v, 0)[..., None])
        depth[~(columns[..., None, :] & rows[..., None])] = np.nan
    return depth.reshape(*uv.shape[:2], len(WEIGHTS))


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
    ordered = np.sort(values.reshape(-1, values.shape[-1]), axis=1)  # infinite and missing ones come last
    count = np.isfinite(ordered).sum(axis=1)
    median = ordered[np.arange(len(ordered)), np.maximum(count - 1, 0) // 2]
    median[count == 0] = np.nan
    return median.reshape(values.shape[:-1])


def size_depth(rays: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """Return at which depth an adult would look as large as each person does, (P,) [m]; infinite where unknown.

    No bone looks longer than it is, so the greatest depth that any bone allows is the person's; the second is taken,
    for one keypoint may be elsewhere.

    Args:
        rays: (P, 18, 3) with z = 1.
        scores: (P, 18) of the keypoints, 0 where there is none: such a ray is not used.
    """
    start, end = _SIZED_PAIRS
    along = rays.take(start, axis=1) - rays.take(end, axis=1)
    lengths = np.sqrt(np.einsum('pbi,pbi->pb', along, along))
    sure = scores > _TRUNK.sized_score
    usable = sure.take(start, axis=1) & sure.take(end, axis=1) & (lengths > _LEAST_LENGTH)
    depths = np.sort(np.where(usable, _SIZED_LENGTHS / np.where(usable, lengths, 1.0), np.inf), axis=1)
    return np.where(usable.sum(axis=1) >= _TRUNK.sized_bones, depths[:, 1] * _TRUNK.size_bias, depths[:, 0])


def size_evidence(size: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Return the log likelihood of the depths in `ROOT_DEPTHS` of people, by their size in the image.

    Args:
        size: (...) depth at which they would look as large [m]; not finite: nothing is known.
        spread: (...) standard deviation of the person's size, as a share.

    Returns:
        (..., depths).
    """
    known = np.isfinite(size)
    off = _LOG_ROOT_DEPTHS - np.log(np.where(known, size, 1.0))[..., None]
    # nearer than it looks, a person may be turned or bent; further, the size itself is another one
    weight = np.sqrt(0.5 * _TRUNK.size_weight) * known
    further, nearer = weight / spread, weight / (_TRUNK.foreshortening + spread)
    off *= np.where(off > 0, further[..., None], nearer[..., None])
    return np.maximum(-off * off, _TRUNK.size_limit)


def root_evidence(samples: np.ndarray, scores: np.ndarray, foreign: Optional[np.ndarray] = None) -> np.ndarray:
    """Return the log likelihood of the depths in `ROOT_DEPTHS` of each person's trunk, by the surfaces alone.

    Compiled (surfaces.cpp). For each joint and depth: log(near + front + behind + floor) of the weights of the samples
    on a body at that depth, in front of it and behind it, summed over the joints.

    Args:
        samples: (P, 18, 25) [m].
        scores: (P, 18) of the keypoints.
        foreign: (P, 18, 25) samples that are somebody else's; None: none are.

    Returns:
        (P, depths).
    """
    return COMPILED.root_evidence(samples, scores, foreign)


def depth_costs(seen: ObservedPeople, root: np.ndarray, offsets: np.ndarray, gaps: np.ndarray, ownership: Ownership
                ) -> np.ndarray:
    """Return what it costs each joint to be at each depth: -2 log likelihood, the least of each joint being 0.

    Compiled (surfaces.cpp). Joints without a keypoint or without samples cost nothing anywhere.

    Args:
        root: (P,) depth of the trunk [m]; candidates are `root + DELTAS`.
        offsets: (P, 18) depth of the joint under the surface [m].
        gaps: (P, 18) how much further in front than that a surface must be to hide it [m].

    Returns:
        (P, 18, 45) float32.
    """
    return COMPILED.depth_costs(seen.samples, seen.scores, root, offsets, gaps, *ownership)


def with_memory(costs: np.ndarray, root: np.ndarray, expected: Expectation) -> np.ndarray:
    """Return costs with those of being elsewhere than before.

    Args:
        costs: (P, 18, 45) float32, of `depth_costs`.
        root: (P,) depth of the trunk [m].
    """
    known = np.isfinite(expected.depth)
    if not known.any():
        return costs
    off = np.where(known, root[:, None] - expected.depth, 0.0)[..., None] + DELTAS
    off *= (known / expected.depth_sigma)[..., None]
    return costs + np.minimum(off * off, _COSTS.memory_limit).astype(np.float32)


@np.errstate(invalid='ignore')
def foreground(samples: np.ndarray) -> np.ndarray:
    """Return the nearest surface in each window that more than a few stray samples show, (P, K) [m]; NaN without any.

    Args:
        samples: (P, K, 25) [m].
    """
    ordered = np.sort(samples, axis=2)  # missing ones come last
    count = np.isfinite(samples).sum(axis=2)
    first = np.take_along_axis(ordered, (count // _WINDOWS.foreground_share)[..., None], axis=2)
    near = np.abs(samples - first) < _WINDOWS.foreground_depth
    total = near.sum(axis=2)
    return np.where(total > 0, np.where(near, samples, 0.0).sum(axis=2) / np.maximum(total, 1), np.nan)


def mean_within(seen: ObservedPeople, foreign: Optional[np.ndarray], joints: np.ndarray, offsets: np.ndarray,
                middle: np.ndarray, reach: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return the mean of all the samples that say that people are near a depth, (P,) [m], and their weight, (P,).

    Args:
        foreign: (P, 18, 25) samples that are somebody else's; None: none are.
        joints: (J,) whose samples.
        offsets: (P, J) or (J,) what to add to these [m].
        middle: (P,) the depth [m].
        reach: how far from it samples count [m].
    """
    off = seen.samples[:, joints] + (offsets - middle[:, None])[..., None]
    fits = (np.abs(off) < reach) & seen.known[:, joints, None]
    if foreign is not None:
        fits &= ~foreign[:, joints]
    total = (fits @ WEIGHTS).sum(axis=1)
    moment = (np.where(fits, off, 0.0) @ WEIGHTS).sum(axis=1)
    return middle + moment / np.maximum(total, 1e-9), total
