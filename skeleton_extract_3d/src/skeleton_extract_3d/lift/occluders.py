"""Whose surface is it that covers a keypoint: another person's, the scenery's, or another part of the same body."""
from typing import NamedTuple, Optional, Tuple

import numpy as np

from skeleton_extract_3d import compiled
from skeleton_extract_3d.body.body import COVERING_PARTS, ENDS, MIDDLES, PART_RADII, PARTS
from skeleton_extract_3d.lift.surfaces import depths_at, lower_median
from skeleton_extract_3d.points.point_grid import PointGrid

# A sample is another person's if it is so near to that body [m] and so much nearer to it than to its own [m]; the
# surface is about half the thickness of a limb in front of the bones.
_OTHERS_REACH, _OTHERS_LEAD, _SKIN = 0.22, 0.10, 0.06
# Parts below the root of this length [px] are points.
_LEAST_SQUARE = 1e-6
# Of a part of the own body, only the inner share of its breadth counts as covering.
_COVERING_SHARE = 0.8
# Distances to the sides of a limb at which the surface is looked at [m]: just beside it, and beyond.
_BESIDE = np.array([0.10, 0.28, 0.364])
# A surface so far in front of the trunk [m] that goes on on both sides, beyond, within this depth [m], is no limb and
# belongs to the person with this likelihood.
_IN_FRONT, _CONTINUES, _UNLIKELY = 0.30, 0.12, 0.03
# A surface on the trunk that does not stand out so far on either side [m] is an arm's with this likelihood.
_STANDS_OUT, _FLAT = 0.035, 0.15
_ARMS = np.concatenate([MIDDLES[:2], ENDS[:2]])
# A limb that is shorter in the picture points at the camera [px].
_SHORTEST_LIMB = 3.0

# The joint towards which a limb runs from each joint, in the order of COCO_18.
_LIMB_TO = np.array([1, 0, 5, 2, 3, 2, 5, 6, 11, 8, 9, 8, 11, 12, 0, 0, 0, 0])


def _on_parts(uv: np.ndarray, parts_uv: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return distances [px] of pixels from parts of bodies, and where along them the nearest places are, 0..1.

    Args:
        uv: (..., 2) [px], broadcasting against the parts.
        parts_uv: (..., parts, 2 ends, 2) [px], NaN where unknown.
    """
    start, along = parts_uv[..., 0, :], parts_uv[..., 1, :] - parts_uv[..., 0, :]
    from_start = uv[..., None, :] - start
    length = np.maximum((along * along).sum(axis=-1), _LEAST_SQUARE)
    share = np.clip((from_start * along).sum(axis=-1) / length, 0.0, 1.0)
    nearest = from_start - share[..., None] * along
    return np.sqrt((nearest * nearest).sum(axis=-1)), share


def others_depths(uv: np.ndarray, joint_depths: np.ndarray, focal: float) -> np.ndarray:
    """Return at which depths the bodies of the others are in the picture, at the keypoints of each person.

    Args:
        uv: (P, 18, 2) [px of the grid], NaN where unknown.
        joint_depths: (P, 18) [m].
        focal: focal length [px].

    Returns:
        (P, 18, P) [m]; infinite where the person of the last axis is not at that pixel, or is the person itself.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.others_depths(uv, joint_depths, focal, parts=PARTS, radii=PART_RADII, least_square=_LEAST_SQUARE)
    people = len(uv)
    ends = joint_depths[:, PARTS]
    distance, share = _on_parts(uv[:, :, None], uv[:, PARTS][None, None])
    depth = ends[..., 0] + share * (ends[..., 1] - ends[..., 0])
    with np.errstate(invalid='ignore'):
        covered = distance < PART_RADII * focal / depth
    result = np.where(covered, depth, np.inf).min(axis=3)
    result[np.arange(people), :, np.arange(people)] = np.inf
    return result


def foreign_samples(depth: np.ndarray, others: np.ndarray, expected: np.ndarray) -> Optional[np.ndarray]:
    """Return which samples lie on other people, (P, 18, 25); None if no sample does.

    Args:
        depth: (P, 18, 25) [m].
        others: (P, 18, Q) depths of other bodies there, of `others_depths` [m].
        expected: (P, 18) or (P, 1) where the person itself should be [m].
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.foreign_samples(depth, others, expected, reach=_OTHERS_REACH, lead=_OTHERS_LEAD, skin=_SKIN)
    if not np.isfinite(others).any():
        return None
    surface = depth + _SKIN
    with np.errstate(invalid='ignore'):
        gap = np.abs(surface[..., None] - others[:, :, None, :]).min(axis=3)
        foreign = (gap < _OTHERS_REACH) & (gap + _OTHERS_LEAD < np.abs(surface - expected[..., None]))
    return foreign if foreign.any() else None


def covered_by_self(uv: np.ndarray, root: np.ndarray, focal: float) -> np.ndarray:
    """Return which joints lie, in the picture, on another part of the same body, (P, 18) bool.

    Args:
        uv: (P, 18, 2) [px of the grid], NaN where unknown.
        root: (P,) depth of the trunk [m].
        focal: focal length [px].
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.covered_by_self(uv, root, focal, parts=PARTS, radii=PART_RADII, covering=COVERING_PARTS,
                                    share=_COVERING_SHARE, least_square=_LEAST_SQUARE)
    distance, _ = _on_parts(uv, uv[:, None, PARTS])
    with np.errstate(invalid='ignore'):
        covered = distance < _COVERING_SHARE * PART_RADII * (focal / root)[:, None, None]
    return (covered & COVERING_PARTS).any(axis=2)


def likely_own(points: PointGrid, uv: np.ndarray, depth: np.ndarray, root: np.ndarray, covered: np.ndarray,
               focal: float) -> np.ndarray:
    """Return how likely the surfaces at the keypoints belong to the joints' limbs, (P, 18) of 0..1.

    What a person holds in front of the body is slim: a surface there that goes on to both sides is a counter, a table
    or somebody's back. An arm in front of the trunk stands out from it.

    Args:
        uv: (P, 18, 2) [px of the grid], NaN where unknown.
        depth: (P, 18, 25) samples [m].
        root: (P,) depth of the trunk [m].
        covered: (P, 18) where another part of the body may be, of `covered_by_self`.
        focal: focal length [px].
    """
    likely = np.ones(uv.shape[:2])
    doubted = Doubted(*doubtful_surfaces(uv, depth, root, covered, focal))
    if not len(doubted.person):
        return likely
    beside = depths_at(points, doubted.beside) - doubted.surface
    with np.errstate(invalid='ignore'):
        goes_on = (np.abs(beside[:, 1:]) < _CONTINUES).any(axis=1).all(axis=0)
        flat = (beside[:, 0] < _STANDS_OUT).all(axis=0)
    likely[doubted.person, doubted.joint] = np.where(goes_on & doubted.in_front, _UNLIKELY,
                                                     np.where(flat & doubted.on_trunk, _FLAT, 1.0))
    return likely


class Doubted(NamedTuple):
    """N surfaces that may not be those of the limbs whose keypoints they are at.

    Attributes:
        person, joint: (N,) whose.
        surface: (N,) depth [m].
        in_front: (N,) bool, far in front of the trunk; on_trunk: (N,) bool, of arms before the trunk.
        beside: (2 sides, 3 distances, N, 2) where to look beside the limbs [px].
    """

    person: np.ndarray
    joint: np.ndarray
    surface: np.ndarray
    in_front: np.ndarray
    on_trunk: np.ndarray
    beside: np.ndarray


def doubtful_surfaces(uv: np.ndarray, depth: np.ndarray, root: np.ndarray, covered: np.ndarray, focal: float
                      ) -> Tuple[np.ndarray, ...]:
    """Return what `Doubted` holds; arguments as of `likely_own`."""
    twin = compiled.load()[0]
    if twin is not None:
        return twin.doubtful_surfaces(uv, depth, root, covered, focal, arms=_ARMS, in_front=_IN_FRONT, limb_to=_LIMB_TO,
                                      beside=_BESIDE, shortest=_SHORTEST_LIMB)
    surface = lower_median(depth)
    with np.errstate(invalid='ignore'):
        in_front = (surface < root[:, None] - _IN_FRONT) & np.isfinite(uv[..., 0])
    on_trunk = np.zeros_like(covered)
    on_trunk[:, _ARMS] = covered[:, _ARMS] & np.isfinite(surface[:, _ARMS])
    person, joint = np.nonzero(in_front | on_trunk)
    here, surface = uv[person, joint], surface[person, joint]
    along = uv[person, _LIMB_TO[joint]] - here
    length = np.linalg.norm(along, axis=1, keepdims=True)
    # a limb that points at the camera, or whose other end is unknown, is taken to hang down
    along = np.where(length > _SHORTEST_LIMB, along / np.maximum(length, 1e-6), [0.0, 1.0])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) * (focal / surface)[:, None]
    reach = np.array([[-1.0], [1.0]]) * _BESIDE
    return (person, joint, surface, in_front[person, joint], on_trunk[person, joint],
            here + reach[..., None, None] * across)
