"""Registration of the tracks of a frame that no network saw: their keypoints by the points alone."""
from dataclasses import replace
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.ensemble import ENSEMBLE, sigmas, similarity
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_18, SkeletonModel
from skeleton_extract_3d.body.body import CHAINS, HEAD, JOINTS
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift.observation import grid_positions
from skeleton_extract_3d.lift.registration import (
    SeenBodies,
    Surface,
    grids_of,
    moved_joints,
    neighbours,
    places_of,
    radii_of,
    register,
    surfaces_of,
)
from skeleton_extract_3d.track.completion import Completion
from skeleton_extract_3d.track.memory import Memory
from skeleton_extract_3d.track.tracks import Observations, Tracks, frame_change


class Registered(NamedTuple):
    """The people of a frame, with the tracks that registration found.

    Attributes:
        people: (P,) people.
        row: rows of the tracks that were found; they are the last people.
        error: (P, 18) standard deviations of keypoints across the view by registration, 0 where a network saw the
            person [m].
        unseen: (P, 18) bool, joints of these people that were hidden when a network saw them last.
        memory: with the surfaces of the tracks that no network saw.
    """

    people: People2D
    row: np.ndarray
    error: np.ndarray
    unseen: np.ndarray
    memory: Memory


def registered(image: Tuple[People2D, Tuple[int, int]], expected: Tracks, track: np.ndarray, memory: Memory,
               view: FrameView, method: MethodConstants = METHOD) -> Registered:
    """Return the people of an image; registration adds tracks without a detection.

    Args:
        image: its people and its size [px].
        expected: the tracks, predicted to the frame.
        track: rows of the tracks that may be added.
    """
    people, size = image
    errors = np.zeros((len(people), len(JOINTS)))
    unseen = np.zeros(errors.shape, bool)
    memory = replace(memory, surfaces=_surfaces(expected.ids[track], memory, method))
    track = track[np.array([number in memory.surfaces for number in expected.ids[track].tolist()], bool)]
    found = _found((people.skeleton, size), expected, track, memory, view, method) if len(track) else []
    there = np.array([one is not None for one in found], bool)
    if there.any():
        # a surface belongs to one body: not to one beside the person who was found on it
        keypoints = np.array([one[0] for one in found if one is not None])
        alike = similarity(keypoints[:, None], people.keypoints, sigmas(people.skeleton))
        there[there] = (alike < ENSEMBLE.duplicate).all(axis=1)
    if not there.any():
        return Registered(people, track[:0], errors, unseen, memory)
    keypoints, error = (np.array(values) for values in zip(*(found[i] for i in np.flatnonzero(there))))
    track = track[there]
    hidden = np.array([~memory.surfaces[number].measured for number in expected.ids[track].tolist()])
    count = np.maximum((keypoints[..., 2] > 0).sum(axis=1), 1)
    others = People2D(people.skeleton, keypoints, keypoints[..., 2].sum(axis=1) / count, np.full(len(track), -1),
                      np.zeros(len(track), bool))
    return Registered(people.joined(others), track, np.concatenate([errors, error]), np.concatenate([unseen, hidden]),
                      memory)


def _surfaces(ids: np.ndarray, memory: Memory, method: MethodConstants) -> Dict[int, Surface]:
    """Return the surfaces of tracks by their ids (N,), of those that a network saw a short time ago."""
    if not len(ids) or memory.seen is None or memory.stamp is None:
        return {}
    known = {number: memory.surfaces[number] for number in ids.tolist() if number in memory.surfaces}
    known.update(surfaces_of(memory.seen, ids, method))
    return {number: one for number, one in known.items() if memory.stamp - one.stamp <= method.registration.longest}


def _found(image: Tuple[SkeletonModel, Tuple[int, int]], expected: Tracks, chosen: np.ndarray, memory: Memory,
           view: FrameView, method: MethodConstants) -> List[Optional[Tuple[np.ndarray, np.ndarray]]]:
    """Return keypoints (K, 3) of chosen tracks (N,) by registration, and their errors (18,) in COCO_18 [m]; None: the
    points do not fit.
    """
    position, covariance = expected.joints.position, expected.joints.position_covariance
    places, others = places_of(position, expected.has), neighbours(places_of(position, expected.has))
    grids = grids_of(view.points, view.camera, places[chosen], method)
    found: List[Optional[Tuple[np.ndarray, np.ndarray]]] = []
    for track, grid in zip(chosen.tolist(), grids):
        surface, pose = memory.surfaces[int(expected.ids[track])], memory.tracking_from_points
        change = None if pose is None or surface.pose is None else frame_change(surface.pose, pose)
        spread = np.concatenate([covariance[track, CHAINS], covariance[track, HEAD].mean(axis=0, keepdims=True)])
        body = grid and register(surface, grid, (places[track], spread), others[track], change, method)
        found.append(body and _keypoints(image, moved_joints(position[track], places[track], *body),
                                         np.where(expected.has[track], surface.scores, 0.0), view, method))
    return found


def _keypoints(image: Tuple[SkeletonModel, Tuple[int, int]], joints: Tuple[np.ndarray, np.ndarray], scores: np.ndarray,
               view: FrameView, method: MethodConstants) -> Optional[Tuple[np.ndarray, np.ndarray]]:
    """Return the keypoints (K, 3) of joints, positions (18, 3) and errors (18,) [m], and the errors; None: too few."""
    (skeleton, size), (xyz, error) = image, joints
    uv = grid_positions(view.camera.project(xyz), (view.points.width, view.points.height), size)
    with np.errstate(invalid='ignore'):
        inside = ((uv >= 0) & (uv <= np.subtract(size, 1))).all(axis=1)
    placed = inside & (scores > 0) & (error < method.registration.most_error)
    if placed.sum() < method.track.one_body.least_joints:
        return None
    keypoints = np.where(placed[:, None], np.column_stack([uv, scores]), (np.nan, np.nan, 0.0)).astype(np.float32)
    return keypoints_in(keypoints[None], COCO_18, skeleton)[0], error


def seen_bodies(memory: Memory, seen: Completion, people: Observations, view: FrameView,
                method: MethodConstants = METHOD) -> SeenBodies:
    """Return the bodies of a frame, for registration in the next one."""
    tracks, measured = seen.tracks, people.lifted.measured & seen.trusted
    return SeenBodies(
        view.points, view.camera, memory.tracking_from_points, view.stamp, tracks.ids, people.observed.people_2d.looked,
        places_of(tracks.joints.position, tracks.has), radii_of(tracks.sizes.stature, method),
        measured, people.observed.scores)
