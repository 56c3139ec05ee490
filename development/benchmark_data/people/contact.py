"""Whether people stand in each other or in furniture, told from their joints."""
from typing import Any, FrozenSet, Sequence, Set, Tuple

import numpy as np

from ..rendering.room import Box
from .body import COCO18
from .rig import Rig

# Bones as joints (-1: middle of the hips) and the radius of what is around them, for a stature of 1.75 m [m].
_BONES = ((1, -1, 0.15), (0, 1, 0.08), (2, 3, 0.055), (3, 4, 0.045), (5, 6, 0.055), (6, 7, 0.045), (8, 9, 0.085),
          (9, 10, 0.06), (11, 12, 0.085), (12, 13, 0.06), (8, 11, 0.12))
_SHARES = np.linspace(0, 1, 6)
FURNITURE_MARGIN = 0.02  # [m] furniture is this much larger for a bone
CONTACT_DEPTH = 0.10  # [m] that the trunks of two who hug may overlap: clothes and flesh yield


def bone_points(joints: np.ndarray, stature: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return (N, 3) points along the bones of (18, 3) joints, and the radius of the body around each."""
    hips = 0.5 * (joints[COCO18.index('right_hip')] + joints[COCO18.index('left_hip')])
    ends = np.array([[joints[a], hips if b < 0 else joints[b]] for a, b, _ in _BONES])
    points = ends[:, None, 0] + _SHARES[None, :, None] * (ends[:, None, 1] - ends[:, None, 0])
    return points.reshape(-1, 3), np.repeat([radius for _, _, radius in _BONES], len(_SHARES)) * stature / 1.75


def check_contact(rigs: Sequence[Rig], movers: Sequence[Any], boxes: Sequence[Box], times: Sequence[float],
                  touching: Set[FrozenSet[int]]) -> None:
    """Raise ValueError where two people, or one and furniture, are in each other at the times.

    touching: pairs that may touch, with arms anyhow and trunks up to CONTACT_DEPTH.
    """
    for t in times:
        clouds = [bone_points(rig.pose(mover.at(t)).joints, rig.body.stature) for rig, mover in zip(rigs, movers)]
        for i, (points, radii) in enumerate(clouds):
            if any(box.contains(points, -FURNITURE_MARGIN).any() for box in boxes):
                raise ValueError(f'person {i + 1} is in furniture at {t:.1f} s')
            for j in range(i):
                if _overlap(clouds[j], (points, radii), frozenset((i, j)) in touching):
                    raise ValueError(f'persons {j + 1} and {i + 1} are in each other at {t:.1f} s')


def _overlap(a: Tuple[np.ndarray, np.ndarray], b: Tuple[np.ndarray, np.ndarray], touching: bool) -> bool:
    trunk = np.r_[:6, 60:66] if touching else slice(None)
    distance = np.linalg.norm(a[0][trunk][:, None] - b[0][trunk][None], axis=2)
    allowed = -CONTACT_DEPTH if touching else 0.03
    return bool((distance < a[1][trunk][:, None] + b[1][trunk][None] + allowed).any())
