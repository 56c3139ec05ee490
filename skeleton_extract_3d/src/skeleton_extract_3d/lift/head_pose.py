"""Which way a head is turned, from its keypoints, and how deep its joints and its surface lie."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.constants import COMPILED


class HeadPose(NamedTuple):
    """Heads that turn about the vertical axis of the image.

    Attributes:
        ray: (P, 3) with z = 1, to the middle of the ears.
        depths: (P, 5) of the joints in `body.HEAD` from the middle of the ears along z [m].
        surface: (P, 5) of the surface that is seen at these joints' pixels, likewise [m].
        known: (P,) whether any of the joints was found; without, ray and depths mean nothing.
    """

    ray: np.ndarray
    depths: np.ndarray
    surface: np.ndarray
    known: np.ndarray


def estimate_head_pose(rays: np.ndarray, scores: np.ndarray, root: np.ndarray, scale: np.ndarray,
                       shoulder_cosine: np.ndarray) -> HeadPose:
    """Fit a rigid head to its keypoints, seen from afar.

    Compiled (head_pose.cpp). Least squares for its place and for cosine and sine of the yaw; its surface is the front
    of an ellipsoid.

    Args:
        rays: (P, 18, 3) with z = 1, NaN where unknown.
        scores: (P, 18) of the keypoints, 0 where unknown.
        root: (P,) rough depth of the person [m].
        scale: (P,) stature in statures of an adult.
        shoulder_cosine: (P,) cosine of the yaw of the shoulders; 1 faces the camera.
    """
    return HeadPose(*COMPILED.estimate_head_pose(rays, scores, root, scale, shoulder_cosine))
