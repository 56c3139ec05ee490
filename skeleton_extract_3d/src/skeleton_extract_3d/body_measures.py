"""Learn how large each person is, from joints that were measured."""
import numpy as np

from skeleton_extract_3d import body
from skeleton_extract_3d.body import (
    ADULT_STATURE,
    BONE_LENGTHS,
    HIPS,
    NECK,
    PROPORTION_SPREAD,
    SHOULDERS,
    SIZED_LENGTHS,
    SIZED_PAIRS,
)
from skeleton_extract_3d.tracks import Tracks

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
# Kind of bone, and the pairs of joints that show it.
_MEASURED_BONES = tuple((body.BONES.index(kind), np.array(pairs)) for kind, pairs in (
    ('shoulders', [SHOULDERS]), ('hips', [HIPS]),
    ('upper_arm', list(zip(body.ROOTS[:2], body.MIDDLES[:2]))), ('forearm', list(zip(body.MIDDLES[:2], body.ENDS[:2]))),
    ('thigh', list(zip(body.ROOTS[2:], body.MIDDLES[2:]))), ('shin', list(zip(body.MIDDLES[2:], body.ENDS[2:])))))
_TRUNK = body.BONES.index('trunk')


def expected_lengths(tracks: Tracks, rows: np.ndarray) -> np.ndarray:
    """Return the lengths of the bones of people, (N, 8) [m]: measured ones, and an adult's proportions."""
    weight = tracks.bone_weights[rows]
    prior = BONE_LENGTHS * (tracks.stature[rows] / ADULT_STATURE)[:, None]
    return (_PRIOR_FRAMES * prior + weight * tracks.bones[rows]) / (_PRIOR_FRAMES + weight)


def length_spreads(tracks: Tracks, rows: np.ndarray) -> np.ndarray:
    """Return how well these lengths are known, (N, 8), as shares."""
    known = tracks.bone_weights[rows] / (_PRIOR_FRAMES + tracks.bone_weights[rows])
    return PROPORTION_SPREAD + (_KNOWN_SPREAD - PROPORTION_SPREAD) * known


def learn(tracks: Tracks, rows: np.ndarray, xyz: np.ndarray, measured: np.ndarray, scores: np.ndarray) -> None:
    """Take the sizes that a frame shows into the tracks.

    Args:
        rows: (N,) tracks.
        xyz: (N, 18, 3) [m].
        measured: (N, 18) joints that were seen.
        scores: (N, 18) of the keypoints.
    """
    good = measured & (scores > _LEAST_SCORE)
    _learn_stature(tracks, rows, xyz, good)
    expected = expected_lengths(tracks, rows)
    for kind, pairs in _MEASURED_BONES:
        length = np.linalg.norm(xyz[:, pairs[:, 0]] - xyz[:, pairs[:, 1]], axis=2)
        usable = good[:, pairs].all(axis=2) & (np.abs(length / expected[:, kind, None] - 1) < _MOST_CHANGE)
        _average(tracks, rows, kind, np.where(usable, length, 0.0).sum(axis=1), usable.sum(axis=1))
    trunk = np.linalg.norm(xyz[:, NECK] - xyz[:, HIPS].mean(axis=1), axis=1)
    usable = good[:, NECK] & good[:, HIPS].all(axis=1) & (np.abs(trunk / expected[:, _TRUNK] - 1) < _MOST_CHANGE)
    _average(tracks, rows, _TRUNK, np.where(usable, trunk, 0.0), usable.astype(np.int64))


def _learn_stature(tracks: Tracks, rows: np.ndarray, xyz: np.ndarray, good: np.ndarray) -> None:
    """Move statures towards the median of what the bones say."""
    length = np.linalg.norm(xyz[:, SIZED_PAIRS[:, 0]] - xyz[:, SIZED_PAIRS[:, 1]], axis=2)
    usable = good[:, SIZED_PAIRS].all(axis=2)
    count = usable.sum(axis=1)
    ratio = np.sort(np.where(usable, length / SIZED_LENGTHS, np.inf), axis=1)
    each = np.arange(len(rows))
    middle = (ratio[each, np.maximum(count - 1, 0) // 2] + ratio[each, np.maximum(count, 1) // 2]) / 2
    enough = count >= _LEAST_BONES
    stature = np.clip(np.where(enough, middle, 1.0) * ADULT_STATURE, *body.STATURE_LIMITS)
    weight = np.minimum(tracks.stature_weight[rows] + 1, _MOST_FRAMES)
    # of the first frame, an adult's is the other half
    share = np.where(weight > 1, 1 / weight, 0.5)
    tracks.stature[rows] += np.where(enough, (stature - tracks.stature[rows]) * share, 0.0)
    tracks.stature_weight[rows] = np.where(enough, weight, tracks.stature_weight[rows])


def _average(tracks: Tracks, rows: np.ndarray, kind: int, total: np.ndarray, count: np.ndarray) -> None:
    weight = tracks.bone_weights[rows, kind]
    after = np.minimum(weight + count, _MOST_FRAMES)
    mean = total / np.maximum(count, 1)
    share = np.where(count > 0, count / np.maximum(weight + count, 1), 0.0)
    tracks.bones[rows, kind] += (mean - tracks.bones[rows, kind]) * share
    tracks.bone_weights[rows, kind] = after
