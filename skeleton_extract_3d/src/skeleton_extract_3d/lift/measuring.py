"""Which joints were seen, and where: those whose own surface is where it should be, and whose bones agree."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.constants import COMPILED
from skeleton_extract_3d.lift.depth_inference import Bones
from skeleton_extract_3d.lift.records import ObservedPeople, Ownership


class Measured(NamedTuple):
    """What was seen of P people: the first attributes of `Lifted`."""

    xyz: np.ndarray
    surface: np.ndarray
    measured: np.ndarray
    plausible: np.ndarray


def measure(seen: ObservedPeople, z: np.ndarray, offsets: np.ndarray, ownership: Ownership, bones: Bones) -> Measured:
    """Decide which joints were seen, and put those where their surface is.

    Compiled (measuring.cpp).

    Args:
        z: (P, 18) depths of the joints [m].
        offsets: (P, 18) depth of the joint under the surface [m].
        ownership: whose surfaces the samples are.
        bones: of these people.
    """
    return Measured(*COMPILED.measure((seen.rays, seen.scores, seen.known, seen.samples), z, offsets, ownership.own,
                                      ownership.foreign, bones.lengths[:, :8]))
