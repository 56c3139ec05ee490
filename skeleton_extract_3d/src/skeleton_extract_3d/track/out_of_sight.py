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
    speed = np.linalg.norm(velocity, axis=2, keepdims=True)
    velocity = velocity * np.minimum(1.0, unseen.greatest_speed / np.maximum(speed, 1e-6))
    step, position = velocity * view.elapsed, tracks.joints.position
    walked = replace(tracks, joints=tracks.joints._replace(position=position + step))
    appears = _in_free_view(walked, view, method) & ~_in_free_view(tracks, view, method)
    step = np.where(appears[:, None, None], 0.0, step)
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
    uv, points = _pixels(tracks, view), view.points
    with np.errstate(invalid='ignore'):
        inside = ((uv > -0.5) & (uv < np.array([points.width, points.height]) - 0.5)).all(axis=2) & tracks.has
    return (_most(inside, tracks.has) & ~_in_free_view(tracks, view, method)
            & (tracks.sightings >= method.track.out_of_sight.least_sightings))


def _most(joints: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Return of which tracks most joints that there are, (N, 18) bool, are among some, (N,) bool."""
    return 2 * joints.sum(axis=1) > of.sum(axis=1)


def _in_free_view(tracks: Tracks, view: FrameView, method: MethodConstants) -> np.ndarray:
    """Return which tracks would be visible, (N,) bool."""
    uv = _pixels(tracks, view)
    depth = surfaces.depths_at(view.points, np.where(np.isfinite(uv), np.clip(uv, -1e6, 1e6), -1e6))
    with np.errstate(invalid='ignore'):
        free = (depth > tracks.joints.position[..., 2] + method.trunk.reach) & tracks.has
    return _most(free, tracks.has)


def _pixels(tracks: Tracks, view: FrameView) -> np.ndarray:
    """Return the pixels of the joints, (N, 18, 2); NaN behind the camera."""
    position = tracks.joints.position
    return view.camera.project(position.reshape(-1, 3)).reshape(*position.shape[:2], 2)
