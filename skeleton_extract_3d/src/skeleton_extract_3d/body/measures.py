"""Learn how large each person is, from joints that were measured."""
from typing import NamedTuple, Tuple

import numpy as np

from skeleton_extract_3d import compiled
from skeleton_extract_3d.body import body
from skeleton_extract_3d.body.body import (
    ADULT_STATURE,
    BONE_LENGTHS,
    HIPS,
    NECK,
    PROPORTION_SPREAD,
    SHOULDERS,
    SIZED_LENGTHS,
    SIZED_PAIRS,
    STATURE_LIMITS,
)

# Only keypoints with this score measure.
_LEAST_SCORE = 0.5
# A stature needs so many bones at once; one measured in so many frames hardly changes any more.
_LEAST_BONES, _MOST_FRAMES = 3, 30.0
# The proportions of adults count like so many frames.
_PRIOR_FRAMES = 8.0
# A bone that differs more than this from what is expected has a keypoint elsewhere (share).
_MOST_CHANGE = 0.25
# Spread of a length that was measured often (share).
_KNOWN_SPREAD = 0.03
# Pairs of joints that show a bone, and its kind; the trunk comes after them.
_PAIRS = np.concatenate([[SHOULDERS, HIPS], np.stack([body.ROOTS, body.MIDDLES], axis=1),
                         np.stack([body.MIDDLES, body.ENDS], axis=1)])
_KINDS = np.array([body.BONES.index(kind) for kind in (
    'shoulders', 'hips', 'upper_arm', 'upper_arm', 'thigh', 'thigh', 'forearm', 'forearm', 'shin', 'shin', 'trunk')])
_OF_KIND = (_KINDS[:, None] == np.arange(len(body.BONES))).astype(np.float64)


class Sizes(NamedTuple):
    """What was measured of N people.

    Attributes:
        stature, stature_weight: (N,) [m], and in how many frames.
        bones, bone_weights: (N, 8) [m], and how often, in the order of `body.BONES`.
    """

    stature: np.ndarray
    stature_weight: np.ndarray
    bones: np.ndarray
    bone_weights: np.ndarray

    @classmethod
    def assumed(cls, stature: np.ndarray) -> 'Sizes':
        """Return the sizes of people who were not measured yet, by an assumed stature, (N,) [m]."""
        none = np.zeros((len(stature), len(BONE_LENGTHS)))
        return cls(stature, np.zeros(len(stature)), none, none)


def expected_lengths(sizes: Sizes) -> np.ndarray:
    """Return the lengths of the bones of people, (N, 8) [m]: measured ones, and an adult's proportions."""
    return _expected(sizes.stature, sizes.bones, sizes.bone_weights)


def length_spreads(sizes: Sizes) -> np.ndarray:
    """Return how well these lengths are known, (N, 8), as shares."""
    weight = sizes.bone_weights
    return PROPORTION_SPREAD + (_KNOWN_SPREAD - PROPORTION_SPREAD) * (weight / (_PRIOR_FRAMES + weight))


def learn(sizes: Sizes, xyz: np.ndarray, measured: np.ndarray, scores: np.ndarray) -> Sizes:
    """Return the sizes with what one more frame shows.

    Args:
        xyz: (N, 18, 3) [m].
        measured: (N, 18) joints that were seen.
        scores: (N, 18) of the keypoints.
    """
    return with_frame(sizes, xyz, measured & (scores > _LEAST_SCORE))


def with_frame(sizes: Sizes, xyz: np.ndarray, good: np.ndarray) -> Sizes:
    """Return the sizes with what one more frame shows.

    Args:
        xyz: (N, 18, 3) [m].
        good: (N, 18) joints that measure.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return Sizes(*twin.with_frame(
            sizes, xyz, good, sized_pairs=SIZED_PAIRS, sized_lengths=SIZED_LENGTHS, least_bones=_LEAST_BONES,
            adult_stature=ADULT_STATURE, stature_limits=STATURE_LIMITS, adult_lengths=BONE_LENGTHS, neck=NECK,
            hips=HIPS, pairs=_PAIRS, kinds=_KINDS, prior_frames=_PRIOR_FRAMES, most_frames=_MOST_FRAMES,
            most_change=_MOST_CHANGE))
    stature, stature_weight = _with_stature(sizes, xyz, good)
    trunk = xyz[:, NECK] - xyz[:, HIPS].mean(axis=1)
    along = np.concatenate([xyz[:, _PAIRS[:, 0]] - xyz[:, _PAIRS[:, 1]], trunk[:, None]], axis=1)
    length = np.linalg.norm(along, axis=2)
    seen = np.concatenate([good[:, _PAIRS].all(axis=2), (good[:, NECK] & good[:, HIPS].all(axis=1))[:, None]], axis=1)
    expected = _expected(stature, sizes.bones, sizes.bone_weights)[:, _KINDS]
    usable = seen & (np.abs(length / expected - 1) < _MOST_CHANGE)
    total, count = np.where(usable, length, 0.0) @ _OF_KIND, usable @ _OF_KIND
    weight = sizes.bone_weights + count
    change = total / np.maximum(count, 1) - sizes.bones
    return Sizes(stature, stature_weight, sizes.bones + change * (count / np.maximum(weight, 1)),
                 np.minimum(weight, _MOST_FRAMES))


def _expected(stature: np.ndarray, bones: np.ndarray, weight: np.ndarray) -> np.ndarray:
    prior = BONE_LENGTHS * (stature / ADULT_STATURE)[:, None]
    return (_PRIOR_FRAMES * prior + weight * bones) / (_PRIOR_FRAMES + weight)


def _with_stature(sizes: Sizes, xyz: np.ndarray, good: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return statures moved towards the median of what the bones say, and their weights, (N,) each."""
    length = np.linalg.norm(xyz[:, SIZED_PAIRS[:, 0]] - xyz[:, SIZED_PAIRS[:, 1]], axis=2)
    usable = good[:, SIZED_PAIRS].all(axis=2)
    count = usable.sum(axis=1)
    ratio = np.sort(np.where(usable, length / SIZED_LENGTHS, np.inf), axis=1)
    each = np.arange(len(xyz))
    middle = (ratio[each, np.maximum(count - 1, 0) // 2] + ratio[each, np.maximum(count, 1) // 2]) / 2
    enough = count >= _LEAST_BONES
    stature = np.clip(np.where(enough, middle, 1.0) * ADULT_STATURE, *STATURE_LIMITS)
    weight = np.minimum(sizes.stature_weight + 1, _MOST_FRAMES)
    # of the first frame, an adult's is the other half
    share = np.where(weight > 1, 1 / weight, 0.5)
    return (sizes.stature + np.where(enough, (stature - sizes.stature) * share, 0.0),
            np.where(enough, weight, sizes.stature_weight))
