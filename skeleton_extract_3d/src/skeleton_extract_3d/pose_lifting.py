"""Lift whole people: where each joint is along its ray, and whether it was seen."""
from typing import NamedTuple, Optional

import numpy as np

from skeleton_extract_3d import occluders, surfaces
from skeleton_extract_3d.body import (
    ADULT_STATURE,
    BONE_LENGTHS,
    ENDS,
    HEAD,
    MIDDLES,
    NECK,
    PROPORTION_SPREAD,
    ROOTS,
    SHOULDER_WIDTH,
    SHOULDERS,
    SIDES,
    STATURE_LIMITS,
    STATURE_SPREAD,
    SURFACE_OFFSETS,
    THICKNESSES,
    TRUNK,
)
from skeleton_extract_3d.depth_inference import Bones, bones_of, infer_depths, read_depths
from skeleton_extract_3d.head_pose import HeadPose, estimate_head_pose
from skeleton_extract_3d.observation import Observation
from skeleton_extract_3d.point_grid import PointGrid

# The five keypoints of a head are one opinion more than two.
_HEAD_WEIGHT = 0.6
# Where the trunk was before: standard deviation as a share, weight, and the most that it says.
_ROOT_SPREAD, _ROOT_WEIGHT, _ROOT_LIMIT = 0.10, 4.0, 9.0
# Of a stranger's trunk, the surfaces up to so far from its depth [m] tell where it is, if they are so many windows; the
# size in the image then tells the stature up to this share.
_TRUNK_REACH, _TRUNK_SUPPORT, _LOOK_SPREAD = 0.50, 2.5, 0.06
# The side of a body whose direction points away by more than this (cosine) is the far one; the surface at a joint of it
# that lies, in the picture, on another part of the body is that joint's with this likelihood.
_TURNED_AWAY, _FAR_AND_COVERED = 0.4, 0.15
# Where a joint was before says no more than this against the surfaces.
_BEFORE_LIMIT = 9.0
# A joint is measured if so much of its window supports it, ...
_LEAST_SUPPORT = 0.12
# ... nearly as much as lies in front of it, ...
_AGAINST_FRONT = 0.8
# ... and the surface is not a piece of furniture.
_LEAST_OWN = 0.05
# Samples that the middle of the head is taken from lie so near to where the surface should be [m], ...
_HEAD_AGREEMENT = 0.08
# ... and make up this share of one window.
_HEAD_SUPPORT = 0.1
# A bone outside of these shares of its length (and error of its ends [m]) has a keypoint that is elsewhere.
_SHORTEST, _LONGEST, _BONE_ERROR = 0.62, 1.45, 0.03
# Ends of limbs with a score above this are believed whatever their limb says; ...
_SURE_END = 0.6
# ... those below this not if a whole limb is folded to less than this share.
_UNSURE_END, _FOLDED = 0.5, 0.45
# The four limbs: arms fold, legs of standing people do not.
_LEGS = np.array([False, False, True, True])

_CHAINS = np.concatenate([ROOTS, MIDDLES, ENDS])


class Expectation(NamedTuple):
    """What is known of P people before looking.

    Attributes:
        root: (P,) depth of the trunk [m], NaN where unknown.
        depth: (P, 18) of the joints [m], NaN where unknown; depth_sigma: (P, 18) [m].
        left: (P, 3), see `infer_depths`; NaN where unknown.
        stature: (P,) [m]; stature_spread: (P,) as a share.
        lengths: (P, 8) of the bones [m]; length_spread: (P, 8) as a share; in the order of `body.BONES`.
    """

    root: np.ndarray
    depth: np.ndarray
    depth_sigma: np.ndarray
    left: np.ndarray
    stature: np.ndarray
    stature_spread: np.ndarray
    lengths: np.ndarray
    length_spread: np.ndarray

    @classmethod
    def of_strangers(cls, people: int) -> 'Expectation':
        """Return what is known of P people who were never seen: that they are likely adults."""
        joints = len(SURFACE_OFFSETS)
        return cls(np.full(people, np.nan), np.full((people, joints), np.nan), np.ones((people, joints)),
                   np.full((people, 3), np.nan), np.full(people, ADULT_STATURE), np.full(people, STATURE_SPREAD),
                   np.tile(BONE_LENGTHS, (people, 1)), np.full((people, len(BONE_LENGTHS)), PROPORTION_SPREAD))


class Lifted(NamedTuple):
    """P people in space, frame by frame.

    Attributes:
        xyz: (P, 18, 3) [m]; where there is no keypoint, a guess.
        surface: (P, 18, 3) [m], the skin in front of joints that were measured; NaN elsewhere.
        measured: (P, 18) bool: seen, on the person's own surface.
        plausible: (P, 18) bool: the bones that end there have possible lengths.
        sigma: (P, 18) standard deviation along the ray [m].
        left: (P, 3) unit vectors.
        root: (P,) depth of the trunk [m].
        stature: (P,) that the bones were taken to have [m].
    """

    xyz: np.ndarray
    surface: np.ndarray
    measured: np.ndarray
    plausible: np.ndarray
    sigma: np.ndarray
    left: np.ndarray
    root: np.ndarray
    stature: np.ndarray


def lift_people(seen: Observation, points: PointGrid, expected: Expectation, evidence: np.ndarray) -> Lifted:
    """Find the depth of every joint.

    Args:
        seen: the frame.
        points: as in the observation.
        expected: of the same people.
        evidence: (P, depths) what the surfaces say of the trunk's depth, of `surfaces.root_evidence`.
    """
    size = seen.size * expected.stature / ADULT_STATURE
    sized = surfaces.size_evidence(size, expected.stature_spread)
    foreign = _foreign(seen, expected, size, evidence + sized)
    if foreign is not None:
        evidence = surfaces.root_evidence(seen.depth, seen.scores, foreign)
    root = surfaces.ROOT_DEPTHS[(evidence + sized + _before(expected.root)).argmax(axis=1)]
    expected = _sized_strangers(seen, expected, root, foreign)
    scale = expected.stature / ADULT_STATURE
    head = _head(seen, root, scale)
    covered = occluders.covered_by_self(seen.uv, root, seen.focal)
    own = occluders.likely_own(points, seen.uv, seen.depth, root, covered, seen.focal)
    own = np.where(covered & _on_far_side(expected.left), own * _FAR_AND_COVERED, own)

    offsets = SURFACE_OFFSETS * scale[:, None]
    gaps = np.broadcast_to(THICKNESSES, offsets.shape) - offsets
    # the candidates of the head's joints are those of its middle
    offsets[:, HEAD], gaps[:, HEAD] = -head.surface, THICKNESSES[HEAD]
    costs = surfaces.depth_costs(seen.depth, offsets, gaps, root, seen.scores, own, covered, foreign)
    head_costs = _HEAD_WEIGHT * costs[:, HEAD].sum(axis=1)
    before = (root[:, None, None] + surfaces.DELTAS - expected.depth[..., None]) / expected.depth_sigma[..., None]
    costs += np.where(np.isfinite(before), np.minimum(before * before, _BEFORE_LIMIT), 0.0).astype(np.float32)

    bones = bones_of(expected.lengths, expected.length_spread, ~seen.known[:, _CHAINS])
    beliefs = infer_depths(costs[:, _CHAINS], head_costs, seen.rays[:, _CHAINS], head.ray, root, bones,
                           expected.stature, expected.left)
    z, sigma = np.empty(seen.known.shape), np.empty(seen.known.shape)
    z[:, _CHAINS], sigma[:, _CHAINS] = read_depths(beliefs.joints)
    middle, middle_sigma = read_depths(beliefs.head)
    z[:, _CHAINS] += root[:, None]
    z[:, NECK], sigma[:, NECK] = z[:, SHOULDERS].mean(axis=1), sigma[:, SHOULDERS].mean(axis=1)
    middle = _refined_head(seen, head, middle + root, foreign)
    z[:, HEAD], sigma[:, HEAD] = middle[:, None] + head.depths, middle_sigma[:, None]
    offsets[:, HEAD] = head.depths - head.surface
    return _measure(seen, z, sigma, offsets, own, foreign, bones, beliefs.left, root, expected.stature)


def _before(root: np.ndarray) -> np.ndarray:
    """Return the log likelihood of the trunk's depth by where it was, (P, depths)."""
    t = np.log(surfaces.ROOT_DEPTHS / np.where(np.isfinite(root), root, 1.0)[:, None]) / _ROOT_SPREAD
    return np.where(np.isfinite(root)[:, None], -0.5 * _ROOT_WEIGHT * np.minimum(t * t, _ROOT_LIMIT), 0.0)


def _sized_strangers(seen: Observation, expected: Expectation, root: np.ndarray, foreign: Optional[np.ndarray]
                     ) -> Expectation:
    """Return the expectation with strangers as large as they look at the depth of their trunk."""
    depth = seen.depth[:, TRUNK] + SURFACE_OFFSETS[TRUNK][:, None]
    with np.errstate(invalid='ignore'):
        fits = (np.abs(depth - root[:, None, None]) < _TRUNK_REACH) & seen.known[:, TRUNK, None]
    if foreign is not None:
        fits &= ~foreign[:, TRUNK]
    weights = np.where(fits, surfaces.WEIGHTS, 0.0)
    total = weights.sum(axis=(1, 2))
    middle = (weights * np.where(fits, depth, 0.0)).sum(axis=(1, 2)) / np.maximum(total, 1e-9)
    known = (total > _TRUNK_SUPPORT) & np.isfinite(seen.size)
    ratio = np.log(np.where(known, middle / seen.size, 1.0))
    # the mean of what adults are and what is seen, by their spreads
    prior, seen_precision = expected.stature_spread ** -2, _LOOK_SPREAD ** -2
    stature = ADULT_STATURE * np.exp(ratio * seen_precision / (prior + seen_precision))
    stranger = known & (expected.stature_spread >= STATURE_SPREAD)
    scale = np.where(stranger, np.clip(stature, *STATURE_LIMITS) / expected.stature, 1.0)
    return expected._replace(stature=expected.stature * scale, lengths=expected.lengths * scale[:, None])


def _on_far_side(left: np.ndarray) -> np.ndarray:
    """Return which joints of limbs are on the side that is turned away from the camera, (P, 18) bool.

    Args:
        left: (P, 3) of any length, NaN where unknown.
    """
    with np.errstate(invalid='ignore'):
        away = left[:, 2] / np.maximum(np.linalg.norm(left, axis=1), 1e-6)
        far = np.zeros((len(left), len(SURFACE_OFFSETS)), bool)
        for joints in (MIDDLES, ENDS):
            far[:, joints] = SIDES * away[:, None] > _TURNED_AWAY
    return far


def _foreign(seen: Observation, expected: Expectation, size: np.ndarray, evidence: np.ndarray) -> Optional[np.ndarray]:
    """Return which samples lie on other people, (P, 18, 25), or None."""
    if len(size) < 2:
        return None
    known = np.where(np.isfinite(expected.depth), expected.depth, expected.root[:, None])
    first = surfaces.ROOT_DEPTHS[evidence.argmax(axis=1)][:, None]
    others = occluders.others_depths(seen.uv, np.where(np.isfinite(known), known, first), seen.focal)
    # of a stranger, the size tells whether the surface may be the person's
    stranger = np.where(np.isfinite(size), size, first[:, 0])[:, None]
    return occluders.foreign_samples(seen.depth, others, np.where(np.isfinite(known), known, stranger))


def _head(seen: Observation, root: np.ndarray, scale: np.ndarray) -> HeadPose:
    """Return the heads; without a face, where the neck is."""
    left, right = SHOULDERS
    apart = (seen.rays[:, left, 0] - seen.rays[:, right, 0]) * root / (SHOULDER_WIDTH * scale)
    both = seen.known[:, left] & seen.known[:, right]
    head = estimate_head_pose(seen.known_rays, seen.scores, root, scale, np.where(both, np.clip(apart, -1, 1), 1.0))
    return head._replace(ray=np.where(head.known[:, None], head.ray, seen.rays[:, NECK]))


def _refined_head(seen: Observation, head: HeadPose, middle: np.ndarray, foreign: Optional[np.ndarray]) -> np.ndarray:
    """Return the depth of the middle of the ears by all the samples that fit, (P,) [m]."""
    depth = seen.depth[:, HEAD] - head.surface[..., None]
    with np.errstate(invalid='ignore'):
        fits = (np.abs(depth - middle[:, None, None]) < _HEAD_AGREEMENT) & seen.known[:, HEAD, None]
    if foreign is not None:
        fits &= ~foreign[:, HEAD]
    weights = np.where(fits, surfaces.WEIGHTS, 0.0)
    total = weights.sum(axis=(1, 2))
    mean = (weights * np.where(fits, depth, 0.0)).sum(axis=(1, 2)) / np.maximum(total, 1e-9)
    return np.where(total > _HEAD_SUPPORT, mean, middle)


def _measure(seen: Observation, z: np.ndarray, sigma: np.ndarray, offsets: np.ndarray, own: np.ndarray,
             foreign: Optional[np.ndarray], bones: Bones, left: np.ndarray, root: np.ndarray,
             stature: np.ndarray) -> Lifted:
    """Decide which joints were seen, and put those where their surface is."""
    weights, _ = surfaces.relative_weights(seen.depth)
    supports = surfaces.supporting_samples(seen.depth, offsets, z, foreign)
    support = (weights * supports).sum(axis=2)
    surface = (weights * np.where(supports, seen.depth, 0.0)).sum(axis=2) / np.maximum(support, 1e-9)
    with np.errstate(invalid='ignore'):
        in_front = seen.depth < (z - np.maximum(THICKNESSES, offsets))[..., None]
    measured = (seen.known & (support > _LEAST_SUPPORT) & (own > _LEAST_OWN)
                & (support >= _AGAINST_FRONT * (weights * in_front).sum(axis=2)))
    # a face that is turned away is under the head
    measured[:, HEAD] &= offsets[:, HEAD] < THICKNESSES[HEAD]
    depth = np.where(measured, surface + offsets, z)
    depth[:, HEAD] = z[:, HEAD]
    xyz = seen.rays * depth[..., None]
    plausible = _plausible(seen, xyz, bones)
    measured &= plausible
    skin = np.where(measured[..., None], seen.rays * surface[..., None], np.nan)
    return Lifted(xyz, skin, measured, plausible, sigma, left, root, stature)


def _plausible(seen: Observation, xyz: np.ndarray, bones: Bones) -> np.ndarray:
    """Return which joints end a bone of a possible length, (P, 18)."""
    plausible = np.ones(seen.known.shape, bool)
    for starts, ends, length in ((ROOTS, MIDDLES, bones.upper), (MIDDLES, ENDS, bones.lower)):
        distance = np.linalg.norm(xyz[:, starts] - xyz[:, ends], axis=2)
        possible = (distance > _SHORTEST * length) & (distance < _LONGEST * length + _BONE_ERROR)
        plausible[:, ends] = possible | ~(seen.known[:, starts] & seen.known[:, ends])
    plausible[:, ENDS] &= plausible[:, MIDDLES] | (seen.scores[:, ENDS] > _SURE_END)
    reach = np.linalg.norm(xyz[:, ROOTS] - xyz[:, ENDS], axis=2)
    folded = seen.known[:, ROOTS] & (reach < _FOLDED * (bones.upper + bones.lower))
    folded &= _LEGS | (seen.scores[:, MIDDLES] < _UNSURE_END)
    plausible[:, ENDS] &= ~(folded & (seen.scores[:, ENDS] < _UNSURE_END))
    return plausible
