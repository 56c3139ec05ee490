"""What a frame does not show: joints without a usable keypoint, hidden feet, and tracks without a detection.

A joint stays where it was relative to the next joint towards the trunk, and drifts to where it hangs at rest. Tracks
without a detection walk on, ever more slowly, but not to where they would be visible.
"""
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.body.body import ENDS, HIPS, LOWER_KINDS, MIDDLES, UPPER_KINDS
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.track.existence import views_at
from skeleton_extract_3d.track.joint_filter import JointFilter, isotropic, mean_squares
from skeleton_extract_3d.track.tracks import Tracks

_KNEES, _ANKLES = MIDDLES[2:], ENDS[2:]


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

    def select(self, people: np.ndarray) -> 'Completion':
        """Return some of the people, by indices."""
        return Completion(self.tracks.select(people), self.trusted[people], self.placed[people], self.sigma[people])


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


def stand(seen: Completion, measured: np.ndarray, floor: np.ndarray, method: MethodConstants = METHOD) -> Completion:
    """Return people with their hidden ankles on or above the floor.

    An ankle with a keypoint is moved along its ray; one without is moved upright, and a knee without goes half the way.

    Args:
        measured: (N, 18) bool, joints on the person's own surface; they stay.
        floor: (4,) plane in the frame of the points: normal up, height of the camera [m].
    """
    constants, body, joints = method.track.standing, method.body, seen.tracks.joints
    leg = body.bone_lengths[UPPER_KINDS[2:]] + body.bone_lengths[LOWER_KINDS[2:]]
    height = joints.position @ floor[:3] + floor[3]
    scale = (seen.tracks.sizes.stature / body.adult_stature)[:, None]
    least = constants.ankle_height * scale
    ankle = joints.position[:, _ANKLES]
    stands = seen.placed[:, HIPS] & (height[:, HIPS] > constants.straight * leg * scale + least)
    free = seen.placed[:, _ANKLES] & ~seen.trusted[:, _ANKLES]
    on_ray = seen.trusted[:, _ANKLES] & ~measured[:, _ANKLES]
    missing = np.where(free & stands, least, np.maximum(height[:, _ANKLES], least)) - height[:, _ANKLES]
    missing = np.where(free | on_ray, np.clip(missing, -constants.reach, constants.reach), 0.0)
    # a step of 1 along the ray, from the camera on, changes the height by this
    fall = np.minimum(height[:, _ANKLES] - floor[3], -constants.least_fall)
    direction = np.where(on_ray[..., None], ankle / fall[..., None], floor[:3])
    knee_free = (seen.placed & ~seen.trusted)[:, _KNEES, None]
    step = missing[..., None] * direction
    position = joints.position.copy()
    position[:, _ANKLES] += step
    position[:, _KNEES] += np.where(knee_free, step / 2, 0.0)
    return seen._replace(tracks=replace(seen.tracks, joints=joints._replace(position=position)))


def walk_on(tracks: Tracks, view: FrameView, method: MethodConstants = METHOD) -> Tracks:
    """Return the tracks without a detection, moved on as a whole; those that would become visible stay."""
    if not len(tracks):
        return tracks
    unseen, rest = method.track.out_of_sight, method.track.completion
    speed = np.sqrt((tracks.root.velocity ** 2).sum(axis=2, keepdims=True))
    velocity = tracks.root.velocity * np.minimum(1.0, unseen.greatest_speed / np.maximum(speed, 1e-6))
    slower = np.exp(-view.elapsed / unseen.stopping_time)
    step, position = velocity * unseen.stopping_time * (1 - slower), tracks.joints.position
    velocity = velocity * slower
    was_visible = views_at(position, tracks.has, view, method).empty
    would_be = views_at(position + step, tracks.has, view, method).empty
    step = np.where((would_be > was_visible)[:, None, None], 0.0, step)
    away = (view.stamp - tracks.last_seen)[:, None]
    known = np.sqrt(mean_squares(tracks.root.velocity_covariance) / 3)
    drift = (rest.sigma_growth + np.maximum(unseen.speed_error * speed[:, :, 0], known)) * away
    sigma = np.sqrt(rest.sigma_at_once ** 2 + drift ** 2 + (rest.rest_sigmas * np.minimum(1.0, away)) ** 2)
    joints = JointFilter.moving(position + step, np.broadcast_to(velocity, position.shape), isotropic(sigma),
                                rest.speed)
    root = JointFilter.moving(tracks.root.position + step, velocity, isotropic(sigma.mean(axis=1, keepdims=True)),
                              rest.speed)
    return replace(tracks, joints=joints, root=root)
