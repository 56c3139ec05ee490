"""Sizes of people, learnt from measured joints."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.body.body import BONES, MEASURED_BONES
from skeleton_extract_3d.constants import METHOD, MethodConstants


class Sizes(NamedTuple):
    """Stature (N,) [m] of N people and in how many frames it was measured, and lengths (N, 8) in the order of
    `body.BONES` [m] and how often each was.
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
        """Return the sizes of people before any measurement, with an assumed stature, (N,) [m]."""
        none = np.zeros((len(stature), len(BONES)))
        return cls(stature, np.zeros(len(stature)), none, none)


def measured_lengths(xyz: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Return the lengths of `MEASURED_BONES` between measured joints (N, 18) at (N, 18, 3), (N, 10) [m]; else NaN."""
    start, end = xyz[:, MEASURED_BONES[:, 0]], xyz[:, MEASURED_BONES[:, 1]]
    return np.where(measured[:, MEASURED_BONES].all(axis=2), np.linalg.norm(end - start, axis=2), np.nan)


def expected_lengths(sizes: Sizes, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the lengths of the bones of people, (N, 8) [m]: measured ones, and an adult's proportions."""
    body, weight = method.body, sizes.bone_weights
    prior, prior_weight = body.bone_lengths * (sizes.stature / body.adult_stature)[:, None], method.sizes.most_frames
    return (prior_weight * prior + weight * sizes.bones) / (prior_weight + weight)


def length_spreads(sizes: Sizes, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the standard deviations of these lengths, (N, 8), as shares."""
    return _spreads(method.body.proportion_spread, sizes.bone_weights, method)


def stature_spread(sizes: Sizes, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the standard deviation of each stature, as a share, (N,)."""
    return _spreads(method.body.stature_spread, sizes.stature_weight, method)


def _spreads(unknown: float, weight: np.ndarray, method: MethodConstants) -> np.ndarray:
    return unknown + (method.sizes.known - unknown) * (weight / (method.sizes.most_frames + weight))


def with_stature(sizes: Sizes, stature: np.ndarray, known: np.ndarray, method: MethodConstants = METHOD) -> Sizes:
    """Return the sizes with the statures (N,) [m] of one more frame where these are known, (N,) bool."""
    weight = np.where(known, np.minimum(sizes.stature_weight + 1, method.sizes.most_frames), sizes.stature_weight)
    return sizes._replace(stature=np.where(known, sizes.stature + (stature - sizes.stature) / np.maximum(weight, 1),
                                           sizes.stature), stature_weight=weight)


def learn(sizes: Sizes, xyz: np.ndarray, measured: np.ndarray, scores: np.ndarray, method: MethodConstants = METHOD
          ) -> Sizes:
    """Return the sizes with the measured joints (N, 18) of one more frame; compiled (bones.cpp).

    The stature moves towards the median ratio of the bones to those of an adult, each kind of bone towards the mean of
    those whose length is near the expected one.
    """
    return Sizes(*method.compiled.with_frame(sizes, xyz, measured & (scores > method.sizes.least_score)))
