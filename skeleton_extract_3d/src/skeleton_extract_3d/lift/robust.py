"""Lift whole people: the depth of each joint along its ray, and whether it is visible."""
from typing import Optional, Tuple

import numpy as np

from skeleton_extract_3d.body.body import (
    CHAINS,
    HEAD,
    LOWER_KINDS,
    PAIR_KINDS,
    TRUNK,
    UPPER_KINDS,
    bone_kinds,
    of_all_joints,
)
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift import occluders, surfaces
from skeleton_extract_3d.lift.constants import InferenceConstants
from skeleton_extract_3d.lift.head_pose import HeadPose, heads_of, left_of_heads
from skeleton_extract_3d.lift.records import Expectation, Lifted, ObservedPeople
from skeleton_extract_3d.points.point_grid import PointGrid

_KINDS = np.concatenate([UPPER_KINDS, LOWER_KINDS, PAIR_KINDS, bone_kinds('trunk', 'head')])


def lift_robustly(observed: ObservedPeople, points: PointGrid, expected: Expectation, method: MethodConstants = METHOD
                  ) -> Lifted:
    """Return where the joints are, all of a person together: by the surfaces, the lengths of bones and the expectation.

    Depths are inferred in pictorial structures (Felzenszwalb and Huttenlocher, IJCV 2005), with the depth along each
    keypoint's ray in place of a place in the image; see docs/method.md, section 3. Costs are -2 log likelihood. The
    min-marginal of a candidate is the cost of the cheapest depths of all thirteen places that go through it.
    """
    root, sure, foreign = _trunk(observed, expected, method)
    expected = expected.with_sizes(observed, root, sure, method)
    scale = expected.stature / method.body.adult_stature
    head = heads_of(observed, root, scale, method)
    left = (np.where(np.isfinite(expected.left), expected.left, 0.0)
            + left_of_heads(observed, head, root, scale, method))
    own, covered = occluders.ownership(points, observed, root, left, method)

    # depths of joints under their surface; the candidates of the joints of the head are those of its middle
    thicknesses = method.body.thickness
    offsets = method.body.under_skin * scale[:, None]
    gaps = thicknesses - offsets
    offsets[:, HEAD], gaps[:, HEAD] = -head.surface, thicknesses[HEAD]
    costs = method.compiled.depth_costs(observed.samples, observed.scores, root, offsets, gaps, own, covered, foreign)
    head_costs = costs[:, HEAD].sum(axis=1)
    costs = surfaces.with_memory(costs, root, expected, method.costs)[:, CHAINS]

    lengths, sigmas = bones_of(expected.lengths, expected.length_spread, method.inference)
    candidates, left = method.compiled.infer_depths(
        np.concatenate([costs, head_costs[:, None]], axis=1),
        np.concatenate([observed.rays[:, CHAINS], head.ray[:, None]], axis=1), root, lengths, sigmas, expected.stature,
        left)
    depth, deviation = method.compiled.read_depths(candidates)
    depth = depth + root[:, None]
    middle = _refined_head(observed, head, depth[:, -1], foreign, method)
    z, sigma = of_all_joints(depth), of_all_joints(deviation)
    z[:, HEAD] = middle[:, None] + head.depths
    offsets[:, HEAD] = head.depths - head.surface
    # visible joints are put where their surface is; compiled (measuring.cpp)
    xyz, measured, plausible = method.compiled.measure(
        (observed.rays, observed.scores, observed.known, observed.samples), z, offsets, foreign,
        lengths[:, :8])
    distance_error = method.body.stature_spread * root
    sigma = np.where(measured.any(axis=1)[:, None], sigma, np.maximum(sigma, distance_error[:, None]))
    return Lifted(xyz, measured, plausible, sigma, left, root, expected.stature, distance_error,
                  np.zeros(len(root), bool), candidates)


def bones_of(lengths: np.ndarray, spread: np.ndarray, constants: InferenceConstants = METHOD.inference
             ) -> Tuple[np.ndarray, np.ndarray]:
    """Return lengths and standard deviations (P, 12) float32 [m] of the upper and the lower bones of the limbs,
    shoulders, hips, trunk, neck to head; by lengths [m] and spreads, as shares, (P, 8) in the order of `body.BONES`.
    """
    sigmas = np.sqrt((spread * lengths) ** 2 + constants.keypoint_error ** 2)[:, _KINDS]
    sigmas[:, 11] += constants.keypoint_error
    return lengths[:, _KINDS].astype(np.float32), sigmas.astype(np.float32)


def _trunk(observed: ObservedPeople, expected: Expectation, method: MethodConstants
           ) -> Tuple[np.ndarray, np.ndarray, Optional[np.ndarray]]:
    """Return the depth of the trunk, (P,) [m], whether it is sure, (P,) bool, and the samples that are not on the body.
    """
    trunk = method.trunk
    size = observed.adult_depth * expected.stature / method.body.adult_stature
    sized = surfaces.size_evidence(size, expected.stature_spread, method)
    evidence = observed.trunk_evidence + sized
    foreign = _foreign(observed, expected, size, trunk.depths[evidence.argmax(axis=1)], method)
    if observed.detached.any():
        foreign = observed.detached if foreign is None else foreign | observed.detached
    if foreign is not None:
        beside = foreign.any(axis=(1, 2))
        evidence[beside] = sized[beside] + method.compiled.root_evidence(
            observed.samples[beside], observed.scores[beside], foreign[beside])
    root = trunk.depths[evidence.argmax(axis=1)]
    # the mean of the surfaces of the trunk
    offsets = method.body.under_skin[TRUNK]
    off = observed.samples[:, TRUNK] + (offsets - root[:, None])[..., None]
    mean, total = surfaces.mean_within(off, _own(observed, foreign, TRUNK), method.trunk.reach,
                                       method.windows.weights)
    sure = 2 * total > len(TRUNK)  # of most windows
    return np.where(sure, root + mean, root), sure, foreign


def _own(observed: ObservedPeople, foreign: Optional[np.ndarray], joints: np.ndarray) -> np.ndarray:
    """Return which samples of some joints, (P, J, 25) bool, are of joints with a keypoint and not on other people."""
    known = np.broadcast_to(observed.known[:, joints, None], observed.samples[:, joints].shape)
    return known if foreign is None else known & ~foreign[:, joints]


def _foreign(observed: ObservedPeople, expected: Expectation, size: np.ndarray, first: np.ndarray,
             method: MethodConstants) -> Optional[np.ndarray]:
    """Return which samples lie on other people, (P, 18, 25), or None; `first`: (P,) likeliest depths [m]."""
    if len(size) < 2:
        return None
    known = np.where(np.isfinite(expected.depth), expected.depth, expected.root[:, None])
    depths = np.where(np.isfinite(known), known, first[:, None])
    others = method.compiled.others_depths(observed.uv, depths, observed.focal)
    # without a track, the size tells whether the surface may be the person's
    new = np.where(np.isfinite(size), size, first)[:, None]
    return occluders.foreign_samples(observed.samples, others, np.where(np.isfinite(known), known, new),
                                     method.occluders)


def _refined_head(observed: ObservedPeople, head: HeadPose, middle: np.ndarray, foreign: Optional[np.ndarray],
                  method: MethodConstants) -> np.ndarray:
    """Return the depth of the middle of the ears by all the samples that fit, (P,) [m]."""
    off = observed.samples[:, HEAD] + (-head.surface - middle[:, None])[..., None]
    mean, total = surfaces.mean_within(off, _own(observed, foreign, HEAD), method.measuring.agreement,
                                       method.windows.weights)
    return np.where(total > method.measuring.least_support, middle + mean, middle)
