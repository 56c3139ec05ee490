"""Tracks with what the cameras measured of them in a frame."""
from dataclasses import replace
from typing import NamedTuple, Tuple

import numpy as np

from openpose_ros_fusion.association import Matches
from openpose_ros_fusion.constants import FusionConstants
from openpose_ros_fusion.estimate import Joints, Measurements, Prediction, estimate_joints, joint_errors
from openpose_ros_fusion.observations import KeypointOffsets
from openpose_ros_fusion.tracks import Tracks
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.bone_constraints import satisfy_lengths
from skeleton_extract_3d.body.measures import Sizes, expected_lengths, learn, length_spreads
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING

_JOINTS = len(COCO_18.joints)


class FusedJoints(NamedTuple):
    """What a frame tells of the joints of F people.

    Attributes:
        status: (F, 18) uint8.
        confidence: (F, 18).
        variance: (F, 18), mean over the axes [m^2].
    """

    status: np.ndarray
    confidence: np.ndarray
    variance: np.ndarray


class _Views(NamedTuple):
    """How the cameras see F people."""

    cameras: np.ndarray      # (F,) int
    measured_by: np.ndarray  # (F, 18) int, cameras that measure a joint; one with depth counts as two
    with_depth: np.ndarray   # (F, 18) bool, whether one with depth measures or infers it
    confidence: np.ndarray   # (F, 18), the greatest


class Correction:
    """Takes what the cameras measured into the tracks."""

    def __init__(self, constants: FusionConstants) -> None:
        self._constants, self._offsets = constants, KeypointOffsets(constants.shape)

    def corrected(self, tracks: Tracks, matches: Matches) -> Tuple[Tracks, FusedJoints]:
        """Return the tracks after a frame, and what that tells of their joints."""
        views, expected = _views(matches), _prediction(tracks)
        measured = self._measurements(tracks, matches, views, self._offsets.of_bodies(tracks.positions))
        joints = estimate_joints(len(tracks), Measurements.joined([expected.measurements, measured]),
                                 self._constants.estimate)
        errors = joint_errors(measured, joints, expected, views.with_depth, self._constants.estimate)
        sizes, positions = with_bones(tracks.sizes, joints, views.measured_by >= 2, views.confidence)
        # bones would be bent along the rays of a camera that is alone and measures no depth
        positions = np.where((matches.views == 1)[:, np.newaxis, np.newaxis], joints.positions, positions)
        after = tracks.corrected(positions, errors.filtered, errors.independent, self._constants.motion)
        after = replace(after, sizes=sizes, variance=errors.variance, innovations=errors.innovations,
                        seen=np.where(views.cameras > 0, tracks.stamp, after.seen),
                        cameras=np.maximum(after.cameras, views.cameras))
        known = np.isfinite(positions).all(axis=2)
        status = np.where(known, np.where(views.measured_by >= 2, MEASURED, INFERRED), MISSING).astype(np.uint8)
        return after, FusedJoints(status, views.confidence, errors.variance)

    def _measurements(self, tracks: Tracks, matches: Matches, views: _Views, beside: np.ndarray) -> Measurements:
        """Return what cameras measured of joints, at the tracks' stamp; keypoints lie `beside` them, (F, 18, 3) [m]."""
        constants, assumed = self._constants, tracks.assumed_positions
        parts = [Measurements(np.zeros(0, np.int64), np.zeros((0, _JOINTS, 3)), np.zeros((0, _JOINTS, 3, 3)))]
        for sighting, rows in matches.pairs:
            people = np.flatnonzero(rows >= 0)
            owner = rows[people]
            moved = -tracks.moves(sighting.stamp - tracks.stamp, constants.motion)[owner]
            spread = tracks.spread_after(abs(tracks.stamp - sighting.stamp), constants.motion)[owner]
            points = sighting.points(people) + moved - beside[owner]
            if sighting.has_depth:
                points = points - self._offsets.of_depth(sighting.directions[people])
            parts.append(Measurements(owner, points, sighting.information(assumed[owner], people, spread)))
        return Measurements.joined(parts)


def with_bones(sizes: Sizes, joints: Joints, measured: np.ndarray, confidence: np.ndarray
               ) -> Tuple[Sizes, np.ndarray]:
    """Return what is known of the sizes of people after a frame, and joints with bones nearer to their lengths.

    Args:
        measured: (P, 18) bool, joints by which lengths are learnt.
        confidence: (P, 18) of the keypoints.
    """
    known = np.isfinite(joints.positions).all(axis=2)
    safe = np.where(known[..., np.newaxis], joints.positions, 0.0)
    noise = np.where(known[..., np.newaxis, np.newaxis], joints.covariance, 0.0)
    sizes = learn(sizes, safe, measured & known, confidence)
    lengths, spreads = expected_lengths(sizes), length_spreads(sizes)
    moved = satisfy_lengths(safe, noise, lengths, spreads, known)
    return sizes, np.where(known[..., np.newaxis], moved, np.nan)


def _views(matches: Matches) -> _Views:
    """Return how the cameras see the people of the matches."""
    shape = (matches.tracks, _JOINTS)
    cameras, measured_by = np.zeros(matches.tracks, np.int64), np.zeros(shape, np.int64)
    with_depth, confidence = np.zeros(shape, bool), np.zeros(shape)
    for sighting, rows in matches.pairs:
        people = np.flatnonzero(rows >= 0)
        owner = rows[people]
        np.add.at(cameras, owner, 1)
        np.add.at(measured_by, owner, (sighting.status[people] == MEASURED) * (2 if sighting.has_depth else 1))
        with_depth[owner] |= sighting.has_depth & (sighting.status[people] != MISSING)
        np.fmax.at(confidence, owner, sighting.confidence[people])
    return _Views(cameras, measured_by, with_depth, confidence)


def _prediction(tracks: Tracks) -> Prediction:
    """Return what is expected of the tracks; new ones are expected nowhere."""
    old = (tracks.born < tracks.stamp)[:, np.newaxis] & np.isfinite(tracks.positions).all(axis=2)
    return Prediction(tracks.assumed_positions, tracks.covariance[..., 0], tracks.variance, old, tracks.innovations,
                      tracks.stamp - tracks.seen)
