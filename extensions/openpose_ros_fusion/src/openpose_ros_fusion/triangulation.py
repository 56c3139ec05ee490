"""People out of the rays of cameras without depth."""
from typing import Optional

import numpy as np

from openpose_ros_fusion.observations import Sighting

# Joints by which a body is placed.
_LEAST_JOINTS = 6


def moved_onto_rays(joints: np.ndarray, sighting: Sighting, person: int) -> Optional[np.ndarray]:
    """Return by what (3,) [m] a body (18, 3) has to be moved so that its joints are nearest to the rays of a person.

    None: too few joints are seen. Robust least squares of the distances from the rays,
    t = (sum P_k)^-1 sum P_k (o - x_k) with P_k = 1 - d_k d_k'.
    """
    rays = sighting.directions[person]
    used = np.isfinite(joints).all(axis=1) & np.isfinite(rays).all(axis=1)
    if used.sum() < _LEAST_JOINTS:
        return None
    offsets, rays = sighting.origin - joints[used], rays[used]
    weights = np.ones(len(rays))
    for _ in range(3):
        across = np.eye(3) - rays[:, :, np.newaxis] * rays[:, np.newaxis]
        moved = np.linalg.solve((weights[:, np.newaxis, np.newaxis] * across).sum(axis=0),
                                np.einsum('k,kij,kj->i', weights, across, offsets))
        left = np.linalg.norm(np.einsum('kij,kj->ki', across, offsets - moved), axis=1)
        weights = 1 / (1 + (left / 0.05) ** 2)
    return moved
