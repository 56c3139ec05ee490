"""Which way a head is turned, from its keypoints, and how deep its joints and its surface lie."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d import compiled
from skeleton_extract_3d.body.body import HEAD, HEAD_AHEAD, HEAD_AXES, HEAD_POINTS, SURFACE_OFFSETS

# Error of the keypoints of a head [m].
_ERROR = 0.015
# How far the head's direction is known from the shoulders alone: standard deviations of the cosine and sine of the yaw.
_COSINE_SPREAD, _SINE_SPREAD = 0.5, 0.7


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

    Args:
        rays: (P, 18, 3) with z = 1, NaN where unknown.
        scores: (P, 18) of the keypoints, 0 where unknown.
        root: (P,) rough depth of the person [m].
        scale: (P,) stature in statures of an adult.
        shoulder_cosine: (P,) cosine of the yaw of the shoulders; 1 faces the camera.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return HeadPose(*twin.estimate_head_pose(
            rays, scores, root, scale, shoulder_cosine, joints=HEAD, points=HEAD_POINTS,
            offsets=SURFACE_OFFSETS[HEAD], axes=HEAD_AXES, ahead=HEAD_AHEAD, error=_ERROR,
            cosine_spread=_COSINE_SPREAD, sine_spread=_SINE_SPREAD))
    place = rays[:, HEAD, :2] * root[:, None, None]
    weight = np.where(np.isfinite(place[..., 0]), scores[:, HEAD], 0.0)
    place = np.where(weight[..., None] > 0, place, 0.0)
    left, down, ahead = (HEAD_POINTS.T[:, None] * scale[:, None]).reshape(3, len(rays), len(HEAD))
    # x = x0 + left cos(yaw) + ahead sin(yaw): least squares, with what the shoulders say
    terms = np.stack([np.ones_like(left), left, ahead], axis=-1)
    weighted = terms * (weight / _ERROR ** 2)[..., None]
    prior = np.array([1e-6, _COSINE_SPREAD ** -2, _SINE_SPREAD ** -2])
    right_side = (weighted * place[..., :1]).sum(axis=1)
    right_side[:, 1] += prior[1] * shoulder_cosine
    matrix = np.swapaxes(weighted, 1, 2) @ terms + np.diag(prior)
    x, cosine, sine = np.linalg.solve(matrix, right_side[..., None])[..., 0].T
    norm = np.maximum(np.hypot(cosine, sine), 1e-6)
    cosine, sine = cosine / norm, sine / norm
    total = weight.sum(axis=1)
    y = (weight * (place[..., 1] - down)).sum(axis=1) / np.maximum(total, 1e-9)
    across = left * cosine[:, None] + ahead * sine[:, None]
    depths = left * sine[:, None] - ahead * cosine[:, None]
    surface = _surface(across / scale[:, None], down / scale[:, None], cosine[:, None], sine[:, None]) * scale[:, None]
    # off the outline of the ellipsoid the joint itself is the surface
    surface = np.minimum(surface, depths - SURFACE_OFFSETS[HEAD])
    return HeadPose(np.stack([x / root, y / root, np.ones(len(rays))], axis=1), depths, surface, total > 0)


def _surface(across: np.ndarray, down: np.ndarray, cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
    """Return the depth of the front of an ellipsoid that is turned by a yaw, from the middle of the ears [m].

    Args:
        across, down: (P, 5) where, in the plane of the image [m].
        cosine, sine: (P, 1) of the yaw.
    """
    side, height, length = HEAD_AXES
    across = across - HEAD_AHEAD * sine
    # a quadratic in z: c z^2 + 2 b x z + a x^2 = level, the cross section at this height
    a = (cosine / side) ** 2 + (sine / length) ** 2
    b = cosine * sine * (side ** -2 - length ** -2)
    c = (sine / side) ** 2 + (cosine / length) ** 2
    level = np.maximum(1 - (down / height) ** 2, 0.1)
    root = np.sqrt(np.maximum((b * across) ** 2 - c * (a * across ** 2 - level), 0.0))
    return -HEAD_AHEAD * cosine - (b * across + root) / c
