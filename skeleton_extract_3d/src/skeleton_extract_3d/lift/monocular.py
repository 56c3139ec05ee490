"""People in space by one image: bodies that a network sees, on the rays of the keypoints.

A body is the places of the joints of COCO_18 from the middle of the hips, in the axes of the camera, as if the person
were an adult of mean stature. It is moved to where its joints are on the rays of the keypoints. The stature scales body
and distance alike: where the floor is known, the lower ankle tells it.
"""
from typing import Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.landmarks.body_landmarks import BodyLandmarks
from openpose_ros_pkg.people import values_in
from openpose_ros_pkg.skeletons import BLAZEPOSE_33, COCO_18
from skeleton_extract_3d.body.body import CHAINS, ENDS, HEAD, HIPS, NECK, SHOULDERS, TRUNK, of_all_joints
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.constants import MonocularConstants
from skeleton_extract_3d.lift.records import Expectation, Lifted, ObservedPeople
from skeleton_extract_3d.lift.robust import bones_of

_ANKLES = ENDS[2:]


def worlds_of(found: Sequence[Optional[BodyLandmarks]]) -> np.ndarray:
    """Return the bodies of P people, (P, 18, 3) float64 [m]; NaN of people whose body was not seen."""
    points = np.full((len(found), len(BLAZEPOSE_33.joints), 3), np.nan)
    for row, one in enumerate(found):
        if one is not None:
            points[row] = one.world
    bodies = values_in(points, BLAZEPOSE_33, COCO_18, np.nan)
    bodies[:, NECK] = bodies[:, SHOULDERS].mean(axis=1)
    return bodies


def lift_bodies(lifted: Lifted, observed: ObservedPeople, bodies: np.ndarray, expected: Expectation,
                view: FrameView, method: MethodConstants = METHOD) -> Lifted:
    """Return people, lifted by their sizes in the image, with those placed by bodies that have one, (P, 18, 3) [m]."""
    constants = method.monocular
    rows = np.flatnonzero(np.isfinite(bodies).all(axis=(1, 2))
                          & (observed.known.sum(axis=1) >= constants.least_joints))
    if not len(rows):
        return lifted
    placed = _placed(lifted.select(rows), observed.select(rows), bodies[rows],
                     Expectation(*(value[rows] for value in expected)), view, method)
    right = (placed.xyz[..., 2] > constants.least_depth).all(axis=1)
    values = [value.copy() for value in lifted]
    for value, new in zip(values, placed):
        value[rows[right]] = new[right]
    return Lifted(*values)


def _placed(lifted: Lifted, observed: ObservedPeople, bodies: np.ndarray, expected: Expectation, view: FrameView,
            method: MethodConstants) -> Lifted:
    """Return people placed by bodies (P, 18, 3) [m]; at `least_depth` what would be nearer."""
    constants, adult = method.monocular, method.body.adult_stature
    bodies = bodies * (constants.scale * expected.stature / adult)[:, None, None]
    bodies = bodies + _translations(bodies, observed, constants)[:, None]
    depth = np.maximum(bodies[..., 2:], constants.least_depth)
    # the keypoints tell directions better than the body does; where it is off across the view, it is so along, too
    xyz = np.where(observed.known[..., None], observed.rays * depth, bodies)
    sigma = np.hypot(constants.depth_errors, np.linalg.norm(xyz - bodies, axis=2))
    left = xyz[:, SHOULDERS[0]] - xyz[:, SHOULDERS[1]] + xyz[:, HIPS[0]] - xyz[:, HIPS[1]]
    left /= np.maximum(np.linalg.norm(left, axis=1, keepdims=True), 1e-6)
    xyz *= _with_bones(xyz / depth, depth[..., 0], sigma, left, expected, method)[..., None]
    ratio, spread, sized = _by_floor(xyz, observed, expected, view, method)
    xyz *= ratio[:, None, None]
    stature, root = ratio * expected.stature, xyz[:, TRUNK, 2].mean(axis=1)
    return lifted._replace(xyz=xyz, plausible=observed.known, sigma=sigma * (stature / adult)[:, None], left=left,
                           root=root, stature=stature, distance_error=np.hypot(spread, constants.fit_error) * root,
                           sized=sized)


def _translations(bodies: np.ndarray, observed: ObservedPeople, constants: MonocularConstants) -> np.ndarray:
    """Return the places of the middle of the hips, (P, 3) [m], at which the joints of bodies are nearest to their rays.

    The distance of a joint X from its ray (x, y, 1) is about that of (X, Y) from (x, y) Z, which is linear in the
    translation: least squares, weighted by score and again by the distances (Geman-McClure).
    """
    slopes = observed.rays[..., :2]
    # of (X, Y) - (x, y) Z by the translation, (P, 18, 2, 3)
    rows = np.concatenate([np.broadcast_to(np.eye(2), (*slopes.shape, 2)), -slopes[..., None]], axis=-1)
    off = slopes * bodies[..., 2:] - bodies[..., :2]
    weights = np.where(observed.known, observed.scores, 0.0)
    each, places = weights, np.zeros((len(bodies), 3))
    for _ in range(constants.iterations):
        weighted = each[..., None, None] * rows
        normal = np.einsum('pkai,pkaj->pij', weighted, rows) + 1e-9 * np.eye(3)
        places = np.linalg.solve(normal, np.einsum('pkai,pka->pi', weighted, off)[..., None])[..., 0]
        squares = ((np.einsum('pkai,pi->pka', rows, places) - off) ** 2).sum(axis=2)
        each = weights / (1 + squares / constants.outlier ** 2) ** 2
    return places


def _with_bones(rays: np.ndarray, depth: np.ndarray, sigma: np.ndarray, left: np.ndarray, expected: Expectation,
                method: MethodConstants) -> np.ndarray:
    """Return by what the depths (P, 18) [m] of joints change, as shares, so that bones have their lengths; as in
    `lift.robust`, with the depths of the body and their errors (P, 18) [m] in place of surfaces.
    """
    root = depth[:, TRUNK].mean(axis=1)
    costs = surfaces.with_memory(np.zeros((*depth.shape, len(method.costs.deltas)), np.float32), root,
                                 expected._replace(depth=depth, depth_sigma=sigma), method.costs)
    of_places = [np.concatenate([values[:, CHAINS], values[:, HEAD].mean(axis=1, keepdims=True)], axis=1)
                 for values in (costs, rays, depth)]
    lengths, spreads = bones_of(expected.lengths, expected.length_spread, method.inference)
    candidates, _ = method.compiled.infer_depths(*of_places[:2], root, lengths, spreads, expected.stature, left)
    change = method.compiled.read_depths(candidates)[0] + root[:, None] - of_places[2]
    return 1 + of_all_joints(change) / depth


def _by_floor(xyz: np.ndarray, observed: ObservedPeople, expected: Expectation, view: FrameView, method: MethodConstants
              ) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return by what people are larger than expected, their spread as a share, and whether the floor tells it, (P,).

    Args:
        xyz: (P, 18, 3) joints of people of the expected stature [m].
    """
    constants, spread, floor = method.monocular, expected.stature_spread, view.floor
    if floor is None:
        return np.ones(len(xyz)), spread, np.zeros(len(xyz), bool)
    height = method.track.standing.ankle_height * expected.stature / method.body.adult_stature
    ankle = xyz[:, _ANKLES]
    fall = -ankle @ floor[:3]  # [m] below the camera
    # networks put ankles out of the image at its border
    uv, border = observed.uv[:, _ANKLES], constants.border * observed.focal / np.maximum(ankle[..., 2:], 1e-3)
    inside = ((uv > border) & (uv < (view.points.width, view.points.height) - border)).all(axis=2)
    known = inside & (observed.scores[:, _ANKLES] >= constants.ankle_score) & (fall > method.track.standing.least_fall)
    # a foot that is raised seems to be farther
    ratios = np.where(known, (floor[3] - height)[:, None] / np.where(known, fall, 1.0), np.inf)
    nearest = ratios.argmin(axis=1)
    ratio, distance = ratios.min(axis=1), ankle[np.arange(len(xyz)), nearest, 2]
    least, most = method.body.stature_limits
    sized = (ratio * expected.stature > least) & (ratio * expected.stature < most)
    error = np.hypot(constants.floor_error / max(floor[3], 1e-3), constants.ankle_error / distance)
    share = np.where(sized, spread ** 2 / (spread ** 2 + error ** 2), 0.0)
    return (np.exp(share * np.log(np.where(sized, ratio, 1.0))), spread * np.sqrt(1 - share), sized)
