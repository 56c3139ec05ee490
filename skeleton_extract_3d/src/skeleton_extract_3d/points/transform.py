"""Express people in another frame of reference."""
import dataclasses
from typing import Tuple

import numpy as np

from skeleton_extract_3d.people import People3D

Transform = Tuple[np.ndarray, np.ndarray]
"""Rotation (3, 3) and translation (3,) [m] of x' = R x + t."""


def transform_people(people: People3D, rotation: np.ndarray, translation: np.ndarray) -> People3D:
    """Return the people with x' = R x + t and v' = R v; sigma, being isotropic, stays.

    Args:
        rotation: (3, 3), from the people's frame to the target frame.
        translation: (3,) [m], origin of the people's frame in the target frame.
    """
    turn = np.asarray(rotation).T
    return dataclasses.replace(people, xyz=people.xyz.astype(np.float64) @ turn + np.asarray(translation),
                               velocity=people.velocity.astype(np.float64) @ turn)
