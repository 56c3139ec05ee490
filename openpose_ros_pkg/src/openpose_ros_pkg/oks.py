"""Object keypoint similarity (OKS) of two poses, relative to the deviation of annotators for each joint.

COCO's measure (cocodataset.org, keypoints evaluation): exp(-d^2 / (2 area (2 sigma)^2)) for two places of a joint that
are d apart, with a sigma for each kind of joint.
"""
from dataclasses import dataclass
from typing import Dict, Tuple

import numpy as np

from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.skeletons import SkeletonModel

# Standard deviations of annotators, in units of the root of a person's area: pycocotools, cocoeval.py,
# kpt_oks_sigmas; feet: COCO-WholeBody (Jin et al., ECCV 2020). COCO has no joint on the body's midline below the head:
# those get the figure of the joints that they lie between.
_SIGMAS: Dict[str, float] = {
    'nose': .026, 'eye': .025, 'ear': .035, 'shoulder': .079, 'elbow': .072, 'wrist': .062, 'hip': .107, 'knee': .087,
    'ankle': .089, 'big_toe': .068, 'small_toe': .066, 'heel': .066, 'neck': .079, 'mid_hip': .107, 'chest': .107,
    'head_top': .035}


@dataclass(frozen=True)
class AreaConstants:
    """From the bounding box of a person's joints to the area that the person covers."""

    area_share: float = constant(
        0.53 * 1.3, 'Area of the person per area of the box: about half of a bounding box (COCO), and the box of the '
                    "joints is smaller by the head's top, hands and feet.")
    least_aspect: float = constant(
        0.4, 'Least width of the box as a share of its height: it is narrow where a person is seen from the side.')


AREA = AreaConstants()


def sigmas(skeleton: SkeletonModel) -> np.ndarray:
    """Return twice the standard deviation of each joint, (K,) float64, in units of the root of the person's area."""
    return np.array([2 * _SIGMAS[joint.replace('left_', '').replace('right_', '')] for joint in skeleton.joints])


def extent(keypoints: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the corners of the box round a person's joints.

    Args:
        keypoints: (K, 3) float, NaN where missing; one joint at least is there.

    Returns:
        The box's least and greatest x and y, (2,) each [px].
    """
    there = keypoints[np.isfinite(keypoints[:, 0]), :2]
    return there.min(axis=0), there.max(axis=0)


def area(keypoints: np.ndarray, constants: AreaConstants = AREA) -> float:
    """Return the area [px^2] that a person, (K, 3) float, covers in the image, by the box round its joints."""
    if not np.isfinite(keypoints[:, 0]).any():
        return 0.0
    low, high = extent(keypoints)
    width, height = high - low
    return constants.area_share * max(width * height, (constants.least_aspect * max(width, height)) ** 2, 1.0)


def similarity(one: np.ndarray, other: np.ndarray, joint_sigmas: np.ndarray) -> float:
    """Return how alike two poses are, 0..1, over the joints that both have, weighted by their scores.

    Args:
        one, other: (K, 3) float: x, y [px], score; NaN where missing.
        joint_sigmas: (K,) float, of `sigmas`.
    """
    both = np.isfinite(one[:, 0]) & np.isfinite(other[:, 0])
    if both.sum() < 2:
        return 0.0
    spread = 2 * max(area(one), area(other)) * joint_sigmas[both] ** 2
    alike = np.exp(-((one[both, :2] - other[both, :2]) ** 2).sum(axis=1) / spread)
    weight = np.sqrt(one[both, 2] * other[both, 2])
    return float((weight * alike).sum() / weight.sum())
