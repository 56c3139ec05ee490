"""Express people in another frame of reference."""
import dataclasses

import numpy as np

from skeleton_extract_3d.people import People3D


def transform_people(people: People3D, rotation: np.ndarray, translation: np.ndarray) -> People3D:
    """Return the people with x' = R x + t; sigma, being isotropic, stays.

    Args:
        rotation: (3, 3), from the people's frame to the target frame.
        translation: (3,) [m], origin of the people's frame in the target frame.
    """
    moved = people.xyz.astype(np.float64) @ np.asarray(rotation).T + np.asarray(translation)
    return dataclasses.replace(people, xyz=moved.astype(np.float32))
