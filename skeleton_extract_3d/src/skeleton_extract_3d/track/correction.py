"""Take what a frame shows of people into their tracks."""
from dataclasses import replace
from typing import Tuple

import numpy as np

from skeleton_extract_3d.body import measures
from skeleton_extract_3d.body.body import HIPS, SHOULDERS
from skeleton_extract_3d.body.bone_constraints import satisfy_lengths
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.settings import OcclusionParams
from skeleton_extract_3d.track.completion import Completion
from skeleton_extract_3d.track.joint_filter import (
    JointFilter,
    along_rays,
    averaged_innovations,
    error_variances,
    isotropic,
    mean_innovations,
)
from skeleton_extract_3d.track.observations import Sightings
from skeleton_extract_3d.track.tracks import Tracks, middle_of_trunk

_CORRECTION = METHOD.track.correction
# Corners of the trunk.
_CORNERS = np.concatenate([SHOULDERS, HIPS])


def _trusted(people: Sightings, params: OcclusionParams) -> np.ndarray:
    """Return which joints the frame places, (N, 18) bool."""
    scores, lifted = people.observed.scores, people.lifted
    trusted = lifted.measured
    if params.occlusion:
        trusted = trusted | ((scores >= params.hidden_min_score)
                             & (lifted.plausible | (scores > _CORRECTION.sure_score)))
    return trusted & people.observed.known & (scores >= params.measured_min_score)


def correct(tracks: Tracks, people: Sightings, stamp: float, params: OcclusionParams) -> Completion:
    """Return the tracks of people with what the frame shows of them.

    Args:
        tracks: of the N people, predicted to this frame.
        people: the frame.
        stamp: [s].
    """
    lifted = people.lifted
    trusted = _trusted(people, params)
    xyz, covariance = _measured(tracks, people, trusted, params.occlusion)
    joints = _joints(tracks, xyz, covariance, trusted, stamp)
    shares, errors = joint_errors(tracks, joints, xyz, covariance, trusted & tracks.has, stamp)
    has = tracks.has | trusted
    sure = lifted.measured[:, _CORNERS].sum(axis=1) >= _CORRECTION.corners
    error = np.where(sure, _CORRECTION.root_measured, _CORRECTION.root_guessed)
    middle = middle_of_trunk(joints.position, has)
    root = tracks.root.corrected(middle[:, None], isotropic(error * np.sqrt(3))[:, None],
                                 np.ones((len(tracks), 1), bool))
    tracks = replace(
        tracks, joints=joints, root=root, errors=errors, innovations=shares, has=has,
        seen=np.where(trusted, stamp, tracks.seen), last_seen=np.full(len(tracks), stamp),
        sightings=tracks.sightings + 1, left=lifted.left,
        down=_down(tracks.down, joints.position, trusted[:, _CORNERS].all(axis=1)),
        sizes=measures.learn(tracks.sizes, lifted.xyz, lifted.measured, people.observed.scores),
        clothes=tracks.clothes.learnt(people.clothes, sure))
    sigma = np.maximum(np.sqrt(errors + _CORRECTION.body_sigma ** 2), people.size_error())
    return Completion(tracks, trusted, trusted, sigma)


def _measured(tracks: Tracks, people: Sightings, trusted: np.ndarray, bones: bool) -> Tuple[np.ndarray, np.ndarray]:
    """Return where the frame places joints, after the lengths of bones if these count, and the covariances."""
    lifted, seen = people.lifted, people.observed
    across = (_CORRECTION.across + _CORRECTION.across_by_score * (1 - np.minimum(seen.scores, 1.0)) ** 2
              + np.where(lifted.measured, 0.0, _CORRECTION.across_hidden))
    along = np.where(lifted.measured, _CORRECTION.along_measured, np.maximum(lifted.sigma, _CORRECTION.along_inferred))
    covariance = along_rays(seen.rays, across, np.maximum(along, people.size_error()))
    xyz = lifted.xyz
    if bones:
        xyz = satisfy_lengths(xyz, covariance, measures.expected_lengths(tracks.sizes),
                              measures.length_spreads(tracks.sizes), trusted)
    return xyz, covariance


def _joints(tracks: Tracks, xyz: np.ndarray, covariance: np.ndarray, trusted: np.ndarray, stamp: float) -> JointFilter:
    """Return the filters of the joints with trusted ones taken in."""
    joints = tracks.joints.corrected(xyz, covariance, trusted & tracks.has)
    joints = come_along(joints, tracks, trusted & tracks.has, stamp)
    first = trusted & ~tracks.has
    if not first.any():
        return joints
    return joints.where(first, JointFilter.moving(xyz, np.zeros_like(xyz), covariance, _CORRECTION.unknown_speed))


def joint_errors(tracks: Tracks, joints: JointFilter, xyz: np.ndarray, covariance: np.ndarray, used: np.ndarray,
                 stamp: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return the innovations (N,) and mean square errors of the joints (N, 18) [m^2] after a frame, see joint_filter.

    Joints are never known better than with independent errors.

    Args:
        joints: with what the frame shows.
        used: (N, 18) bool, joints that the frame places, and that had a place.
    """
    expected, filtered = tracks.joints.sigmas() ** 2, joints.sigmas() ** 2
    measured = np.trace(covariance, axis1=2, axis2=3)
    squares = ((xyz - tracks.joints.position) ** 2).sum(axis=2)
    new = mean_innovations(squares, tracks.errors + measured, used)
    shares = averaged_innovations(tracks.innovations, new, np.where(used.any(axis=1), stamp - tracks.last_seen, 0.0))
    gains = np.clip(1 - filtered / np.maximum(expected, 1e-12), 0.0, 1.0)
    errors = error_variances(shares, gains, tracks.errors, measured, expected)
    return shares, np.where(used, np.maximum(errors, filtered), filtered)


def come_along(joints: JointFilter, tracks: Tracks, trusted: np.ndarray, stamp: float) -> JointFilter:
    """Return the filters of N people; of who comes back in sight elsewhere, the joints that are not seen come along.

    Args:
        joints: with what the frame shows.
        tracks: before that.
        trusted: (N, 18) bool, joints that the frame places, and that had a place.
        stamp: of the frame [s].
    """
    back = np.flatnonzero((stamp - tracks.last_seen > _CORRECTION.out_of_sight) & trusted.any(axis=1))
    if not len(back):
        return joints
    position = joints.position.copy()
    for person in back:
        seen = trusted[person]
        position[person, ~seen] += np.median((position - tracks.joints.position)[person, seen], axis=0)
    return joints._replace(position=position)


def _down(before: np.ndarray, position: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the directions of trunks downwards, (N, 3), with this frame's where the corners are known, (N,) bool."""
    along = (position[:, HIPS] - position[:, SHOULDERS]).sum(axis=1)
    length = np.linalg.norm(along, axis=1, keepdims=True)
    mixed = before + _CORRECTION.down_share * (along / np.maximum(length, 1e-6) - before)
    mixed /= np.maximum(np.linalg.norm(mixed, axis=1, keepdims=True), 1e-6)
    return np.where(known[:, None] & (length > _CORRECTION.least_trunk), mixed, before)
