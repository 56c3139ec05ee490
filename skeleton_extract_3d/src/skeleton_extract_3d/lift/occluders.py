"""Whose surface is it that covers a keypoint: another person's, the scenery's, or another part of the same body."""
from typing import Optional

import numpy as np

from skeleton_extract_3d.body.body import ENDS, JOINTS, MIDDLES, SIDES
from skeleton_extract_3d.constants import COMPILED, METHOD
from skeleton_extract_3d.lift.records import ObservedPeople, Ownership
from skeleton_extract_3d.lift.surfaces import WEIGHTS, depths_at, lower_median
from skeleton_extract_3d.points.point_grid import PointGrid

_OCCLUDERS = METHOD.occluders
_BESIDE = np.array([_OCCLUDERS.just_beside, *_OCCLUDERS.beyond])
_ONES = np.ones(len(WEIGHTS))
_ARMS = np.isin(np.arange(len(JOINTS)), [*MIDDLES[:2], *ENDS[:2]])
_OUTER, _OUTER_SIDES = np.concatenate([MIDDLES, ENDS]), np.concatenate([SIDES, SIDES])
# The joint towards which a limb runs from each joint, in the order of COCO_18.
_LIMB_TO = np.array([1, 0, 5, 2, 3, 2, 5, 6, 11, 8, 9, 8, 11, 12, 0, 0, 0, 0])


def others_depths(uv: np.ndarray, joint_depths: np.ndarray, focal: float) -> np.ndarray:
    """Return at which depths the bodies of the others are in the image, at the keypoints of each person.

    Compiled (occluders.cpp). A body is the cylinders of `BodyConstants.parts` between its joints.

    Args:
        uv: (P, 18, 2) [px of the grid], NaN where unknown.
        joint_depths: (P, 18) [m].
        focal: focal length [px].

    Returns:
        (P, 18, P) [m]; infinite where the person of the last axis is not at that pixel, or is the person itself.
    """
    return COMPILED.others_depths(uv, joint_depths, focal)


def foreign_samples(samples: np.ndarray, others: np.ndarray, expected: np.ndarray) -> Optional[np.ndarray]:
    """Return which samples lie on other people, (P, 18, 25); None if no sample does.

    Args:
        samples: (P, 18, 25) [m].
        others: (P, 18, Q) depths of other bodies there, of `others_depths` [m].
        expected: (P, 18) or (P, 1) where the person itself should be [m].
    """
    count = np.isfinite(others).sum(axis=2)
    person, joint = np.nonzero(count)
    if not len(person):
        return None
    surface = samples[person, joint] + _OCCLUDERS.skin
    # few of the others are at one pixel, and infinite depths come last
    there = np.sort(others[person, joint], axis=1)[:, :count.max()]
    gap = np.abs(surface[..., None] - there[:, None]).min(axis=2)
    own = np.broadcast_to(expected, samples.shape[:2])[person, joint]
    lies_there = (gap < _OCCLUDERS.others_reach) & (gap + _OCCLUDERS.others_lead < np.abs(surface - own[:, None]))
    if not lies_there.any():
        return None
    foreign = np.zeros(samples.shape, bool)
    foreign[person, joint] = lies_there
    return foreign


def ownership(points: PointGrid, seen: ObservedPeople, root: np.ndarray, left: np.ndarray,
              foreign: Optional[np.ndarray]) -> Ownership:
    """Return whose surfaces the samples are.

    Args:
        root: (P,) depth of the trunk [m].
        left: (P, 3) to the left of the people, of any length; zero where unknown.
        foreign: of `foreign_samples`.
    """
    covered = covered_by_self(seen.uv, root, seen.focal)
    own = likely_own(points, seen, root, covered)
    own = np.where(covered & _on_far_side(left), own * _OCCLUDERS.far_side, own)
    return Ownership(own, covered, foreign)


def covered_by_self(uv: np.ndarray, root: np.ndarray, focal: float) -> np.ndarray:
    """Return which joints lie, in the image, on another part of the same body, (P, 18) bool.

    Compiled (occluders.cpp).

    Args:
        uv: (P, 18, 2) [px of the grid], NaN where unknown.
        root: (P,) depth of the trunk [m].
        focal: focal length [px].
    """
    return COMPILED.covered_by_self(uv, root, focal)


def likely_own(points: PointGrid, seen: ObservedPeople, root: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """Return how likely the surfaces at the keypoints belong to the joints' limbs, (P, 18) of 0..1.

    What a person holds in front of the body is slim: a surface there that goes on to both sides is a counter, a table
    or somebody's back. An arm in front of the trunk stands out from it.

    Args:
        root: (P,) depth of the trunk [m].
        covered: (P, 18) where another part of the body may be, of `covered_by_self`.
    """
    likely = np.ones(seen.known.shape)
    count = np.isfinite(seen.samples) @ _ONES
    # the median is in front where half of the samples are
    in_front = (seen.samples < (root - _OCCLUDERS.in_front)[:, None, None]) @ _ONES
    in_front = (2 * in_front >= count) & (in_front > 0)
    on_trunk = covered & _ARMS & (count > 0)
    person, joint = np.nonzero(in_front | on_trunk)
    if not len(person):
        return likely
    surface = lower_median(seen.samples[person, joint])
    beside = depths_at(points, _beside(seen, person, joint, surface)) - surface
    goes_on = (np.abs(beside[:, 1:]) < _OCCLUDERS.continues).any(axis=1).all(axis=0)
    flat = (beside[:, 0] < _OCCLUDERS.stands_out).all(axis=0)
    likely[person, joint] = np.where(goes_on & in_front[person, joint], _OCCLUDERS.furniture,
                                     np.where(flat & on_trunk[person, joint], _OCCLUDERS.flat, 1.0))
    return likely


def _beside(seen: ObservedPeople, person: np.ndarray, joint: np.ndarray, surface: np.ndarray) -> np.ndarray:
    """Return pixels beside limbs, (2 sides, 3 distances, N, 2).

    Args:
        person, joint: (N,) where limbs begin; surface: (N,) their depth [m].
    """
    here = seen.uv[person, joint]
    along = seen.uv[person, _LIMB_TO[joint]] - here
    length = np.sqrt((along * along).sum(axis=1))[:, None]
    # a limb that points at the camera, or whose other end is unknown, is taken to hang down
    along = np.where(length > _OCCLUDERS.shortest_limb, along / np.maximum(length, 1e-6), [0.0, 1.0])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) * (seen.focal / surface)[:, None]
    reach = np.array([[-1.0], [1.0]]) * _BESIDE
    return here + reach[..., None, None] * across


def _on_far_side(left: np.ndarray) -> np.ndarray:
    """Return which joints of limbs are on the side that is turned away from the camera, (P, 18) bool.

    Args:
        left: (P, 3) of any length; zero where unknown.
    """
    away = left[:, 2] / np.maximum(np.sqrt((left * left).sum(axis=1)), 1e-6)
    far = np.zeros((len(left), len(JOINTS)), bool)
    far[:, _OUTER] = _OUTER_SIDES * away[:, None] > _OCCLUDERS.turned_away
    return far
