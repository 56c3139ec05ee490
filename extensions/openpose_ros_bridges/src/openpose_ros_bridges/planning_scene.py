"""People as objects of a planning scene.

Each part of a body is an object by itself, a cylinder with a ball at each end, so that a planner can allow contact with
single parts, such as a hand that takes something.
"""
from typing import Dict, NamedTuple

import numpy as np

from openpose_ros_signals.capsules import PARTS, Capsules


class Solid(NamedTuple):
    """A capsule in space."""

    centre: np.ndarray  # (3,) [m]
    ends: np.ndarray  # (2, 3) of its axis [m]
    orientation: np.ndarray  # (4,) unit quaternion x, y, z, w: the shortest turn of z to its axis
    length: float  # of the axis [m]
    radius: float  # [m]


def solids_of(capsules: Capsules, sigmas: float) -> Dict[str, Solid]:
    """Return the parts of people by their names, such as person_5_left_hand.

    Args:
        sigmas: multiple of the greater sigma of the two ends by which the radius grows.
    """
    axes = capsules.ends[:, 1] - capsules.ends[:, 0]
    lengths = np.linalg.norm(axes, axis=1)
    radii = capsules.radii + sigmas * capsules.known_sigma.max(axis=1, initial=0.0)
    names = (f'person_{person}_{PARTS[part]}' for person, part in zip(capsules.persons, capsules.parts))
    x, y, z = (axes / np.where(lengths > 0, lengths, 1.0)[:, np.newaxis]).T
    turns = np.stack((-y, x, np.zeros_like(x), 1 + z), axis=-1)
    turns[1 + z < 1e-9] = (1.0, 0.0, 0.0, 0.0)  # straight down
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return dict(zip(names, map(Solid, capsules.ends.mean(axis=1), capsules.ends, turns, lengths.tolist(),
                               radii.tolist())))
