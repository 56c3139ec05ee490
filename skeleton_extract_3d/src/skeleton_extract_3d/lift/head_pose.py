"""Which way a head is turned, from its keypoints, and how deep its joints and its surface lie."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.body.body import BODY, HEAD, NECK, SHOULDERS
from skeleton_extract_3d.constants import COMPILED, METHOD
from skeleton_extract_3d.lift.records import ObservedPeople

_HEAD = METHOD.head
# From the middle of the ears forwards to the nose, and from the right to the left ear [m].
_NOSE_AHEAD, _EARS_APART = BODY.head_points[0, 2], BODY.head_points[4, 0] - BODY.head_points[3, 0]


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


def heads_of(seen: ObservedPeople, root: np.ndarray, scale: np.ndarray) -> HeadPose:
    """Return the heads; without a face, where the neck is."""
    left, right = SHOULDERS
    apart = (seen.rays[:, left, 0] - seen.rays[:, right, 0]) * root / (BODY.shoulder_width * scale)
    both = seen.known[:, left] & seen.known[:, right]
    cosine = np.where(both, np.maximum(np.minimum(apart, 1.0), -1.0), 1.0)
    head = estimate_head_pose(seen.known_rays, seen.scores, root, scale, cosine)
    return head._replace(ray=np.where(head.known[:, None], head.ray, seen.rays[:, NECK]))


def left_of_heads(seen: ObservedPeople, head: HeadPose, root: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return unit vectors to the left of heads, (P, 3); zero of those that are hardly seen.

    People look where they face, more or less: a head counts as much as the trunk.
    """
    nose, _, _, right_ear, left_ear = head.depths.T / scale
    left = np.stack([-nose / _NOSE_AHEAD, np.zeros_like(nose), (left_ear - right_ear) / _EARS_APART], axis=1)
    seen_well = (seen.known[:, HEAD].sum(axis=1) >= _HEAD.least_joints) & (root / seen.focal < _HEAD.most_pixel)
    return np.where(seen_well[:, None], left, 0.0)
