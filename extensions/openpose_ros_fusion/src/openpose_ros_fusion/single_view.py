"""People that one camera alone sees, and without depth: their size in the image tells how far away they are."""
from dataclasses import replace
from typing import Optional

import numpy as np

from openpose_ros_fusion.association import Matches
from openpose_ros_fusion.constants import SingleViewConstants
from openpose_ros_fusion.observations import Sighting
from openpose_ros_fusion.tracks import Tracks
from skeleton_extract_3d.body.body import SATISFIED_BONES


def place_by_size(tracks: Tracks, matches: Matches, constants: SingleViewConstants) -> Tracks:
    """Return the tracks with those in the view of one camera alone, without depth, where their size puts them.

    They are moved as predicted, without a change of pose and as large as they are known to be, to where their joints
    are nearest to the rays.
    """
    alone, lengths = np.append(matches.views == 1, False), tracks.bone_lengths
    for sighting, rows in matches.pairs:
        for person in np.flatnonzero(alone[rows]):
            row = rows[person]
            body = with_size(tracks.positions[row], lengths[row], constants)
            shift = shift_onto_rays(body, sighting, person, constants)
            if shift is not None:
                distance = float(np.linalg.norm(np.nanmean(body, axis=0) + shift - sighting.origin))
                tracks = _moved(tracks, row, body + shift, (constants.size_error * distance) ** 2)
    return tracks


def with_size(joints: np.ndarray, lengths: np.ndarray, constants: SingleViewConstants) -> np.ndarray:
    """Return a body (18, 3) [m] whose size is nearer to what lengths (8,) [m] of its bones say, in the same pose.

    A part of the difference is corrected at a time, since noise of single frames makes bones look longer.
    """
    starts, ends, kinds = SATISFIED_BONES.T
    found = np.linalg.norm(joints[starts] - joints[ends], axis=1)
    known = np.isfinite(found)
    scale = (lengths[kinds][known].sum() / found[known].sum()) ** constants.size_gain if known.any() else 1.0
    middle = np.nanmean(joints, axis=0)
    return middle + scale * (joints - middle)


def shift_onto_rays(joints: np.ndarray, sighting: Sighting, person: int, constants: SingleViewConstants
                    ) -> Optional[np.ndarray]:
    """Return by what (3,) [m] a body (18, 3) has to be moved so that its joints are nearest to the rays of a person.

    None: too few joints are visible. Robust least squares of the distances from the rays,
    t = (sum P_k)^-1 sum P_k (o - x_k) with P_k = 1 - d_k d_k'.
    """
    rays = sighting.directions[person]
    used = np.isfinite(joints).all(axis=1) & np.isfinite(rays).all(axis=1)
    if used.sum() < constants.least_joints:
        return None
    offsets, rays = sighting.origin - joints[used], rays[used]
    weights = np.ones(len(rays))
    for _ in range(constants.rounds):
        across = np.eye(3) - rays[:, :, np.newaxis] * rays[:, np.newaxis]
        shift = np.linalg.solve((weights[:, np.newaxis, np.newaxis] * across).sum(axis=0),
                                np.einsum('k,kij,kj->i', weights, across, offsets))
        left = np.linalg.norm(np.einsum('kij,kj->ki', across, offsets - shift), axis=1)
        weights = 1 / (1 + (left / constants.outlier) ** 2)
    return shift


def _moved(tracks: Tracks, row: int, joints: np.ndarray, most: float) -> Tracks:
    """Return the tracks, with one of them at joints (18, 3) [m], and the variance of its positions [m^2] at most.

    The body moves as one: velocities of its joints are the mean of what they were.
    """
    chosen = (np.arange(len(tracks)) == row)[:, np.newaxis, np.newaxis]
    share = np.minimum(most / np.maximum(tracks.covariance[row, :, :1], 1e-12), 1.0)
    return replace(tracks, positions=np.where(chosen, joints, tracks.positions),
                   velocities=np.where(chosen, tracks.velocities[row].mean(axis=0), tracks.velocities),
                   covariance=np.where(chosen & [True, True, False], share * tracks.covariance, tracks.covariance))
