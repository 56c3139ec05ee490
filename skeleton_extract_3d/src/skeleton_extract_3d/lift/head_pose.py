"""The turn of a head, from its keypoints, and the depths of its joints and its surface."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.body.body import HEAD, NECK, SHOULDERS
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.records import ObservedPeople


class HeadPose(NamedTuple):
    """Heads that turn about the vertical axis of the image.

    Attributes:
        ray: (P, 3) with z = 1, to the middle of the ears.
        depths: (P, 5) of the joints in `body.HEAD` from the middle of the ears along z [m].
        surface: (P, 5) of the surface that is seen at these joints' pixels, likewise [m].
        known: (P,) whether any of the joints has a keypoint; ray and depths mean nothing without.
    """

    ray: np.ndarray
    depths: np.ndarray
    surface: np.ndarray
    known: np.ndarray


def heads_of(observed: ObservedPeople, root: np.ndarray, scale: np.ndarray, method: MethodConstants = METHOD
             ) -> HeadPose:
    """Return rigid heads fitted to their keypoints; without one, where the neck is; compiled (head_pose.cpp).

    Args:
        root: (P,) rough depth of the person [m].
        scale: (P,) stature in statures of an adult.
    """
    left, right = SHOULDERS
    apart = (observed.rays[:, left, 0] - observed.rays[:, right, 0]) * root / (method.body.shoulder_width * scale)
    both = observed.known[:, left] & observed.known[:, right]
    cosine = np.where(both, np.maximum(np.minimum(apart, 1.0), -1.0), 1.0)
    rays = np.where(observed.known[..., None], observed.rays, np.nan)
    head = HeadPose(*method.compiled.estimate_head_pose(rays, observed.scores, root, scale, cosine))
    return head._replace(ray=np.where(head.known[:, None], head.ray, observed.rays[:, NECK]))


def left_of_heads(observed: ObservedPeople, head: HeadPose, root: np.ndarray, scale: np.ndarray,
                  method: MethodConstants = METHOD) -> np.ndarray:
    """Return unit vectors to the left of heads, (P, 3); zero of those with few keypoints, or small in the image."""
    constants, points = method.head, method.body.head_points
    nose, _, _, right_ear, left_ear = head.depths.T / scale
    # from the middle of the ears forwards to the nose, and from the right to the left ear [m]
    nose_ahead, ears_apart = points[0, 2], points[4, 0] - points[3, 0]
    left = np.stack([-nose / nose_ahead, np.zeros_like(nose), (left_ear - right_ear) / ears_apart], axis=1)
    visible = ((2 * observed.known[:, HEAD].sum(axis=1) > len(HEAD))
               & (root / observed.focal < constants.most_pixel))
    return np.where(visible[:, None], left, 0.0)
