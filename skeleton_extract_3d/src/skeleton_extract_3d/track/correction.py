"""Correction of tracks with the observations of a frame."""
from dataclasses import replace
from typing import Tuple

import numpy as np

from skeleton_extract_3d.body import measures
from skeleton_extract_3d.body.body import HIPS, SHOULDERS
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.settings import OcclusionParams
from skeleton_extract_3d.track.completion import Completion
from skeleton_extract_3d.track.constants import CorrectionConstants, TrackConstants
from skeleton_extract_3d.track.joint_filter import (
    JointFilter,
    along_rays,
    averaged_innovations,
    error_variances,
    isotropic,
    mean_innovations,
    mean_squares,
)
from skeleton_extract_3d.track.tracks import Observations, Tracks, middle_of_trunk

# Corners of the trunk.
_CORNERS = np.concatenate([SHOULDERS, HIPS])


def correct(tracks: Tracks, people: Observations, stamp: float, params: OcclusionParams,
            method: MethodConstants = METHOD) -> Completion:
    """Return the tracks of people, predicted to this frame, corrected with it."""
    constants, lifted, observed = method.track.correction, people.lifted, people.observed
    trusted = lifted.measured
    if params.occlusion:
        trusted = trusted | ((observed.scores >= constants.hidden_score) & lifted.plausible)
    trusted = trusted & observed.known & (observed.scores >= constants.measured_score)
    xyz, covariance = _measured(tracks, people, trusted, params.occlusion, method)
    used = trusted & tracks.has
    joints = tracks.joints.corrected(xyz, covariance, used, method)
    joints = come_along(joints, tracks, used, stamp, method.track.identity.gap)
    first = trusted & ~tracks.has
    if first.any():
        joints = joints.where(first, JointFilter.moving(xyz, np.zeros_like(xyz), covariance, method.track.birth_speed))
    shares, errors = joint_errors(tracks, joints, (xyz, covariance), used, stamp, method.track)
    has = tracks.has | trusted
    sure = 2 * lifted.measured[:, _CORNERS].sum(axis=1) > len(_CORNERS)
    error = np.where(sure, constants.root_measured, method.track.birth_sigma)
    middle = middle_of_trunk(joints.position, has)
    root = tracks.root.corrected(middle[:, None], isotropic(error * np.sqrt(3))[:, None],
                                 np.ones((len(tracks), 1), bool), method)
    tracks = replace(
        tracks, joints=joints, root=root, errors=errors, innovations=shares, has=has,
        seen=np.where(trusted, stamp, tracks.seen), last_seen=np.full(len(tracks), stamp),
        left=lifted.left, trust=people.trust,
        down=_down(tracks.down, joints.position, trusted[:, _CORNERS].all(axis=1), constants),
        sizes=measures.with_stature(measures.learn(tracks.sizes, lifted.xyz, lifted.measured, observed.scores, method),
                                    lifted.stature, lifted.sized, method),
        clothes=tracks.clothes.learnt(people.clothes, sure | np.isnan(observed.samples).all(axis=(1, 2)), method.sizes))
    sigma = np.sqrt(errors + method.inference.keypoint_error ** 2)  # no filter takes the errors of the model away
    wide = lifted.sigma >= people.size_error  # the error by size is in it, as the lift knew no other
    sigma = np.where(wide, np.maximum(sigma, people.size_error), np.hypot(sigma, people.size_error))
    return Completion(tracks, trusted, trusted, sigma)


def _measured(tracks: Tracks, people: Observations, trusted: np.ndarray, bones: bool, method: MethodConstants
              ) -> Tuple[np.ndarray, np.ndarray]:
    """Return the positions of joints in the frame, moved towards the lengths of bones if `bones`, and covariances."""
    constants, lifted, observed = method.track.correction, people.lifted, people.observed
    across = constants.across + constants.across_by_score * (1 - np.minimum(observed.scores, 1.0)) ** 2
    across = np.hypot(across + np.where(lifted.measured, 0.0, method.inference.keypoint_error), observed.error)
    along = np.where(lifted.measured, constants.along, np.maximum(lifted.sigma, constants.along))
    covariance = along_rays(observed.rays, across, along)
    xyz = lifted.xyz
    if bones:
        xyz = method.compiled.satisfy_lengths(xyz, covariance, measures.expected_lengths(tracks.sizes, method),
                                              measures.length_spreads(tracks.sizes, method), trusted)
    return xyz, covariance


def joint_errors(tracks: Tracks, joints: JointFilter, measured: Tuple[np.ndarray, np.ndarray], used: np.ndarray,
                 stamp: float, constants: TrackConstants = METHOD.track) -> Tuple[np.ndarray, np.ndarray]:
    """Return innovations (N,) and mean square errors (N, 18) [m^2] of joints after a frame, not below independent ones.

    Args:
        tracks: before the correction; joints: corrected.
        measured: positions (N, 18, 3) [m] and covariances (N, 18, 3, 3) [m^2] in the frame.
        used: (N, 18) bool, joints that the frame places, and that had a place.
    """
    xyz, covariance = measured
    expected, filtered = tracks.joints.sigmas() ** 2, joints.sigmas() ** 2
    variance = mean_squares(covariance)
    squares = ((xyz - tracks.joints.position) ** 2).sum(axis=2)
    new = mean_innovations(squares, tracks.errors + variance, used)
    elapsed = np.where(used.any(axis=1), stamp - tracks.last_seen, 0.0)
    shares = averaged_innovations(tracks.innovations, new, elapsed, constants.correction)
    gains = np.minimum(np.maximum(1 - filtered / np.maximum(expected, 1e-12), 0.0), 1.0)
    errors = error_variances(shares, gains, tracks.errors, variance, expected, constants.correction)
    return shares, np.where(used, np.maximum(errors, filtered), filtered)


def come_along(joints: JointFilter, tracks: Tracks, trusted: np.ndarray, stamp: float,
               gap: float = METHOD.track.identity.gap) -> JointFilter:
    """Return corrected filters of tracks; after a longer time [s] without a detection, untrusted joints move with the
    (N, 18) trusted ones.
    """
    back = np.flatnonzero((stamp - tracks.last_seen > gap) & trusted.any(axis=1))
    if not len(back):
        return joints
    position = joints.position.copy()
    for person in back:
        seen = trusted[person]
        position[person, ~seen] += np.median((position - tracks.joints.position)[person, seen], axis=0)
    return joints._replace(position=position)


def _down(before: np.ndarray, position: np.ndarray, known: np.ndarray, constants: CorrectionConstants) -> np.ndarray:
    """Return the directions of trunks downwards, (N, 3), averaged with this frame's where (N,) corners are known."""
    along = (position[:, HIPS] - position[:, SHOULDERS]).sum(axis=1)
    length = np.sqrt((along * along).sum(axis=1, keepdims=True))
    mixed = before + constants.down_share * (along / np.maximum(length, 1e-6) - before)
    mixed /= np.maximum(np.sqrt((mixed * mixed).sum(axis=1, keepdims=True)), 1e-6)
    return np.where(known[:, None], mixed, before)
