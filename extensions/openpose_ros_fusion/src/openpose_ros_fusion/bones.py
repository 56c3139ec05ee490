"""What is known of bodies beside what cameras measure: bones keep their lengths."""
from typing import Tuple

import numpy as np

from openpose_ros_fusion.estimate import Joints
from skeleton_extract_3d.body.bone_constraints import satisfy_lengths
from skeleton_extract_3d.body.measures import Sizes, expected_lengths, learn, length_spreads


def with_bones(sizes: Sizes, joints: Joints, measured: np.ndarray, confidence: np.ndarray
               ) -> Tuple[Sizes, np.ndarray]:
    """Return what is known of the sizes of people after a frame, and joints with bones nearer to their lengths.

    Args:
        measured: (P, 18) bool, joints by which lengths are learnt.
        confidence: (P, 18) of the keypoints.
    """
    known = np.isfinite(joints.positions).all(axis=2)
    safe = np.where(known[..., np.newaxis], joints.positions, 0.0)
    noise = np.where(known[..., np.newaxis, np.newaxis], joints.covariance, 0.0)
    sizes = learn(sizes, safe, measured & known, confidence)
    lengths, spreads = expected_lengths(sizes), length_spreads(sizes)
    moved = satisfy_lengths(safe, noise, lengths, spreads, known)
    return sizes, np.where(known[..., np.newaxis], moved, np.nan)
