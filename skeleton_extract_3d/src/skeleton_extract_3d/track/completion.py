"""Joints without a usable keypoint of detected people: from the body model and the frames before.

A joint stays where it was relative to the next joint towards the trunk, and drifts to where it hangs at rest.
"""
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.track.joint_filter import JointFilter, isotropic
from skeleton_extract_3d.track.tracks import Tracks


class Completion(NamedTuple):
    """N people with all joints that can be placed.

    Attributes:
        tracks: of these people.
        trusted: (N, 18) bool, joints that the frame itself has placed.
        placed: (N, 18) bool, these and the joints inferred from others.
        sigma: (N, 18) root mean square error of each placed joint [m].
    """

    tracks: Tracks
    trusted: np.ndarray
    placed: np.ndarray
    sigma: np.ndarray


def complete(seen: Completion, view: FrameView, timeout: float, method: MethodConstants = METHOD) -> Completion:
    """Return people with untrusted joints placed that had a keypoint within a timeout [s], from the trunk outwards;
    compiled (completion.cpp)."""
    tracks, trusted = seen.tracks, seen.trusted
    if trusted.all():
        return seen
    unseen = view.stamp - np.where(tracks.has, tracks.seen, tracks.born[:, None])
    position, velocity, sigma, placed = method.compiled.complete(
        (tracks.joints.position, tracks.joints.velocity, seen.sigma, trusted), (tracks.has, unseen),
        (tracks.left, tracks.down, tracks.sizes.stature / method.body.adult_stature), view.elapsed, timeout)
    filled = placed & ~trusted
    joints = JointFilter.moving(position, velocity, isotropic(sigma), method.track.completion.speed)
    tracks = replace(tracks, joints=tracks.joints.where(filled, joints), has=tracks.has | filled,
                     seen=np.where(filled & ~tracks.has, tracks.born[:, None], tracks.seen))
    return Completion(tracks, trusted, placed, sigma)
