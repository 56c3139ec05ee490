"""Lift whole people: where each joint is along its ray, and whether it was seen."""
from typing import Optional, Tuple

import numpy as np

from skeleton_extract_3d.body.body import HEAD, NECK, SHOULDERS, TRUNK
from skeleton_extract_3d.constants import COMPILED, METHOD
from skeleton_extract_3d.lift import occluders, surfaces
from skeleton_extract_3d.lift.depth_inference import CHAINS, bones_of, infer_depths, read_depths
from skeleton_extract_3d.lift.head_pose import HeadPose, heads_of, left_of_heads
from skeleton_extract_3d.lift.records import Expectation, Lifted, ObservedPeople
from skeleton_extract_3d.points.point_grid import PointGrid

_BODY, _TRUNK, _HEAD = METHOD.body, METHOD.trunk, METHOD.head
_SURFACE_OFFSETS, _THICKNESSES = _BODY.surface_offsets, _BODY.thicknesses


class RobustLifting:
    """All joints of a person together: by the surfaces, the lengths of bones and what was known before."""

    @np.errstate(invalid='ignore')  # samples, and depths before, are NaN where missing
    def lift(self, seen: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        """Return where the joints are; see `lifting.LiftingMethod`."""
        root, sure, foreign = _trunk(seen, expected)
        expected = expected.with_sizes(seen, root, sure)
        scale = expected.stature / _BODY.adult_stature
        head = heads_of(seen, root, scale)
        left = np.where(np.isfinite(expected.left), expected.left, 0.0) + left_of_heads(seen, head, root, scale)
        ownership = occluders.ownership(points, seen, root, left, foreign)

        offsets = _SURFACE_OFFSETS * scale[:, None]
        gaps = _THICKNESSES - offsets
        # the candidates of the head's joints are those of its middle
        offsets[:, HEAD], gaps[:, HEAD] = -head.surface, _THICKNESSES[HEAD]
        costs = surfaces.depth_costs(seen, root, offsets, gaps, ownership)
        head_costs = _HEAD.weight * costs[:, HEAD].sum(axis=1)
        costs = surfaces.with_memory(costs, root, expected)[:, CHAINS]

        bones = bones_of(expected.lengths, expected.length_spread, ~seen.known[:, CHAINS])
        beliefs = infer_depths(np.concatenate([costs, head_costs[:, None]], axis=1),
                               np.concatenate([seen.rays[:, CHAINS], head.ray[:, None]], axis=1), root, bones,
                               expected.stature, left)
        depth, deviation = read_depths(beliefs.costs)
        depth += root[:, None]
        z, sigma = np.empty(seen.known.shape), np.empty(seen.known.shape)
        z[:, CHAINS], sigma[:, CHAINS] = depth[:, :-1], deviation[:, :-1]
        z[:, NECK], sigma[:, NECK] = z[:, SHOULDERS].sum(axis=1) / 2, sigma[:, SHOULDERS].sum(axis=1) / 2
        middle = _refined_head(seen, head, depth[:, -1], foreign)
        z[:, HEAD], sigma[:, HEAD] = middle[:, None] + head.depths, deviation[:, -1:]
        offsets[:, HEAD] = head.depths - head.surface
        # which joints were seen, and those where their surface is; compiled (measuring.cpp)
        xyz, surface, measured, plausible = COMPILED.measure(
            (seen.rays, seen.scores, seen.known, seen.samples), z, offsets, ownership.own, ownership.foreign,
            bones.lengths[:, :8])
        return Lifted(xyz, surface, measured, plausible, sigma, beliefs.left, root, expected.stature, beliefs.costs)


def _trunk(seen: ObservedPeople, expected: Expectation) -> Tuple[np.ndarray, np.ndarray, Optional[np.ndarray]]:
    """Return the depth of the trunk, (P,) [m], who shows enough of it, (P,) bool, and the samples on other people."""
    size = seen.adult_depth * expected.stature / _BODY.adult_stature
    sized = surfaces.size_evidence(size, expected.stature_spread)
    evidence = seen.trunk_evidence + sized
    foreign = _foreign(seen, expected, size, evidence)
    if foreign is not None:
        evidence = surfaces.root_evidence(seen.samples, seen.scores, foreign) + sized
    root = surfaces.ROOT_DEPTHS[(evidence + _before(expected.root)).argmax(axis=1)]
    # the mean of the surfaces of the trunk
    middle, total = surfaces.mean_within(seen, foreign, TRUNK, _SURFACE_OFFSETS[TRUNK], root, _TRUNK.support_reach)
    sure = total > _TRUNK.least_support
    return np.where(sure, middle, root), sure, foreign


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


def _before(root: np.ndarray) -> np.ndarray:
    """Return the log likelihood of the trunk's depth by where it was, (P, depths)."""
    known = np.isfinite(root)[:, None]
    off = np.log(surfaces.ROOT_DEPTHS / np.where(known, root[:, None], 1.0)) / _TRUNK.before_spread
    return known * (-0.5 * _TRUNK.before_weight) * np.minimum(off * off, _TRUNK.before_limit)


def _refined_head(seen: ObservedPeople, head: HeadPose, middle: np.ndarray, foreign: Optional[np.ndarray]
                  ) -> np.ndarray:
    """Return the depth of the middle of the ears by all the samples that fit, (P,) [m]."""
    mean, total = surfaces.mean_within(seen, foreign, HEAD, -head.surface, middle, _HEAD.agreement)
    return np.where(total > _HEAD.least_support, mean, middle)
