"""What the points say of a person's depth: surfaces in windows around the keypoints, and how well a depth explains
them.

A joint lies a little under the skin. If it is seen, its window holds a surface at the joint's depth less its offset; if
it is hidden, a surface in front of that; a surface behind means that the keypoint lies beside the body. So a window
gives a likelihood for each depth that the joint may have, and a person's windows together one for the depth of the
trunk.
"""
from typing import Optional, Tuple

import numpy as np

from skeleton_extract_3d import compiled
from skeleton_extract_3d.body.body import SIZED_LENGTHS, SIZED_PAIRS
from skeleton_extract_3d.points.point_grid import PointGrid

# Half the side of the window around a keypoint [m], about the error of a keypoint; and its limits [px].
WINDOW = 0.045
WINDOW_LIMITS = (1.5, 40.0)
# Points are read on a grid of 5 x 5 that is stretched over the window, so that near people cost no more than far ones.
_OFFSETS = np.array([(dx, dy) for dy in (-1.0, -0.5, 0.0, 0.5, 1.0) for dx in (-1.0, -0.5, 0.0, 0.5, 1.0)])
# They count by a Gaussian of 0.6 half sides.
WEIGHTS = np.exp(-(_OFFSETS ** 2).sum(axis=1) / (2 * 0.6 ** 2))
WEIGHTS /= WEIGHTS.sum()

# Depths [m] that the trunk is looked for at: steps of 4 %.
ROOT_STEP = 0.04
ROOT_DEPTHS = np.exp(np.arange(np.log(0.35), np.log(12.0), ROOT_STEP))
# The body's surfaces are so far in front of and behind the trunk's middle [m]: arms and hips.
_BODY_REACH = (0.40, 0.30)
_BODY_LOW = np.searchsorted(ROOT_DEPTHS, ROOT_DEPTHS - _BODY_REACH[0])
_BODY_HIGH = np.searchsorted(ROOT_DEPTHS, ROOT_DEPTHS + _BODY_REACH[1])
# Likelihood of a surface in front of the body (hidden), behind it (keypoint beside the body), and of anything.
_ROOT_FRONT, _ROOT_BEHIND, _ROOT_FLOOR = 0.12, 0.03, 0.005
# What a joint says of the depth of the trunk, in the order of COCO_18: wrists and the parts of the head say less.
_ROOT_WEIGHTS = np.array([0.7, 1, 1, 0.6, 0.4, 1, 0.6, 0.4, 1, 0.7, 0.6, 1, 0.7, 0.6, 0.3, 0.3, 0.3, 0.3])
# A score from which a keypoint counts fully.
_FULL_SCORE = 0.5
# Weight of the size in the image against the surfaces, and the most that it says: an odd pose is not another depth.
_SIZE_WEIGHT, _SIZE_LIMIT = 4.0, -12.0
# Even the second longest bone may be turned away from the image by so much (share of the depth).
_FORESHORTENING = 0.15
# All this by name.
SIZE_CONSTANTS = {'depths': ROOT_DEPTHS, 'foreshortening': _FORESHORTENING, 'weight': _SIZE_WEIGHT,
                  'limit': _SIZE_LIMIT}
# Keypoints below this score do not measure a size.
_SIZED_SCORE = 0.3
# The longest bone looks a little longer than it is, by the errors of its ends.
_SIZE_BIAS = 0.97

# Depths that a joint may have, from the trunk's depth [m].
STEP = 0.04
STEPS = 45
HALF = STEPS // 2
DELTAS = (np.arange(STEPS) - HALF) * STEP
# Likelihoods of a joint's depth: hidden behind the surface (spread over 0.6 m), under a thick part of the own body, and
# anything (a keypoint that is elsewhere, a hole).
_HIDDEN, _HIDDEN_DEPTH, _UNDER, _ANYTHING = 0.30, 0.6, 0.02, 0.002
# Hidden joints have lower scores: below this, being hidden grows more likely, up to five times.
_HIDDEN_SCORE, _HIDDEN_SLOPE, _HIDDEN_MOST = 0.8, 4.0, 5.0
# Where another part of the same body is in the picture, being hidden behind it is as likely as not.
_HIDDEN_COVERED = 3.3
# A surface is one step thick in either direction, by noise and by what clothes add.
_KERNEL_SHIFTS, _KERNEL_SHARES = (0, 1, -1, 2, -2), (0.40, 0.25, 0.25, 0.05, 0.05)
# A sample supports a joint's depth if it is so near to it [m].
AGREEMENT = 0.09


# The foreground begins at the nearest of so many parts of a window's samples, and is so deep [m].
_FOREGROUND_SHARE, _FOREGROUND_DEPTH = 4, 0.05


def window_depths(points: PointGrid, uv: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Read the surfaces around keypoints.

    Args:
        uv: (P, K, 2) [px of the grid], NaN where unknown.
        radius: (P,) half the side of the windows [px].

    Returns:
        (P, K, 25) float64 [m], NaN where missing.
    """
    at = np.where(np.isfinite(uv), uv, -1e6)[:, :, None] + _OFFSETS * radius[:, None, None, None]
    return depths_at(points, at)


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
    twin = compiled.load()[0]
    if twin is not None:
        return twin.lower_median(values)
    ordered = np.sort(np.where(np.isfinite(values), values, np.nan), axis=-1)  # missing ones come last
    count = np.isfinite(values).sum(axis=-1)
    return np.take_along_axis(ordered, np.maximum(count - 1, 0)[..., None] // 2, axis=-1)[..., 0]


def relative_weights(depth: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the weights of the valid ones of (P, K, 25) samples, with sum 1 per joint, and which joints have any."""
    weights = np.where(np.isfinite(depth), WEIGHTS, 0.0)
    total = weights.sum(axis=2, keepdims=True)
    return weights / np.maximum(total, 1e-9), total[..., 0] > 0


def size_depth(rays: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """Return at which depth an adult would look as large as each person does, (P,) [m]; infinite where unknown.

    No bone looks longer than it is, so the greatest depth that any bone allows is the person's; the second is taken,
    for one keypoint may be elsewhere.

    Args:
        rays: (P, 18, 3) with z = 1, NaN where unknown.
        scores: (P, 18) of the keypoints.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.size_depth(rays, scores, pairs=SIZED_PAIRS, lengths=SIZED_LENGTHS, least_score=_SIZED_SCORE,
                               bias=_SIZE_BIAS)
    lengths = np.linalg.norm(rays[:, SIZED_PAIRS[:, 0]] - rays[:, SIZED_PAIRS[:, 1]], axis=2)
    usable = (scores[:, SIZED_PAIRS] > _SIZED_SCORE).all(axis=2) & (lengths > 1e-4)
    depths = np.sort(np.where(usable, SIZED_LENGTHS / np.where(usable, lengths, 1.0), np.inf), axis=1)
    return np.where(usable.sum(axis=1) >= 3, depths[:, 1] * _SIZE_BIAS, depths[:, 0])


def size_evidence(size: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Return the log likelihood of the depths in `ROOT_DEPTHS` for people who look like being at depths.

    Args:
        size: (...) [m]; not finite: nothing is known.
        spread: (...) standard deviation of the person's size, as a share.

    Returns:
        (..., depths).
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.size_evidence(size, spread, **SIZE_CONSTANTS)
    with np.errstate(divide='ignore', invalid='ignore'):
        t = np.log(ROOT_DEPTHS / size[..., None])
    t = np.where(np.isfinite(t), t, 0.0)
    spread = spread[..., None]
    t = np.where(t > 0, t / spread, t / (_FORESHORTENING + spread))
    return np.maximum(-0.5 * _SIZE_WEIGHT * t * t, _SIZE_LIMIT)


def root_evidence(depth: np.ndarray, scores: np.ndarray, foreign: Optional[np.ndarray] = None) -> np.ndarray:
    """Return the log likelihood of the depths in `ROOT_DEPTHS` of each person's trunk, by the surfaces alone.

    Args:
        depth: (P, 18, 25) samples [m].
        scores: (P, 18) of the keypoints.
        foreign: (P, 18, 25) samples that are somebody else's; None: none are.

    Returns:
        (P, depths).
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.root_evidence(
            depth, scores, foreign, weights=WEIGHTS, joint_weights=_ROOT_WEIGHTS, full_score=_FULL_SCORE,
            nearest=ROOT_DEPTHS[0], step=ROOT_STEP, low=_BODY_LOW, high=_BODY_HIGH, front=_ROOT_FRONT,
            behind=_ROOT_BEHIND, floor=_ROOT_FLOOR)
    weights, have = relative_weights(depth)
    position = (np.log(np.where(np.isfinite(depth), depth, 1.0)) - np.log(ROOT_DEPTHS[0])) / ROOT_STEP
    bins = np.clip(np.rint(position), 0, len(ROOT_DEPTHS) - 1).astype(np.int64)
    total = _cumulated(_histogram(bins, weights, len(ROOT_DEPTHS)))
    own = total if foreign is None else _cumulated(
        _histogram(bins, np.where(foreign, 0.0, weights), len(ROOT_DEPTHS)))
    front, behind = total[..., _BODY_LOW], total[..., -1:] - total[..., _BODY_HIGH]
    near = np.maximum(own[..., _BODY_HIGH] - own[..., _BODY_LOW], 0.0)
    each = np.log(near + _ROOT_FRONT * front + _ROOT_BEHIND * behind + _ROOT_FLOOR)
    joint_weights = have * _ROOT_WEIGHTS * np.minimum(1.0, scores / _FULL_SCORE)
    return (each * joint_weights[..., None]).sum(axis=1)


def depth_costs(depth: np.ndarray, offsets: np.ndarray, gaps: np.ndarray, root: np.ndarray, scores: np.ndarray,
                own: np.ndarray, covered: np.ndarray, foreign: Optional[np.ndarray] = None) -> np.ndarray:
    """Return what it costs each joint to be at each depth: -2 log likelihood, the least of each joint being 0.

    Args:
        depth: (P, K, 25) samples [m].
        offsets: (P, K) depth of the joint under the surface [m].
        gaps: (P, K) how much further in front than that a surface must be to hide it [m].
        root: (P,) depth of the trunk [m]; candidates are `root + DELTAS`.
        scores: (P, K) of the keypoints, 0 where there is none: such a joint costs nothing anywhere.
        own: (P, K) likelihood that the surface belongs to the person at all.
        covered: (P, K) where another part of the body may hide the joint.
        foreign: (P, K, 25) samples that are somebody else's.

    Returns:
        (P, K, 45) float32.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.depth_costs(
            depth, offsets, gaps, root, scores, own, covered, foreign, weights=WEIGHTS, steps=STEPS, half=HALF,
            step=STEP, kernel_shifts=_KERNEL_SHIFTS, kernel_shares=_KERNEL_SHARES, hidden=_HIDDEN,
            hidden_depth=_HIDDEN_DEPTH, under=_UNDER, anything=_ANYTHING, hidden_score=_HIDDEN_SCORE,
            hidden_slope=_HIDDEN_SLOPE, hidden_most=_HIDDEN_MOST, hidden_covered=_HIDDEN_COVERED)
    weights, have = relative_weights(depth)
    position = (np.where(np.isfinite(depth), depth, 0.0) + offsets[..., None] - root[:, None, None]) / STEP + HALF
    # bin 0 holds all that is nearer than the candidates, the last bin all that is further
    bins = np.clip(np.rint(position), -1, STEPS).astype(np.int64) + 1
    histogram = _histogram(bins, weights, STEPS + 2)
    cumulated = _cumulated(histogram)
    surface = histogram if foreign is None else _histogram(bins, np.where(foreign, 0.0, weights), STEPS + 2)
    seen = sum(weight * _shifted(surface, shift) for shift, weight in zip(_KERNEL_SHIFTS, _KERNEL_SHARES))
    shift = np.maximum(1, np.rint(gaps / STEP)).astype(np.int64)
    until = np.arange(STEPS) + 1 - shift[..., None]
    front = np.where(until > 0, np.take_along_axis(cumulated, np.maximum(until, 0), axis=2), 0.0)
    under = np.maximum(cumulated[..., 1:STEPS + 1] - front, 0.0)
    hidden = _HIDDEN * np.clip(np.exp(_HIDDEN_SLOPE * (_HIDDEN_SCORE - scores)), 1.0, _HIDDEN_MOST)
    hidden = np.where(covered, _HIDDEN_COVERED, 1.0) * hidden * STEP / _HIDDEN_DEPTH
    likelihood = own[..., None] * (seen + _UNDER * under) + hidden[..., None] * front + _ANYTHING
    costs = -2 * np.log(likelihood)
    costs -= costs.min(axis=2, keepdims=True)
    return np.where((have & (scores > 0))[..., None], costs, 0.0).astype(np.float32)


def foreground(depth: np.ndarray) -> np.ndarray:
    """Return the nearest surface in each window that more than a few stray samples show, (P, K) [m]; NaN without any.

    Args:
        depth: (P, K, 25) samples [m].
    """
    ordered = np.sort(depth, axis=2)  # missing ones come last
    count = np.isfinite(depth).sum(axis=2)
    first = np.take_along_axis(ordered, (count // _FOREGROUND_SHARE)[..., None], axis=2)
    with np.errstate(invalid='ignore'):
        near = np.abs(depth - first) < _FOREGROUND_DEPTH
    total = near.sum(axis=2)
    return np.where(total > 0, np.where(near, depth, 0.0).sum(axis=2) / np.maximum(total, 1), np.nan)


def supporting_samples(depth: np.ndarray, offsets: np.ndarray, z: np.ndarray, foreign: Optional[np.ndarray]
                       ) -> np.ndarray:
    """Return which (P, K, 25) samples say that joints are at depths z, (P, K) [m]."""
    with np.errstate(invalid='ignore'):
        support = np.abs(depth + offsets[..., None] - z[..., None]) < AGREEMENT
    return support if foreign is None else support & ~foreign


def mean_within(depth: np.ndarray, offsets: np.ndarray, middle: np.ndarray, reach: float, known: np.ndarray,
                foreign: Optional[np.ndarray], joints: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the mean of all the samples that say that people are near a depth, (P,) [m], and their weight, (P,).

    Args:
        depth: (P, 18, 25) samples [m].
        offsets: (P, J) what to add to those of the chosen joints [m].
        middle: (P,) the depth [m].
        reach: how far from it samples count [m].
        known: (P, 18) joints with a keypoint.
        foreign: (P, 18, 25) samples that are somebody else's; None: none are.
        joints: (J,) chosen ones.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.mean_within(depth, offsets, middle, reach, known, foreign, joints, weights=WEIGHTS)
    chosen = depth[:, joints] + offsets[..., None]
    with np.errstate(invalid='ignore'):
        fits = (np.abs(chosen - middle[:, None, None]) < reach) & known[:, joints, None]
    if foreign is not None:
        fits &= ~foreign[:, joints]
    weights = np.where(fits, WEIGHTS, 0.0)
    total = weights.sum(axis=(1, 2))
    return (weights * np.where(fits, chosen, 0.0)).sum(axis=(1, 2)) / np.maximum(total, 1e-9), total


def _histogram(bins: np.ndarray, weights: np.ndarray, count: int) -> np.ndarray:
    """Return the weight in each bin per person and joint, (P, K, count)."""
    people, joints = bins.shape[:2]
    row = np.arange(people * joints).reshape(people, joints, 1) * count
    return np.bincount((row + bins).ravel(), weights.ravel(), people * joints * count).reshape(people, joints, count)


def _cumulated(histogram: np.ndarray) -> np.ndarray:
    """Return the weight below each edge of the bins, (P, K, count + 1)."""
    result = np.zeros((*histogram.shape[:2], histogram.shape[2] + 1))
    np.cumsum(histogram, axis=2, out=result[..., 1:])
    return result


def _shifted(histogram: np.ndarray, shift: int) -> np.ndarray:
    """Return the bins of the candidates, moved by a number of bins; what lies beyond them stays away."""
    result = np.zeros((*histogram.shape[:2], STEPS))
    inner = histogram[..., 1:-1]
    if shift >= 0:
        result[..., shift:] = inner[..., :STEPS - shift]
    else:
        result[..., :shift] = inner[..., -shift:]
    return result
