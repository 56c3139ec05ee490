"""The depths of all joints of a person at once: the evidence of surfaces for each, and the lengths of bones between.

Pictorial structures (Felzenszwalb and Huttenlocher, IJCV 2005), with the depth along each keypoint's ray in place of a
place in the image; see docs/method.md, section 3. Costs are -2 log likelihood. The min-marginal of a candidate is the
cost of the cheapest depths of all joints that go through it.

Thirteen places of a person: shoulders and hips, elbows and knees, wrists and ankles (each left arm, right arm, left
leg, right leg), and the middle of the ears. Twelve bones: upper and lower ones of the limbs in that order, shoulders,
hips, trunk, neck to head.
"""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.body.body import ENDS, LOWER_KINDS, MIDDLES, PAIR_KINDS, ROOTS, UPPER_KINDS, bone_kinds
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.constants import InferenceConstants

# The joints among the thirteen places.
CHAINS = np.concatenate([ROOTS, MIDDLES, ENDS])
_KINDS = np.concatenate([UPPER_KINDS, LOWER_KINDS, PAIR_KINDS, bone_kinds('trunk', 'head')])


class Bones(NamedTuple):
    """The twelve bones of P people: lengths and their standard deviations (P, 12) float32 [m], and stature (P,) [m]."""

    lengths: np.ndarray
    sigmas: np.ndarray
    stature: np.ndarray


def bones_of(lengths: np.ndarray, spread: np.ndarray, stature: np.ndarray,
             constants: InferenceConstants = METHOD.inference) -> Bones:
    """Return the bones of people.

    Args:
        lengths, spread: (P, 8) in the order of `body.BONES` [m], and standard deviations as shares.
        stature: (P,) [m].
    """
    sigmas = np.sqrt((spread * lengths) ** 2 + constants.keypoint_error ** 2)[:, _KINDS]
    sigmas[:, 11] += constants.keypoint_error
    return Bones(lengths[:, _KINDS].astype(np.float32), sigmas.astype(np.float32), stature)
