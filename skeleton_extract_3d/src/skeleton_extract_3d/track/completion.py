"""Joints without a usable keypoint of detected people: from the body model and the frames before.

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
    UPPER_KINDS,
    BodyConstants,
)
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.track.constants import CompletionConstants
from skeleton_extract_3d.track.joint_filter import JointFilter, isotropic
from skeleton_extract_3d.track.tracks import Tracks

_OF_NECK = np.array([NECK])
# Left and right, (2, 1).
_BOTH_SIDES = np.array([1.0, -1.0])[:, None]


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
    """Return people with untrusted joints placed that had a keypoint within a timeout [s], from the trunk outwards."""
    body, constants = method.body, method.track.completion
    tracks, trusted = seen.tracks, seen.trusted
    if trusted.all():
        return seen
    trunk = _Trunk(tracks.left, tracks.down, tracks.sizes.stature / body.adult_stature, body)
    pose = _PlacedJoints.of(seen, view, timeout, constants)
    neck, known = _neck(pose, trunk)
    pose = pose.filled(np.array([NECK]), neck[:, None], known, None)
    shoulders = pose.position[:, NECK, None] + _BOTH_SIDES * trunk.half(body.shoulder_width)[:, None]
    pose = pose.filled(SHOULDERS, shoulders, pose.placed[:, NECK], _OF_NECK)
    pose = pose.filled(HIPS, _hips(pose, trusted, trunk), pose.placed[:, NECK], _OF_NECK)
    for starts, ends, kinds in ((ROOTS, MIDDLES, UPPER_KINDS), (MIDDLES, ENDS, LOWER_KINDS)):
        length = (body.bone_lengths[kinds] * trunk.scale[:, None])[..., None]
        rest = pose.position[:, starts] + length * trunk.down[:, None]
        pose = pose.filled(ends, rest, pose.placed[:, starts], starts)
    # without another joint of the head, it stays where it was above the neck
    pose = pose.filled(HEAD, None, pose.placed[:, NECK], _OF_NECK)
    filled = pose.placed & ~trusted
    joints = JointFilter.moving(pose.position, pose.velocity, isotropic(pose.sigma), constants.speed)
    tracks = replace(tracks, joints=tracks.joints.where(filled, joints), has=tracks.has | filled,
                     seen=np.where(filled & ~tracks.has, tracks.born[:, None], tracks.seen))
    return Completion(tracks, trusted, pose.placed, pose.sigma)


class _Trunk(NamedTuple):
    """The trunks of N people: unit vectors (N, 3) to the left and down, and stature (N,) in statures of an adult."""

    left: np.ndarray
    down: np.ndarray
    scale: np.ndarray
    body: BodyConstants

    def half(self, width: float) -> np.ndarray:
        """Return the vectors from the middle to the left of a pair of joints with a width [m], (N, 3)."""
        return self.left * (self.scale * width / 2)[:, None]

    def below(self, length: float) -> np.ndarray:
        """Return the vectors downwards with a length [m], (N, 3) [m]."""
        return self.down * (self.scale * length)[:, None]


class _PlacedJoints(NamedTuple):
    """The joints of N people while they are placed one after another.

    Attributes:
        position, velocity: (N, 18, 3) [m], [m/s].
        sigma: (N, 18) [m].
        placed: (N, 18) bool.
        had: (N, 18) bool, joints that had a place in an earlier frame.
        unseen: (N, 18) time without a keypoint [s].
        elapsed: time since the frame before [s].
        timeout: greatest time without a keypoint [s].
        constants: of the step.
    """

    position: np.ndarray
    velocity: np.ndarray
    sigma: np.ndarray
    placed: np.ndarray
    had: np.ndarray
    unseen: np.ndarray
    elapsed: float
    timeout: float
    constants: CompletionConstants

    @classmethod
    def of(cls, seen: Completion, view: FrameView, timeout: float, constants: CompletionConstants) -> '_PlacedJoints':
        """Return the joints of the frame and the tracks."""
        tracks = seen.tracks
        unseen = view.stamp - np.where(tracks.has, tracks.seen, tracks.born[:, None])
        return cls(tracks.joints.position, tracks.joints.velocity, seen.sigma, seen.trusted, tracks.has, unseen,
                   view.elapsed, timeout, constants)

    def filled(self, joints: np.ndarray, rest: Optional[np.ndarray], possible: np.ndarray,
               parents: Optional[np.ndarray]) -> '_PlacedJoints':
        """Return the pose with joints (J,) placed that are not yet.

        Args:
            rest: (N, J, 3) where they are at rest [m]; None: unknown.
            possible: (N,) or (N, J) bool, whether `rest` is known.
            parents: (J,) or (1,) joints that they move with; None: they move as they did.
        """
        constants, had, unseen = self.constants, self.had[:, joints], self.unseen[:, joints]
        possible = possible if possible.ndim == 2 else possible[:, None]
        able = had if rest is None else had | possible
        fill = ~self.placed[:, joints] & able & (unseen <= self.timeout)
        if not fill.any():
            return self
        position, velocity = self.position[:, joints], self.velocity[:, joints]
        parent_sigma = np.full(had.shape, constants.rest_sigmas[NECK]) if parents is None else self.sigma[:, parents]
        if parents is not None:
            of_parent = self.velocity[:, parents]
            position = position + (of_parent - velocity) * self.elapsed
            velocity = of_parent
        if rest is not None:
            share = 1 - np.exp(-self.elapsed / constants.rest_time)
            towards = np.where(possible[..., None], position + (rest - position) * share, position)
            position = np.where(had[..., None], towards, rest)
        most = constants.rest_sigmas[joints]
        growing = np.minimum(constants.sigma_at_once + constants.sigma_growth * unseen, most)
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


def _neck(pose: _PlacedJoints, trunk: _Trunk) -> Tuple[np.ndarray, np.ndarray]:
    """Return the neck by shoulders, hips or head, (N, 3) [m], and whether it is known, (N,)."""
    position, trusted = pose.position, pose.placed
    half = trunk.half(trunk.body.shoulder_width)
    both, any_shoulder = trusted[:, SHOULDERS].all(axis=1), trusted[:, SHOULDERS].any(axis=1)
    by_one = np.where(trusted[:, SHOULDERS[:1]], position[:, SHOULDERS[0]] - half, position[:, SHOULDERS[1]] + half)
    middle = np.where(both[:, None], position[:, SHOULDERS].mean(axis=1), by_one)
    both_hips = trusted[:, HIPS].all(axis=1)
    of_hips = position[:, HIPS].mean(axis=1) - trunk.below(trunk.body.trunk_length)
    of_head, head_known = _neck_by_head(pose, trunk)
    neck = np.where(any_shoulder[:, None], middle, np.where(both_hips[:, None], of_hips, of_head))
    return neck, any_shoulder | both_hips | head_known


def _neck_by_head(pose: _PlacedJoints, trunk: _Trunk) -> Tuple[np.ndarray, np.ndarray]:
    """Return the neck under the known joints of the head, (N, 3) [m], and whether there are any, (N,)."""
    forward = np.cross(trunk.left, -trunk.down)
    axes = np.stack([trunk.left, trunk.down, forward], axis=1)
    known = pose.placed[:, HEAD]
    offsets = trunk.body.head_points @ axes * trunk.scale[:, None, None]
    middle = np.where(known[..., None], pose.position[:, HEAD] - offsets, 0.0).sum(axis=1)
    middle = middle / np.maximum(known.sum(axis=1), 1)[:, None]
    return middle + trunk.below(trunk.body.neck_to_head), known.any(axis=1)


def _hips(pose: _PlacedJoints, trusted: np.ndarray, trunk: _Trunk) -> np.ndarray:
    """Return the hips, by one of them or under the neck, (N, 2, 3) [m]."""
    position, half = pose.position, trunk.half(trunk.body.hip_width)
    by_one = np.where(trusted[:, HIPS[:1]], position[:, HIPS[0]] - half, position[:, HIPS[1]] + half)
    under_neck = position[:, NECK] + trunk.below(trunk.body.trunk_length)
    middle = np.where(trusted[:, HIPS].any(axis=1)[:, None], by_one, under_neck)
    return middle[:, None] + _BOTH_SIDES * half[:, None]
