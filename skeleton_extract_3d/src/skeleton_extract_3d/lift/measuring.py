"""Which joints were seen, and where: those whose own surface is where it should be, and whose bones agree."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.body.body import ENDS, HEAD, MIDDLES, ROOTS
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.depth_inference import Bones
from skeleton_extract_3d.lift.records import ObservedPeople, Ownership
from skeleton_extract_3d.lift.surfaces import relative_weights

_MEASURING = METHOD.measuring
_THICKNESSES = METHOD.body.thicknesses
# The four limbs: arms fold, legs of standing people do not.
_LEGS = np.array([False, False, True, True])
# Starts and ends of the lower and upper bones of the limbs.
_STARTS, _ENDS = np.concatenate([ROOTS, MIDDLES]), np.concatenate([MIDDLES, ENDS])


class Measured(NamedTuple):
    """What was seen of P people: the first attributes of `Lifted`."""

    xyz: np.ndarray
    surface: np.ndarray
    measured: np.ndarray
    plausible: np.ndarray


@np.errstate(invalid='ignore')
def measure(seen: ObservedPeople, z: np.ndarray, offsets: np.ndarray, ownership: Ownership, bones: Bones) -> Measured:
    """Decide which joints were seen, and put those where their surface is.

    Args:
        z: (P, 18) depths of the joints [m].
        offsets: (P, 18) depth of the joint under the surface [m].
        ownership: whose surfaces the samples are.
        bones: of these people.
    """
    samples = seen.samples
    weights, _ = relative_weights(samples)
    supports = np.abs(samples - (z - offsets)[..., None]) < _MEASURING.agreement
    if ownership.foreign is not None:
        supports &= ~ownership.foreign
    supporting = weights * supports
    support = supporting.sum(axis=2)
    surface = (supporting * np.where(supports, samples, 0.0)).sum(axis=2) / np.maximum(support, 1e-9)
    in_front = samples < (z - np.maximum(_THICKNESSES, offsets))[..., None]
    measured = (seen.known & (support > _MEASURING.least_support) & (ownership.own > _MEASURING.least_own)
                & (support >= _MEASURING.against_front * (weights * in_front).sum(axis=2)))
    # a face that is turned away is under the head
    measured[:, HEAD] &= offsets[:, HEAD] < _THICKNESSES[HEAD]
    at = np.where(measured, surface + offsets, z)
    at[:, HEAD] = z[:, HEAD]
    xyz = seen.rays * at[..., None]
    plausible = _plausible(xyz, seen, bones)
    measured &= plausible
    return Measured(xyz, np.where(measured[..., None], seen.rays * surface[..., None], np.nan), measured, plausible)


def _plausible(xyz: np.ndarray, seen: ObservedPeople, bones: Bones) -> np.ndarray:
    """Return which joints end a bone of a possible length, (P, 18)."""
    known, scores = seen.known, seen.scores
    length = bones.lengths[:, :8]
    distance = _distances(xyz[:, _STARTS], xyz[:, _ENDS])
    possible = ((distance > _MEASURING.shortest * length)
                & (distance < _MEASURING.longest * length + _MEASURING.bone_error))
    plausible = np.ones(known.shape, bool)
    plausible[:, _ENDS] = possible | ~(known[:, _STARTS] & known[:, _ENDS])
    of_ends = scores[:, ENDS]
    folded = known[:, ROOTS] & (_distances(xyz[:, ROOTS], xyz[:, ENDS])
                                < _MEASURING.folded * (bones.upper + bones.lower))
    folded &= _LEGS | (scores[:, MIDDLES] < _MEASURING.unsure_end)
    plausible[:, ENDS] &= ((plausible[:, MIDDLES] | (of_ends > _MEASURING.sure_end))
                           & ~(folded & (of_ends < _MEASURING.unsure_end)))
    return plausible


def _distances(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the distances of (..., 3) points, (...) [m]."""
    along = start - end
    return np.sqrt((along * along).sum(axis=-1))
