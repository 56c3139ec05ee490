"""What is known of bodies beside what cameras measure: keypoints lie beside joints, and bones keep their lengths.

A camera with depth measures a joint x at x + B b + a r, one without depth at x + B b: networks put keypoints beside the
centres of joints by an offset b that turns with the body, whose axes are the columns of B, and the depth under the skin
that a camera alone adds is too great by a along the line of sight r. Both are means over people
(`ShapeConstants.keypoints`).
"""
from typing import Tuple

import numpy as np

from openpose_ros_fusion.constants import FUSION, ShapeConstants
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body import measures
from skeleton_extract_3d.body.body import HIPS, SATISFIED_BONES, SHOULDERS
from skeleton_extract_3d.body.bone_constraints import satisfy_lengths


def _by_joint(constants: ShapeConstants) -> Tuple[np.ndarray, np.ndarray]:
    """Return the offsets along left, up and forwards, (18, 3) [m], and along the line of sight, (18,) [m]."""
    by_name = {name: np.array(values) for name, *values in constants.keypoints}
    rows = np.array([by_name[joint.replace('left_', '').replace('right_', '')] for joint in COCO_18.joints])
    rows[[joint.startswith('right_') for joint in COCO_18.joints], 0] *= -1
    return rows[:, :3], rows[:, 3]


_BESIDE, _DEEPER = _by_joint(FUSION.shape)


def body_axes(joints: np.ndarray) -> np.ndarray:
    """Return the directions left, up and forwards of bodies, the columns of (P, 3, 3); NaN where they are not known.

    Args:
        joints: (P, 18, 3) [m]; up leads from the hips to the shoulders.
    """
    shoulders, hips = joints[:, SHOULDERS], joints[:, HIPS]
    up = shoulders.mean(axis=1) - hips.mean(axis=1)
    left = shoulders[:, 0] - shoulders[:, 1]
    with np.errstate(invalid='ignore', divide='ignore'):
        up = up / np.linalg.norm(up, axis=1, keepdims=True)
        left = left - (left * up).sum(axis=1, keepdims=True) * up
        width = np.linalg.norm(left, axis=1, keepdims=True)
        left = np.where(width > FUSION.shape.least_width, left / width, np.nan)
    return np.stack([left, up, np.cross(left, up)], axis=2)


def keypoint_offsets(joints: np.ndarray) -> np.ndarray:
    """Return B b of the joints of people (P, 18, 3) [m], of the same shape; zero where the axes are not known."""
    offsets = np.matmul(_BESIDE, np.swapaxes(body_axes(joints), 1, 2))
    return np.where(np.isfinite(offsets), offsets, 0.0)


def depth_offsets(directions: np.ndarray) -> np.ndarray:
    """Return a r of joints that were seen along directions (P, 18, 3), of the same shape [m]; zero where missing."""
    offsets = _DEEPER[:, np.newaxis] * directions
    return np.where(np.isfinite(offsets), offsets, 0.0)


def with_size(joints: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return a body (18, 3) [m] whose size is nearer to what lengths (8,) [m] of its bones say, in the same pose.

    A part of the difference is corrected at a time, since noise of single frames makes bones look longer.
    """
    starts, ends, kinds = SATISFIED_BONES.T
    found = np.linalg.norm(joints[starts] - joints[ends], axis=1)
    known = np.isfinite(found)
    scale = (lengths[kinds][known].sum() / found[known].sum()) ** FUSION.shape.size_gain if known.any() else 1.0
    middle = np.nanmean(joints, axis=0)
    return middle + scale * (joints - middle)


def with_bones(sizes: measures.Sizes, positions: np.ndarray, covariance: np.ndarray, measured: np.ndarray,
               confidence: np.ndarray) -> Tuple[measures.Sizes, np.ndarray]:
    """Return what is known of the sizes of people after a frame, and joints with bones nearer to their lengths.

    Args:
        positions: (P, 18, 3) [m], NaN where unknown.
        covariance: (P, 18, 3, 3) [m^2].
        measured: (P, 18) bool, joints by which lengths are learnt.
        confidence: (P, 18) of the keypoints.
    """
    known = np.isfinite(positions).all(axis=2)
    safe = np.where(known[..., np.newaxis], positions, 0.0)
    noise = np.where(known[..., np.newaxis, np.newaxis], covariance, 0.0)
    sizes = measures.learn(sizes, safe, measured & known, confidence)
    moved = satisfy_lengths(safe, noise, measures.expected_lengths(sizes), measures.length_spreads(sizes), known)
    return sizes, np.where(known[..., np.newaxis], moved, np.nan)
