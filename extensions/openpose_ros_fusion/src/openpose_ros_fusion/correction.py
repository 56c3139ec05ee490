"""Tracks with what the cameras measured of them in a frame."""
from dataclasses import replace
from typing import NamedTuple, Tuple

import numpy as np

from openpose_ros_fusion.association import Matches
from openpose_ros_fusion.constants import EstimateConstants, FusionConstants
from openpose_ros_fusion.estimate import Joints, Measurements, estimate_joints, mean_variances
from openpose_ros_fusion.observations import KeypointOffsets
from openpose_ros_fusion.tracks import Tracks
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.measures import Sizes, expected_lengths, learn, length_spreads
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING
from skeleton_extract_3d.track.joint_filter import averaged_innovations, error_variances, mean_innovations

_JOINTS = len(COCO_18.joints)


class Errors(NamedTuple):
    """How far the joints of F people err after a frame."""

    variance: np.ndarray     # (F, K) mean over the axes [m^2]
    filtered: np.ndarray     # (F, K) of each axis, for the filter of the tracks [m^2]
    independent: np.ndarray  # (F, K) the same if errors of frames were independent [m^2]
    innovations: np.ndarray  # (F,) mean square, as a share of what independent errors make


def corrected(tracks: Tracks, matches: Matches, offsets: KeypointOffsets, constants: FusionConstants
              ) -> Tuple[Tracks, np.ndarray, np.ndarray]:
    """Return the tracks after a frame, and what that tells of their joints: status and confidence, (F, 18)."""
    shape = (len(tracks), _JOINTS)
    cameras = np.zeros(len(tracks), np.int64)  # that see each person
    views = np.zeros(shape, np.int64)  # cameras that measure a joint; one with depth counts as two
    with_depth, confidence = np.zeros(shape, bool), np.zeros(shape)
    beside, assumed = offsets.of_bodies(tracks.positions), tracks.assumed_positions
    parts = [Measurements(np.zeros(0, np.int64), np.zeros((0, _JOINTS, 3)), np.zeros((0, _JOINTS, 3, 3)))]
    for sighting, rows in matches.pairs:
        people = np.flatnonzero(rows >= 0)
        owner, status = rows[people], sighting.status[people]
        np.add.at(cameras, owner, 1)
        np.add.at(views, owner, (status == MEASURED) * (2 if sighting.has_depth else 1))
        with_depth[owner] |= sighting.has_depth & (status != MISSING)
        np.fmax.at(confidence, owner, sighting.confidence[people])
        moved = -tracks.moves(sighting.stamp - tracks.stamp, constants.motion)[owner]
        spread = tracks.spread_after(abs(tracks.stamp - sighting.stamp), constants.motion)[owner]
        points = sighting.points(people) + moved - beside[owner]
        if sighting.has_depth:
            points = points - offsets.of_depth(sighting.directions[people])
        parts.append(Measurements(owner, points, sighting.information(assumed[owner], people, spread)))
    measured = Measurements.joined(parts)
    joints = estimate_joints(len(tracks), Measurements.joined([tracks.expected, measured]), constants.estimate)
    errors = joint_errors(tracks, measured, joints, with_depth, constants.estimate)
    sizes, positions = with_bones(tracks.sizes, joints, views >= 2, confidence)
    # bones would be bent along the rays of a camera that is alone and measures no depth
    positions = np.where((matches.views == 1)[:, np.newaxis, np.newaxis], joints.positions, positions)
    after = tracks.corrected(positions, errors.filtered, errors.independent, constants.motion)
    after = replace(after, sizes=sizes, variance=errors.variance, innovations=errors.innovations,
                    seen=np.where(cameras > 0, tracks.stamp, after.seen), cameras=np.maximum(after.cameras, cameras))
    status = np.where(np.isfinite(positions).all(axis=2), np.where(views >= 2, MEASURED, INFERRED), MISSING)
    return after, status.astype(np.uint8), confidence


def joint_errors(tracks: Tracks, measured: Measurements, joints: Joints, with_depth: np.ndarray,
                 constants: EstimateConstants) -> Errors:
    """Return how far joints err that were estimated from what was expected and what cameras measured, in this order.

    By innovations, see skeleton_extract_3d.track.joint_filter. All cameras make one innovation together: the sum of
    v_i L_i (p_i - x) with the prediction x, also of rays. The filter never gets surer than with independent errors.
    Along the rays of two cameras a position is worse than on the mean, and one of them may be alone in the next frame.

    Args:
        tracks: before the frame.
        with_depth: (F, K) bool, joints that a camera with depth tells.
    """
    people, place, before = len(tracks), tracks.covariance[..., 0], tracks.variance
    of_person = measured.sums(people)
    trust = joints.trust[people:, :, np.newaxis, np.newaxis]
    information = np.tensordot(of_person, trust * measured.information, 1)
    noise = np.tensordot(of_person, trust ** 2 * measured.information, 1)
    offsets = measured.points - tracks.assumed_positions[measured.owner]
    surprise = np.tensordot(of_person, np.einsum('mkij,mkj->mki', trust * measured.information, offsets), 1)
    independent = np.trace(noise, axis1=2, axis2=3) + before * (information ** 2).sum(axis=(2, 3))
    used = tracks.known & (independent > 0)
    variance = mean_variances(information, constants)
    innovations = averaged_innovations(
        tracks.innovations, mean_innovations((surprise ** 2).sum(axis=2), independent, used),
        np.where(used.any(axis=1), tracks.stamp - tracks.seen, 0.0))
    in_space = np.isfinite(variance)
    errors = error_variances(innovations, 1 - joints.leverage[:people], before, np.where(in_space, variance, 0.0),
                             place)
    known = np.isfinite(joints.positions).all(axis=2)
    # where cameras tell a joint along some axes only, or not at all
    errors = np.where(in_space, errors, np.where(known, np.trace(joints.covariance, axis1=2, axis2=3) / 3, place))
    worst = np.linalg.eigvalsh(np.where(known[..., np.newaxis, np.newaxis], joints.covariance, 0.0))[..., -1]
    worst = np.where(known, worst, place)
    least = np.where(with_depth, 1 / (1 / place + 1 / variance), worst)
    return Errors(errors, np.where(with_depth, np.maximum(errors, least), worst), least, innovations)


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
    moved = METHOD.compiled.satisfy_lengths(safe, noise, expected_lengths(sizes), length_spreads(sizes), known)
    return sizes, np.where(known[..., np.newaxis], moved, np.nan)
