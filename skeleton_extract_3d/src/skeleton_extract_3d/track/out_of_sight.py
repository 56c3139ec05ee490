"""Tracks without a detection: people walk on, ever more slowly, but not to where they would be visible."""
from dataclasses import replace

import numpy as np

from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.track.joint_filter import JointFilter, isotropic
from skeleton_extract_3d.track.tracks import Tracks


def walk_on(tracks: Tracks, view: FrameView, method: MethodConstants = METHOD) -> Tracks:
    """Return the tracks without a detection, moved on as a whole; those that would become visible stay."""
    if not len(tracks):
        return tracks
    unseen, rest = method.track.out_of_sight, method.track.completion
    velocity = tracks.root.velocity * np.exp(-view.elapsed / rest.rest_time)
    speed = np.sqrt((velocity * velocity).sum(axis=2, keepdims=True))
    velocity = velocity * np.minimum(1.0, unseen.greatest_speed / np.maximum(speed, 1e-6))
    step, position = velocity * view.elapsed, tracks.joints.position
    both = np.stack([position, position + step])
    was_visible, would_be = _in_free_view(both, _pixels(both, view), tracks.has, view, method.trunk.reach)
    step = np.where((would_be & ~was_visible)[:, None, None], 0.0, step)
    away = (view.stamp - tracks.last_seen)[:, None]
    sigma = np.sqrt(rest.sigma_at_once ** 2 + (rest.sigma_growth * away) ** 2
                    + (rest.rest_sigmas * np.minimum(1.0, away)) ** 2)
    joints = JointFilter.moving(position + step, np.broadcast_to(velocity, position.shape), isotropic(sigma),
                                rest.speed)
    root = JointFilter.moving(tracks.root.position + step, velocity, isotropic(sigma.mean(axis=1, keepdims=True)),
                              rest.speed)
    return replace(tracks, joints=joints, root=root)


def hidden_and_there(tracks: Tracks, view: FrameView, method: MethodConstants = METHOD) -> np.ndarray:
    """Return which tracks without a detection are in the image and not in free view, (N,) bool."""
    if not len(tracks):
        return np.zeros(0, bool)
    position, has, points = tracks.joints.position, tracks.has, view.points
    uv = _pixels(position, view)
    inside = ((uv > -0.5) & (uv < (points.width - 0.5, points.height - 0.5))).all(axis=2) & has
    return (_most(inside, has) & ~_in_free_view(position, uv, has, view, method.trunk.reach)
            & (tracks.sightings >= method.track.out_of_sight.least_sightings))


def _most(joints: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Return of which tracks most joints that there are, (N, 18) bool, are among some, (..., N, 18) bool."""
    return 2 * joints.sum(axis=-1) > of.sum(axis=-1)


def _in_free_view(position: np.ndarray, uv: np.ndarray, has: np.ndarray, view: FrameView, reach: float) -> np.ndarray:
    """Return which tracks would be visible, (..., N) bool.

    Args:
        position, uv: (..., N, 18, 3) [m] and (..., N, 18, 2) [px], joints and their pixels.
        has: (N, 18) bool, joints that there are.
        reach: a joint is visible where the surface is further than this behind it [m].
    """
    depth = surfaces.depths_at(view.points, np.where(np.isfinite(uv), np.minimum(np.maximum(uv, -1e6), 1e6), -1e6))
    return _most((depth > position[..., 2] + reach) & has, has)


def _pixels(position: np.ndarray, view: FrameView) -> np.ndarray:
    """Return the pixels of joints (..., 3) [m], (..., 2); NaN behind the camera."""
    return view.camera.project(position.reshape(-1, 3)).reshape(*position.shape[:-1], 2)
