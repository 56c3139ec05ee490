"""Joints without a usable keypoint of people who were detected: from the body model and what was seen before.

A joint stays where it was relative to the next joint towards the trunk, and drifts to where it hangs at rest.
"""
from dataclasses import replace
from typing import Any, NamedTuple, Optional, Tuple

import numpy as np

from skeleton_extract_3d.body.body import (
    ENDS,
    HEAD,
    HIPS,
    LOWER_KINDS,
    MIDDLES,
    NECK,
    ROOTS,
    SHOULDERS,
    SIDES,
    UPPER_KINDS,
)
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.frame import View
from skeleton_extract_3d.track.joint_filter import JointFilter, isotropic
from skeleton_extract_3d.track.tracks import Tracks

_BODY, _COMPLETION = METHOD.body, METHOD.track.completion
_OF_NECK = np.array([NECK])
# Left and right, (2, 1).
_BOTH_SIDES = np.array([1.0, -1.0])[:, None]


class Completion(NamedTuple):
    """N people with all joints that can be told.

    Attributes:
        tracks: of these people.
        trusted: (N, 18) bool, joints that the frame itself has placed.
        placed: (N, 18) bool, these and the joints that were told by others.
        sigma: (N, 18) root mean square error of each placed joint [m].
    """

    tracks: Tracks
    trusted: np.ndarray
    placed: np.ndarray
    sigma: np.ndarray


def complete(seen: Completion, view: View, timeout: float) -> Completion:
    """Return people with the joints that have no usable keypoint placed, from the trunk outwards.

    Args:
        seen: corrected with this frame; only trusted joints are placed.
        view: the frame.
        timeout: a joint that had no keypoint for longer is not placed [s].
    """
    tracks, trusted = seen.tracks, seen.trusted
    if trusted.all():
        return seen
    scale = tracks.sizes.stature / _BODY.adult_stature
    left, down = tracks.left, tracks.down
    pose = _Pose.of(seen, view, timeout)
    neck, known = _neck(pose, left, down, scale)
    pose = pose.filled(np.array([NECK]), neck[:, None], known, None)
    half = left * (scale * _BODY.shoulder_width / 2)[:, None]
    shoulders = pose.position[:, NECK, None] + _BOTH_SIDES * half[:, None]
    pose = pose.filled(SHOULDERS, shoulders, pose.placed[:, NECK], _OF_NECK)
    pose = pose.filled(HIPS, _hips(pose, trusted, left, down, scale), pose.placed[:, NECK], _OF_NECK)
    for starts, ends, kinds, hanging in ((ROOTS, MIDDLES, UPPER_KINDS, _COMPLETION.upper_hanging),
                                         (MIDDLES, ENDS, LOWER_KINDS, _COMPLETION.lower_hanging)):
        length = (_BODY.bone_lengths[kinds] * scale[:, None])[..., None]
        rest = pose.position[:, starts] + length * (hanging[:, :1] * down[:, None]
                                                    + hanging[:, 1:] * SIDES[:, None] * left[:, None])
        pose = pose.filled(ends, rest, pose.placed[:, starts], starts)
    # without another joint of the head, it is where it was above the neck
    pose = pose.filled(HEAD, None, pose.placed[:, NECK], _OF_NECK)
    filled = pose.placed & ~trusted
    joints = JointFilter.moving(pose.position, pose.velocity, isotropic(pose.sigma), _COMPLETION.speed)
    tracks = replace(tracks, joints=tracks.joints.where(filled, joints), has=tracks.has | filled,
                     seen=np.where(filled & ~tracks.has, tracks.born[:, None], tracks.seen))
    return Completion(tracks, trusted, pose.placed, pose.sigma)


class _Pose(NamedTuple):
    """The joints of N people while they are placed one after another.

    Attributes:
        position, velocity: (N, 18, 3) [m], [m/s].
        sigma: (N, 18) [m].
        placed: (N, 18) bool.
        had: (N, 18) bool, joints that had a place in an earlier frame.
        unseen: (N, 18) time without a keypoint [s].
        elapsed: time since the frame before [s].
        timeout: greatest time without a keypoint [s].
    """

    position: np.ndarray
    velocity: np.ndarray
    sigma: np.ndarray
    placed: np.ndarray
    had: np.ndarray
    unseen: np.ndarray
    elapsed: float
    timeout: float

    @classmethod
    def of(cls, seen: Completion, view: View, timeout: float) -> '_Pose':
        """Return the joints as the frame and the tracks have them."""
        tracks = seen.tracks
        unseen = view.stamp - np.where(tracks.has, tracks.seen, tracks.born[:, None])
        return cls(tracks.joints.position, tracks.joints.velocity, seen.sigma, seen.trusted, tracks.has, unseen,
                   view.elapsed, timeout)

    def filled(self, joints: np.ndarray, rest: Optional[np.ndarray], possible: np.ndarray,
               parents: Optional[np.ndarray]) -> '_Pose':
        """Return the pose with joints placed that are not yet.

        Args:
            joints: (J,) which.
            rest: (N, J, 3) where they are at rest [m]; None: unknown.
            possible: (N,) or (N, J) bool, whether that is known.
            parents: (J,) or (1,) joints that they move with; None: they move as they did.
        """
        had, unseen = self.had[:, joints], self.unseen[:, joints]
        possible = possible if possible.ndim == 2 else possible[:, None]
        able = had if rest is None else had | possible
        fill = ~self.placed[:, joints] & able & (unseen <= self.timeout)
        if not fill.any():
            return self
        position, velocity = self.position[:, joints], self.velocity[:, joints]
        parent_sigma = np.full(had.shape, _COMPLETION.neck_sigma) if parents is None else self.sigma[:, parents]
        if parents is not None:
            of_parent = self.velocity[:, parents]
            position = position + (of_parent - velocity) * self.elapsed
            velocity = of_parent
        if rest is not None:
            share = 1 - np.exp(-self.elapsed / _COMPLETION.rest_time)
            towards = np.where(possible[..., None], position + (rest - position) * share, position)
            position = np.where(had[..., None], towards, rest)
        most = _COMPLETION.rest_sigmas[joints]
        growing = np.minimum(_COMPLETION.sigma_at_once + _COMPLETION.sigma_growth * unseen, most)
        sigma = np.sqrt(np.where(had, growing, most) ** 2 + parent_sigma ** 2)
        return self._replace(
            position=_with(self.position, joints, fill[..., None], position),
            velocity=_with(self.velocity, joints, fill[..., None], velocity),
            sigma=_with(self.sigma, joints, fill, sigma), placed=_with(self.placed, joints, fill, True))


def _with(values: np.ndarray, joints: np.ndarray, fill: np.ndarray, new: Any) -> np.ndarray:
    """Return values of all joints, (N, 18, ...), with new ones for some joints where these are to be filled."""
    values = values.copy()
    values[:, joints] = np.where(fill, new, values[:, joints])
    return values


def _neck(pose: _Pose, left: np.ndarray, down: np.ndarray, scale: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return where the neck is by shoulders, hips or head, (N, 3) [m], and whose is known, (N,)."""
    position, trusted = pose.position, pose.placed
    half = left * (scale * _BODY.shoulder_width / 2)[:, None]
    both, any_shoulder = trusted[:, SHOULDERS].all(axis=1), trusted[:, SHOULDERS].any(axis=1)
    by_one = np.where(trusted[:, SHOULDERS[:1]], position[:, SHOULDERS[0]] - half, position[:, SHOULDERS[1]] + half)
    middle = np.where(both[:, None], position[:, SHOULDERS].mean(axis=1), by_one)
    both_hips = trusted[:, HIPS].all(axis=1)
    of_hips = position[:, HIPS].mean(axis=1) - down * (scale * _BODY.trunk_length)[:, None]
    of_head, head_known = _neck_by_head(pose, left, down, scale)
    neck = np.where(any_shoulder[:, None], middle, np.where(both_hips[:, None], of_hips, of_head))
    return neck, any_shoulder | both_hips | head_known


def _neck_by_head(pose: _Pose, left: np.ndarray, down: np.ndarray, scale: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return where the neck is under the known joints of the head, (N, 3) [m], and of whom there are any, (N,)."""
    forward = np.cross(left, -down)
    axes = np.stack([left, down, forward], axis=1)
    known = pose.placed[:, HEAD]
    offsets = _BODY.head_points @ axes * scale[:, None, None]
    middle = np.where(known[..., None], pose.position[:, HEAD] - offsets, 0.0).sum(axis=1)
    middle = middle / np.maximum(known.sum(axis=1), 1)[:, None]
    return middle + down * (scale * _BODY.neck_to_head)[:, None], known.any(axis=1)


def _hips(pose: _Pose, trusted: np.ndarray, left: np.ndarray, down: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return where the hips are, by one of them or under the neck, (N, 2, 3) [m]."""
    position, half = pose.position, left * (scale * _BODY.hip_width / 2)[:, None]
    by_one = np.where(trusted[:, HIPS[:1]], position[:, HIPS[0]] - half, position[:, HIPS[1]] + half)
    under_neck = position[:, NECK] + down * (scale * _BODY.trunk_length)[:, None]
    middle = np.where(trusted[:, HIPS].any(axis=1)[:, None], by_one, under_neck)
    return middle[:, None] + _BOTH_SIDES * half[:, None]
