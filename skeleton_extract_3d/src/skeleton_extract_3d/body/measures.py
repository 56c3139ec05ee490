"""Learn how large each person is, from joints that were measured."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.constants import COMPILED, METHOD

_BODY, _SIZES = METHOD.body, METHOD.sizes
_BONE_LENGTHS = _BODY.bone_lengths


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

    def select(self, people: np.ndarray) -> 'Sizes':
        """Return the sizes of some of the people, by indices (N,)."""
        return Sizes(*(value[people] for value in self))

    @classmethod
    def assumed(cls, stature: np.ndarray) -> 'Sizes':
        """Return the sizes of people who were not measured yet, by an assumed stature, (N,) [m]."""
        none = np.zeros((len(stature), len(_BONE_LENGTHS)))
        return cls(stature, np.zeros(len(stature)), none, none)


def expected_lengths(sizes: Sizes) -> np.ndarray:
    """Return the lengths of the bones of people, (N, 8) [m]: measured ones, and an adult's proportions."""
    prior, weight = _BONE_LENGTHS * (sizes.stature / _BODY.adult_stature)[:, None], sizes.bone_weights
    return (_SIZES.prior_frames * prior + weight * sizes.bones) / (_SIZES.prior_frames + weight)


def length_spreads(sizes: Sizes) -> np.ndarray:
    """Return how well these lengths are known, (N, 8), as shares."""
    share = sizes.bone_weights / (_SIZES.prior_frames + sizes.bone_weights)
    return _BODY.proportion_spread + (_SIZES.known_spread - _BODY.proportion_spread) * share


def learn(sizes: Sizes, xyz: np.ndarray, measured: np.ndarray, scores: np.ndarray) -> Sizes:
    """Return the sizes with what one more frame shows.

    Compiled (bones.cpp). The stature moves towards the median of what the bones say, each kind of bone towards the mean
    of those that are about as long as expected.

    Args:
        xyz: (N, 18, 3) [m].
        measured: (N, 18) joints that were seen.
        scores: (N, 18) of the keypoints.
    """
    return Sizes(*COMPILED.with_frame(sizes, xyz, measured & (scores > _SIZES.least_score)))
