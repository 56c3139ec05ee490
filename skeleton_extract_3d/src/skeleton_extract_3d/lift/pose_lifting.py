"""Lift whole people: where each joint is along its ray, and whether it was seen."""
from typing import Optional, Tuple

import numpy as np

from skeleton_extract_3d import compiled
from skeleton_extract_3d.body.body import (
    ADULT_STATURE,
    ENDS,
    HEAD,
    HEAD_POINTS,
    MIDDLES,
    NECK,
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
from skeleton_extract_3d.lift import occluders, surfaces
from skeleton_extract_3d.lift.depth_inference import bones_of, infer_depths, read_depths
from skeleton_extract_3d.lift.head_pose import HeadPose, estimate_head_pose
from skeleton_extract_3d.lift.observation import ObservedPeople
from skeleton_extract_3d.lift.records import Expectation, Lifted
from skeleton_extract_3d.points.point_grid import PointGrid

# The five keypoints of a head are one opinion more than two.
_HEAD_WEIGHT = 0.6
# People look where they face, more or less: a head counts as much as the trunk, if it has so many keypoints and a
# pixel is no longer than this on it [m].
_LEAST_HEAD, _HEAD_PIXEL = 3, 0.012
# Where the trunk was before: standard deviation as a share, weight, and the most that it says.
_ROOT_SPREAD, _ROOT_WEIGHT, _ROOT_LIMIT = 0.10, 4.0, 9.0
# Of a trunk, the surfaces up to so far from its depth [m] tell where it is, if they are so many windows; the
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
_OUTER, _OUTER_SIDES = np.concatenate([MIDDLES, ENDS]), np.concatenate([SIDES, SIDES])


class RobustLifting:
    """All joints of a person together: by the surfaces, the lengths of bones and what was known before."""

    def lift(self, seen: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        """Return where the joints are; see `lifting.LiftingMethod`."""
        size = seen.adult_depth * expected.stature / ADULT_STATURE
        sized = surfaces.size_evidence(size, expected.stature_spread)
        evidence = seen.trunk_evidence
        foreign = _foreign(seen, expected, size, evidence + sized)
        if foreign is not None:
            evidence = surfaces.root_evidence(seen.samples, seen.scores, foreign)
        root = surfaces.ROOT_DEPTHS[(evidence + sized + _before(expected.root)).argmax(axis=1)]
        root, sure = _refined_root(seen, root, foreign)
        expected = _sized_strangers(seen, expected, root, sure)
        scale = expected.stature / ADULT_STATURE
        head = _head(seen, root, scale)
        left = np.where(np.isfinite(expected.left), expected.left, 0.0) + _left_of_heads(seen, head, root, scale)
        covered = occluders.covered_by_self(seen.uv, root, seen.focal)
        own = occluders.likely_own(points, seen.uv, seen.samples, root, covered, seen.focal)
        own = np.where(covered & _on_far_side(left), own * _FAR_AND_COVERED, own)

        offsets = SURFACE_OFFSETS * scale[:, None]
        gaps = THICKNESSES - offsets
        # the candidates of the head's joints are those of its middle
        offsets[:, HEAD], gaps[:, HEAD] = -head.surface, THICKNESSES[HEAD]
        costs = surfaces.depth_costs(seen.samples, offsets, gaps, root, seen.scores, own, covered, foreign)
        head_costs = _HEAD_WEIGHT * costs[:, HEAD].sum(axis=1)
        costs = with_memory(costs, root, expected.depth, expected.depth_sigma)

        bones = bones_of(expected.lengths, expected.length_spread, ~seen.known[:, _CHAINS])
        beliefs = infer_depths(costs[:, _CHAINS], head_costs, seen.rays[:, _CHAINS], head.ray, root, bones,
                               expected.stature, left)
        z, sigma = np.empty(seen.known.shape), np.empty(seen.known.shape)
        z[:, _CHAINS], sigma[:, _CHAINS] = read_depths(beliefs.joints)
        middle, middle_sigma = read_depths(beliefs.head)
        z[:, _CHAINS] += root[:, None]
        z[:, NECK], sigma[:, NECK] = z[:, SHOULDERS].sum(axis=1) / 2, sigma[:, SHOULDERS].sum(axis=1) / 2
        middle = _refined_head(seen, head, middle + root, foreign)
        z[:, HEAD], sigma[:, HEAD] = middle[:, None] + head.depths, middle_sigma[:, None]
        offsets[:, HEAD] = head.depths - head.surface
        measured = measure(seen.rays, seen.scores, seen.known, seen.samples, z, offsets, own, foreign, bones.upper,
                           bones.lower)
        return Lifted(*measured, sigma, beliefs.left, root, expected.stature)


def with_memory(costs: np.ndarray, root: np.ndarray, depth: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Return costs with those of being elsewhere than before.

    Args:
        costs: (P, 18, 45) float32, of `surfaces.depth_costs`.
        root: (P,) depth of the trunk [m].
        depth: (P, 18) where the joints are expected [m], NaN where unknown; sigma: (P, 18) [m].
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.with_memory(costs, root, depth, sigma, deltas=surfaces.DELTAS, limit=_BEFORE_LIMIT)
    off = (root[:, None, None] + surfaces.DELTAS - depth[..., None]) / sigma[..., None]
    return costs + np.where(np.isfinite(off), np.minimum(off * off, _BEFORE_LIMIT), 0.0).astype(np.float32)


def _before(root: np.ndarray) -> np.ndarray:
    """Return the log likelihood of the trunk's depth by where it was, (P, depths)."""
    t = np.log(surfaces.ROOT_DEPTHS / np.where(np.isfinite(root), root, 1.0)[:, None]) / _ROOT_SPREAD
    return np.where(np.isfinite(root)[:, None], -0.5 * _ROOT_WEIGHT * np.minimum(t * t, _ROOT_LIMIT), 0.0)


def _refined_root(seen: ObservedPeople, root: np.ndarray, foreign: Optional[np.ndarray]
                  ) -> Tuple[np.ndarray, np.ndarray]:
    """Return the depth of the trunk by the mean of its surfaces, (P,) [m], and who shows enough of it, (P,) bool."""
    offsets = np.broadcast_to(SURFACE_OFFSETS[TRUNK], (len(root), len(TRUNK)))
    middle, total = surfaces.mean_within(seen.samples, offsets, root, _TRUNK_REACH, seen.known, foreign, TRUNK)
    sure = total > _TRUNK_SUPPORT
    return np.where(sure, middle, root), sure


def _sized_strangers(seen: ObservedPeople, expected: Expectation, root: np.ndarray, sure: np.ndarray) -> Expectation:
    """Return the expectation with strangers as large as they look at the depth of their trunk, where that is sure."""
    known = sure & (expected.stature_spread >= STATURE_SPREAD) & np.isfinite(seen.adult_depth)
    ratio = np.log(np.where(known, root / seen.adult_depth, 1.0))
    # the mean of what adults are and what is seen, by their spreads
    prior, seen_precision = expected.stature_spread ** -2, _LOOK_SPREAD ** -2
    stature = ADULT_STATURE * np.exp(ratio * seen_precision / (prior + seen_precision))
    scale = np.where(known, np.clip(stature, *STATURE_LIMITS) / expected.stature, 1.0)
    return expected._replace(stature=expected.stature * scale, lengths=expected.lengths * scale[:, None])


def _left_of_heads(seen: ObservedPeople, head: HeadPose, root: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return unit vectors to the left of heads, (P, 3); zero of those that are hardly seen."""
    nose, _, _, right_ear, left_ear = head.depths.T / scale
    sine = (left_ear - right_ear) / (HEAD_POINTS[4, 0] - HEAD_POINTS[3, 0])
    left = np.stack([-nose / HEAD_POINTS[0, 2], np.zeros_like(sine), sine], axis=1)
    seen_well = (seen.known[:, HEAD].sum(axis=1) >= _LEAST_HEAD) & (root / seen.focal < _HEAD_PIXEL)
    return np.where(seen_well[:, None], left, 0.0)


def _on_far_side(left: np.ndarray) -> np.ndarray:
    """Return which joints of limbs are on the side that is turned away from the camera, (P, 18) bool.

    Args:
        left: (P, 3) of any length; zero where unknown.
    """
    away = left[:, 2] / np.maximum(np.linalg.norm(left, axis=1), 1e-6)
    far = np.zeros((len(left), len(SURFACE_OFFSETS)), bool)
    far[:, _OUTER] = _OUTER_SIDES * away[:, None] > _TURNED_AWAY
    return far


def _foreign(seen: ObservedPeople, expected: Expectation, size: np.ndarray, evidence: np.ndarray
             ) -> Optional[np.ndarray]:
    """Return which samples lie on other people, (P, 18, 25), or None."""
    if len(size) < 2:
        return None
    known = np.where(np.isfinite(expected.depth), expected.depth, expected.root[:, None])
    first = surfaces.ROOT_DEPTHS[evidence.argmax(axis=1)][:, None]
    others = occluders.others_depths(seen.uv, np.where(np.isfinite(known), known, first), seen.focal)
    # of a stranger, the size tells whether the surface may be the person's
    stranger = np.where(np.isfinite(size), size, first[:, 0])[:, None]
    return occluders.foreign_samples(seen.samples, others, np.where(np.isfinite(known), known, stranger))


def _head(seen: ObservedPeople, root: np.ndarray, scale: np.ndarray) -> HeadPose:
    """Return the heads; without a face, where the neck is."""
    left, right = SHOULDERS
    apart = (seen.rays[:, left, 0] - seen.rays[:, right, 0]) * root / (SHOULDER_WIDTH * scale)
    both = seen.known[:, left] & seen.known[:, right]
    cosine = np.where(both, np.maximum(np.minimum(apart, 1.0), -1.0), 1.0)
    head = estimate_head_pose(seen.known_rays, seen.scores, root, scale, cosine)
    return head._replace(ray=np.where(head.known[:, None], head.ray, seen.rays[:, NECK]))


def _refined_head(seen: ObservedPeople, head: HeadPose, middle: np.ndarray, foreign: Optional[np.ndarray]
                  ) -> np.ndarray:
    """Return the depth of the middle of the ears by all the samples that fit, (P,) [m]."""
    mean, total = surfaces.mean_within(seen.samples, -head.surface, middle, _HEAD_AGREEMENT, seen.known, foreign, HEAD)
    return np.where(total > _HEAD_SUPPORT, mean, middle)


def measure(rays: np.ndarray, scores: np.ndarray, known: np.ndarray, depth: np.ndarray, z: np.ndarray,
            offsets: np.ndarray, own: np.ndarray, foreign: Optional[np.ndarray], upper: np.ndarray, lower: np.ndarray
            ) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Decide which joints were seen, and put those where their surface is.

    Args:
        rays, scores, known, depth: see `ObservedPeople`.
        z: (P, 18) depths of the joints [m].
        offsets: (P, 18) depth of the joint under the surface [m].
        own: (P, 18) likelihood that the surface belongs to the person.
        foreign: (P, 18, 25) samples that are somebody else's; None: none are.
        upper, lower: (P, 4) lengths of the limbs' bones [m].

    Returns:
        xyz, surface, measured and plausible of `Lifted`.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.measure(
            rays, scores, known, depth, z, offsets, own, foreign, upper, lower, weights=surfaces.WEIGHTS,
            thicknesses=THICKNESSES, head=HEAD, chains=_CHAINS, legs=_LEGS, agreement=surfaces.AGREEMENT,
            least_support=_LEAST_SUPPORT, against_front=_AGAINST_FRONT, least_own=_LEAST_OWN, shortest=_SHORTEST,
            longest=_LONGEST, bone_error=_BONE_ERROR, sure_end=_SURE_END, unsure_end=_UNSURE_END, folded=_FOLDED)
    weights, _ = surfaces.relative_weights(depth)
    supports = surfaces.supporting_samples(depth, offsets, z, foreign)
    support = (weights * supports).sum(axis=2)
    surface = (weights * np.where(supports, depth, 0.0)).sum(axis=2) / np.maximum(support, 1e-9)
    with np.errstate(invalid='ignore'):
        in_front = depth < (z - np.maximum(THICKNESSES, offsets))[..., None]
    measured = (known & (support > _LEAST_SUPPORT) & (own > _LEAST_OWN)
                & (support >= _AGAINST_FRONT * (weights * in_front).sum(axis=2)))
    # a face that is turned away is under the head
    measured[:, HEAD] &= offsets[:, HEAD] < THICKNESSES[HEAD]
    at = np.where(measured, surface + offsets, z)
    at[:, HEAD] = z[:, HEAD]
    xyz = rays * at[..., None]
    plausible = _plausible(xyz, scores, known, upper, lower)
    measured &= plausible
    return xyz, np.where(measured[..., None], rays * surface[..., None], np.nan), measured, plausible


def _plausible(xyz: np.ndarray, scores: np.ndarray, known: np.ndarray, upper: np.ndarray, lower: np.ndarray
               ) -> np.ndarray:
    """Return which joints end a bone of a possible length, (P, 18)."""
    plausible = np.ones(known.shape, bool)
    for starts, ends, length in ((ROOTS, MIDDLES, upper), (MIDDLES, ENDS, lower)):
        distance = np.linalg.norm(xyz[:, starts] - xyz[:, ends], axis=2)
        possible = (distance > _SHORTEST * length) & (distance < _LONGEST * length + _BONE_ERROR)
        plausible[:, ends] = possible | ~(known[:, starts] & known[:, ends])
    plausible[:, ENDS] &= plausible[:, MIDDLES] | (scores[:, ENDS] > _SURE_END)
    reach = np.linalg.norm(xyz[:, ROOTS] - xyz[:, ENDS], axis=2)
    folded = known[:, ROOTS] & (reach < _FOLDED * (upper + lower))
    folded &= _LEGS | (scores[:, MIDDLES] < _UNSURE_END)
    plausible[:, ENDS] &= ~(folded & (scores[:, ENDS] < _UNSURE_END))
    return plausible
