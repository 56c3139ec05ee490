"""People without a detection: they walk on ever more slowly, but not to where they would be seen."""
from dataclasses import replace

import numpy as np

from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.frame import View
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.track.joint_filter import JointFilter, isotropic
from skeleton_extract_3d.track.tracks import Tracks

_UNSEEN, _COMPLETION = METHOD.track.out_of_sight, METHOD.track.completion

def walk_on(tracks: Tracks, view: View) -> Tracks:
    """Return the tracks of people who were not detected, moved on as a whole; who would be seen there stays.

    Args:
        tracks: of N people, as the frame before left them.
        view: the frame.
    """
    velocity = tracks.root.velocity * np.exp(-view.elapsed / _UNSEEN.walking_time)
    speed = np.linalg.norm(velocity, axis=2, keepdims=True)
    velocity = velocity * np.minimum(1.0, _UNSEEN.greatest_speed / np.maximum(speed, 1e-6))
    step, position = velocity * view.elapsed, tracks.joints.position
    walked = replace(tracks, joints=tracks.joints._replace(position=position + step))
    appears = _in_free_view(walked, view) & ~_in_free_view(tracks, view)
    step = np.where(appears[:, None, None], 0.0, step)
    unseen = (view.stamp - tracks.last_seen)[:, None]
    sigma = np.sqrt(_UNSEEN.sigma_at_once ** 2 + (_UNSEEN.sigma_growth * unseen) ** 2
                    + (_COMPLETION.rest_sigmas * np.minimum(1.0, unseen)) ** 2)
    joints = JointFilter.moving(position + step, np.broadcast_to(velocity, position.shape), isotropic(sigma),
                                _COMPLETION.speed)
    root = JointFilter.moving(tracks.root.position + step, velocity, isotropic(sigma.mean(axis=1, keepdims=True)),
                              _COMPLETION.speed)
    return replace(tracks, joints=joints, root=root)


def hidden_and_there(tracks: Tracks, view: View) -> np.ndarray:
    """Return who of those not detected is in the image, behind something or where no depth tells, (N,) bool."""
    uv, points = _pixels(tracks, view), view.points
    with np.errstate(invalid='ignore'):
        inside = ((uv > -0.5) & (uv < np.array([points.width, points.height]) - 0.5)).all(axis=2) & tracks.has
    share = inside.sum(axis=1) / np.maximum(tracks.has.sum(axis=1), 1)
    return ((share >= _UNSEEN.least_inside) & ~_in_free_view(tracks, view)
            & (tracks.sightings >= _UNSEEN.least_sightings))


def _in_free_view(tracks: Tracks, view: View) -> np.ndarray:
    """Return who would be seen, (N,) bool."""
    uv = _pixels(tracks, view)
    depth = surfaces.depths_at(view.points, np.where(np.isfinite(uv), np.clip(uv, -1e6, 1e6), -1e6))
    with np.errstate(invalid='ignore'):
        free = (depth > tracks.joints.position[..., 2] + _UNSEEN.behind) & tracks.has
    return free.sum(axis=1) / np.maximum(tracks.has.sum(axis=1), 1) > _UNSEEN.free_share


def _pixels(tracks: Tracks, view: View) -> np.ndarray:
    """Return the pixels of the joints, (N, 18, 2); NaN behind the camera."""
    position = tracks.joints.position
    return view.camera.project(position.reshape(-1, 3)).reshape(*position.shape[:2], 2)
