"""Joints without a keypoint, and people without a detection: from the body model and what was seen before.

A joint stays where it was relative to the next joint towards the trunk, and drifts to where it hangs at rest; people
who are out of sight walk on ever more slowly, but not to where they would be seen.
"""
from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np

from openpose_ros_pkg.params.parameters import Parameters, parameter
from skeleton_extract_3d.body import body
from skeleton_extract_3d.body.body import ENDS, HEAD, HIPS, MIDDLES, NECK, ROOTS, SHOULDERS
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.track.joint_filter import isotropic
from skeleton_extract_3d.track.tracks import Tracks

# Error of a joint without a keypoint, beyond that of its parent: at once [m], growing [m/s], up to that of a stranger's
# joint at rest [m].
_SIGMA_AT_ONCE, _SIGMA_GROWTH = 0.04, 0.35
_REST_SIGMAS = np.zeros(len(body.JOINTS))
_REST_SIGMAS[NECK] = _REST_SIGMAS[SHOULDERS] = _REST_SIGMAS[HEAD] = 0.10
_REST_SIGMAS[HIPS] = 0.14
_REST_SIGMAS[MIDDLES] = 0.15, 0.15, 0.16, 0.16
_REST_SIGMAS[ENDS] = 0.26, 0.26, 0.24, 0.24
# Joints that are not seen hang down within about this time [s].
_REST_TIME = 0.7
# Standard deviation of the speed of what is not seen [m/s].
_SPEED = 0.5
# Where limbs hang at rest, from their parent, as shares of their length: down and outwards.
_HANGING = {'upper': np.array([[0.98, 0.10], [0.98, 0.10], [1.0, 0.0], [1.0, 0.0]]),
            'lower': np.array([[0.98, 0.0], [0.98, 0.0], [1.0, 0.0], [1.0, 0.0]])}
# People out of sight: error at once [m] and growing [m/s]; they walk on for about this time [s], at most so fast [m/s].
_HIDDEN_SIGMA, _HIDDEN_GROWTH, _WALKING_TIME, _FASTEST = 0.08, 0.45, 1.0, 2.0
# The view of a joint is free if the surface at its pixel is so far behind it [m]; of a person, if it is for more than
# this share of the joints.
_BEHIND, _FREE_SHARE = 0.35, 0.35
# Somebody who was detected in fewer frames than this, or of whom less than this share would be in the picture, is not
# reported without a detection.
_LEAST_SIGHTINGS, _LEAST_INSIDE = 3, 0.5


@dataclass(frozen=True)
class OcclusionParams(Parameters):
    """What becomes of joints that are not seen."""

    occlusion: bool = parameter(
        True, 'Tell joints that are hidden from those that are seen, and estimate them (status INFERRED). false: each '
              'joint is taken to lie on the nearest surface around its pixel and reported as MEASURED; those without '
              'a keypoint are MISSING.')
    measured_min_score: float = parameter(
        0.2, 'A keypoint with a lower score is not used, even where the surface fits it.', minimum=0.0, maximum=1.0)
    hidden_min_score: float = parameter(
        0.4, 'The keypoint of a hidden joint is used if its score is at least this; of lower ones, only the body model '
             'and the motion tell.', minimum=0.0, maximum=1.0)
    inference_timeout: float = parameter(
        5.0, 'A joint that had no keypoint for this long is MISSING.', unit='s', minimum=0.0, maximum=600.0)


def complete_joints(tracks: Tracks, rows: np.ndarray, trusted: np.ndarray, sigma: np.ndarray, stamp: float,
                    elapsed: float, params: OcclusionParams) -> np.ndarray:
    """Place the joints without a usable keypoint of people who were detected.

    Args:
        tracks: corrected with this frame.
        rows: (N,) of the people in the tracks.
        trusted: (N, 18) joints that this frame has placed.
        sigma: (T, 18) error of each joint [m]; that of the placed joints is filled in.
        stamp: [s].
        elapsed: since the frame before [s].

    Returns:
        (N, 18) which joints have a place now.
    """
    placed = trusted.copy()
    if placed.all():
        return placed
    scale = tracks.stature[rows] / body.ADULT_STATURE
    left, down = tracks.left[rows], tracks.down[rows]
    parts = _Placement(tracks, rows, placed, sigma, stamp, elapsed, params)
    position = parts.position

    sides = np.array([1.0, -1.0])[:, None]
    half = left * (scale * body.SHOULDER_WIDTH / 2)[:, None]
    if not placed[:, NECK].all():
        neck, known = _neck(position, trusted, left, down, scale)
        parts.fill(np.array([NECK]), neck[:, None], known, None)
    parts.fill(SHOULDERS, position[:, NECK, None] + sides * half[:, None], placed[:, NECK], NECK)
    half = left * (scale * body.HIP_WIDTH / 2)[:, None]
    one_hip = trusted[:, HIPS].any(axis=1)
    by_one = np.where(trusted[:, HIPS[:1]], position[:, HIPS[0]] - half, position[:, HIPS[1]] + half)
    hips = np.where(one_hip[:, None], by_one, position[:, NECK] + down * (scale * body.TRUNK_LENGTH)[:, None])
    parts.fill(HIPS, hips[:, None] + sides * half[:, None], placed[:, NECK], NECK)
    for starts, ends, lengths, hanging in ((ROOTS, MIDDLES, body.UPPER_LENGTHS, _HANGING['upper']),
                                           (MIDDLES, ENDS, body.LOWER_LENGTHS, _HANGING['lower'])):
        length = (lengths * scale[:, None])[..., None]
        rest = position[:, starts] + length * (hanging[:, :1] * down[:, None]
                                               + hanging[:, 1:] * body.SIDES[:, None] * left[:, None])
        parts.fill(ends, rest, placed[:, starts], starts)
    # without another joint of the head, it is where it was above the neck
    parts.fill(HEAD, None, placed[:, NECK], NECK)
    return placed


class _Placement:
    """Fills joints in, from the trunk outwards."""

    def __init__(self, tracks: Tracks, rows: np.ndarray, placed: np.ndarray, sigma: np.ndarray, stamp: float,
                 elapsed: float, params: OcclusionParams) -> None:
        self.position = tracks.joints.position[rows]
        self._velocity = tracks.joints.velocity[rows]
        self._tracks, self._rows, self._placed, self._sigma = tracks, rows, placed, sigma
        self._stamp, self._elapsed, self._timeout = stamp, elapsed, params.inference_timeout

    def fill(self, joints: np.ndarray, rest: Optional[np.ndarray], possible: np.ndarray, parents: Optional[np.ndarray]
             ) -> None:
        """Place joints that are not placed yet.

        Args:
            joints: (J,) which.
            rest: (N, J, 3) where they are at rest [m]; None: unknown.
            possible: (N,) or (N, J) whether rest is known, or the parent is.
            parents: (J,) or one joint that they move with; None: they move as they did.
        """
        missing = ~self._placed[:, joints]
        if not missing.any():
            return
        tracks, rows = self._tracks, self._rows
        had = tracks.has[rows][:, joints]
        age = self._stamp - np.where(had, tracks.seen[rows][:, joints], tracks.born[rows][:, None])
        possible = possible if possible.ndim == 2 else possible[:, None]
        able = had if rest is None else had | possible
        fill = missing & able & (age <= self._timeout)
        if not fill.any():
            return
        position, velocity = self.position[:, joints], self._velocity[:, joints]
        if parents is None:
            moved, parent_sigma = position, 0.10
        else:
            parents = parents + np.zeros_like(joints)
            of_parent = self._velocity[:, parents]
            moved = position + (of_parent - velocity) * self._elapsed
            velocity = of_parent
            parent_sigma = self._sigma[rows][:, parents]
        if rest is None:
            new = moved
        else:
            share = 1 - np.exp(-self._elapsed / _REST_TIME)
            towards = np.where(possible[..., None], moved + (rest - moved) * share, moved)
            new = np.where(had[..., None], towards, rest)
        most = _REST_SIGMAS[joints]
        growing = np.where(had, np.minimum(_SIGMA_AT_ONCE + _SIGMA_GROWTH * age, most), most)
        sigma = np.sqrt(growing ** 2 + parent_sigma ** 2)
        person, which = np.nonzero(fill)
        self.position[person, joints[which]], self._velocity[person, joints[which]] = new[fill], velocity[fill]
        self._placed[person, joints[which]] = True
        self._sigma[rows[person], joints[which]] = sigma[fill]
        tracks.joints.place(rows[person], joints[which], new[fill], velocity[fill], isotropic(sigma[fill]), _SPEED)
        fresh = fill & ~had
        person, which = np.nonzero(fresh)
        tracks.has[rows[person], joints[which]] = True
        tracks.seen[rows[person], joints[which]] = tracks.born[rows[person]]


def _neck(position: np.ndarray, trusted: np.ndarray, left: np.ndarray, down: np.ndarray, scale: np.ndarray
          ) -> Tuple[np.ndarray, np.ndarray]:
    """Return where the neck is by shoulders, hips or head, (N, 3) [m], and whose is known, (N,)."""
    half = left * (scale * body.SHOULDER_WIDTH / 2)[:, None]
    both, any_shoulder = trusted[:, SHOULDERS].all(axis=1), trusted[:, SHOULDERS].any(axis=1)
    by_one = np.where(trusted[:, SHOULDERS[:1]], position[:, SHOULDERS[0]] - half, position[:, SHOULDERS[1]] + half)
    middle = np.where(both[:, None], position[:, SHOULDERS].mean(axis=1), by_one)
    both_hips = trusted[:, HIPS].all(axis=1)
    of_hips = position[:, HIPS].mean(axis=1) - down * (scale * body.TRUNK_LENGTH)[:, None]
    of_head, head_known = _neck_by_head(position, trusted, left, down, scale)
    neck = np.where(any_shoulder[:, None], middle, np.where(both_hips[:, None], of_hips, of_head))
    return neck, any_shoulder | both_hips | head_known


def _neck_by_head(position: np.ndarray, trusted: np.ndarray, left: np.ndarray, down: np.ndarray, scale: np.ndarray
                  ) -> Tuple[np.ndarray, np.ndarray]:
    """Return where the neck is under the known joints of the head, (N, 3) [m], and of whom there are any, (N,)."""
    forward = np.cross(left, -down)
    axes = np.stack([left, down, forward], axis=1)
    known = trusted[:, HEAD]
    offsets = body.HEAD_POINTS @ axes * scale[:, None, None]
    middle = np.where(known[..., None], position[:, HEAD] - offsets, 0.0).sum(axis=1)
    middle = middle / np.maximum(known.sum(axis=1), 1)[:, None]
    return middle + down * (scale * body.NECK_TO_HEAD)[:, None], known.any(axis=1)


def move_unseen(tracks: Tracks, rows: np.ndarray, sigma: np.ndarray, points: PointGrid, camera: CameraModel,
                stamp: float, elapsed: float) -> None:
    """Move people who were not detected on as a whole; those who would be seen at the new place stay.

    Args:
        tracks: predicted to this frame.
        rows: (N,) of these people.
        sigma: (T, 18) error of each joint [m]; filled in.
    """
    velocity = tracks.root.velocity[rows, 0] * np.exp(-elapsed / _WALKING_TIME)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    velocity *= np.minimum(1.0, _FASTEST / np.maximum(speed, 1e-6))
    before = tracks.joints.position[rows] - tracks.joints.velocity[rows] * elapsed
    after = before + velocity[:, None] * elapsed
    leaves = ((_free_share(after, tracks.has[rows], points, camera) > _FREE_SHARE)
              & (_free_share(before, tracks.has[rows], points, camera) <= _FREE_SHARE))
    position = np.where(leaves[:, None, None], before, after)
    age = (stamp - tracks.last_seen[rows])[:, None]
    error = np.sqrt(_HIDDEN_SIGMA ** 2 + (_HIDDEN_GROWTH * age) ** 2 + (_REST_SIGMAS * np.minimum(1.0, age)) ** 2)
    joints = tracks.has.shape[1]
    track, joint = np.repeat(rows, joints), np.tile(np.arange(joints), len(rows))
    sigma[rows] = error
    tracks.joints.place(track, joint, position.reshape(-1, 3), np.repeat(velocity, joints, axis=0),
                        isotropic(error.ravel()), _SPEED)
    shift = (position - before).mean(axis=1)
    root = tracks.root.position[rows, 0] - tracks.root.velocity[rows, 0] * elapsed + shift
    tracks.root.place(rows, np.zeros_like(rows), root, velocity, isotropic(error.mean(axis=1)), _SPEED)


def hidden_and_there(tracks: Tracks, rows: np.ndarray, points: PointGrid, camera: CameraModel) -> np.ndarray:
    """Return who of those not detected is in the picture, behind something or where it could not be seen, (N,) bool."""
    position, has = tracks.joints.position[rows], tracks.has[rows]
    inside = _inside(_project(position, camera), points) & has
    there = inside.sum(axis=1) >= _LEAST_INSIDE * np.maximum(has.sum(axis=1), 1)
    return (there & (_free_share(position, has, points, camera) <= _FREE_SHARE)
            & (tracks.sightings[rows] >= _LEAST_SIGHTINGS))


def _project(position: np.ndarray, camera: CameraModel) -> np.ndarray:
    """Return the pixels of (N, 18, 3) points, (N, 18, 2); NaN behind the camera."""
    return camera.project(position.reshape(-1, 3)).reshape(*position.shape[:2], 2)


def _inside(uv: np.ndarray, points: PointGrid) -> np.ndarray:
    with np.errstate(invalid='ignore'):
        return ((uv > -0.5) & (uv < np.array([points.width, points.height]) - 0.5)).all(axis=2)


def _free_share(position: np.ndarray, has: np.ndarray, points: PointGrid, camera: CameraModel) -> np.ndarray:
    """Return the share of the joints whose view is free, (N,)."""
    uv = _project(position, camera)
    depth = surfaces.depths_at(points, np.where(np.isfinite(uv), np.clip(uv, -1e6, 1e6), -1e6))
    with np.errstate(invalid='ignore'):
        free = (depth > position[..., 2] + _BEHIND) & has
    return free.sum(axis=1) / np.maximum(has.sum(axis=1), 1)
