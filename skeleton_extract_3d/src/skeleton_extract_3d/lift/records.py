"""What goes into a way of lifting, beside the frame, and what comes out of it."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.body.body import (
    ADULT_STATURE,
    BONE_LENGTHS,
    PROPORTION_SPREAD,
    STATURE_SPREAD,
    SURFACE_OFFSETS,
)


class Expectation(NamedTuple):
    """What is known of P people before the frame.

    Attributes:
        root: (P,) depth of the trunk [m], NaN where unknown.
        depth: (P, 18) of the joints [m], NaN where unknown; depth_sigma: (P, 18) [m].
        left: (P, 3), see `infer_depths`; NaN where unknown.
        stature: (P,) [m]; stature_spread: (P,) as a share.
        lengths: (P, 8) of the bones [m]; length_spread: (P, 8) as a share; in the order of `body.BONES`.
    """

    root: np.ndarray
    depth: np.ndarray
    depth_sigma: np.ndarray
    left: np.ndarray
    stature: np.ndarray
    stature_spread: np.ndarray
    lengths: np.ndarray
    length_spread: np.ndarray

    @classmethod
    def of_strangers(cls, people: int) -> 'Expectation':
        """Return what is known of P people who were never seen: that they are likely adults."""
        joints = len(SURFACE_OFFSETS)
        return cls(np.full(people, np.nan), np.full((people, joints), np.nan), np.ones((people, joints)),
                   np.full((people, 3), np.nan), np.full(people, ADULT_STATURE), np.full(people, STATURE_SPREAD),
                   np.repeat(BONE_LENGTHS[None], people, axis=0),
                   np.full((people, len(BONE_LENGTHS)), PROPORTION_SPREAD))


class Lifted(NamedTuple):
    """P people in space, by one frame.

    Attributes:
        xyz: (P, 18, 3) [m]; where there is no keypoint, a guess.
        surface: (P, 18, 3) [m], the skin in front of joints that were measured; NaN elsewhere.
        measured: (P, 18) bool: seen, on the person's own surface.
        plausible: (P, 18) bool: the bones that end there have possible lengths.
        sigma: (P, 18) standard deviation along the ray [m].
        left: (P, 3) unit vectors.
        root: (P,) depth of the trunk [m].
        stature: (P,) that the bones were taken to have [m].
    """

    xyz: np.ndarray
    surface: np.ndarray
    measured: np.ndarray
    plausible: np.ndarray
    sigma: np.ndarray
    left: np.ndarray
    root: np.ndarray
    stature: np.ndarray

    def select(self, indices: np.ndarray) -> 'Lifted':
        """Return some of the people, in the order of their indices (N,)."""
        return Lifted(*(value[indices] for value in self))
