"""Whether tracked people are there: what looks, and the points, tell of each track.

The probability is that of `openpose_ros_pkg.detect.existence`. Points tell how much of a body the camera would see,
that a place is empty, and that a detection is a body: one that is not flat, and stands out from what is around it.
"""
from dataclasses import replace
from typing import NamedTuple, Tuple

import numpy as np
from scipy.special import erf

from openpose_ros_pkg.detect.existence import EXISTENCE, decayed, of_detection, of_emptiness, of_miss, with_evidence
from openpose_ros_pkg.detect.tracking import TRACKING
from skeleton_extract_3d.body.body import MEASURED_KINDS
from skeleton_extract_3d.body.measures import measured_lengths
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.records import Lifted, ObservedPeople
from skeleton_extract_3d.track.tracks import PLACE_WEIGHTS, PLACES, Tracks

# Directions in which the surroundings of a joint are looked at, (8, 2).
_AROUND = np.array([[np.cos(angle), np.sin(angle)] for angle in np.arange(8) * np.pi / 4])


class Views(NamedTuple):
    """What the camera would see of T bodies, (T,) each: the share of their joints that lies in the image and behind no
    nearer surface, the share in the image, and the probability that what is behind the body is seen instead.
    """

    visible: np.ndarray
    inside: np.ndarray
    empty: np.ndarray


def views_of(tracks: Tracks, view: FrameView, method: MethodConstants = METHOD) -> Views:
    """Return what the camera would see of tracked bodies, on average over where they may be across the view."""
    return Views(*((tracks.places.T * values).sum(axis=0) for values in _views_by_place(tracks, view, method)))


def _views_by_place(tracks: Tracks, view: FrameView, method: MethodConstants) -> Views:
    """Return what the camera would see of tracked bodies at each of their places, (5, T) each."""
    shifts = PLACES[:, None] * tracks.root.sigmas()[:, 0] / np.sqrt(3)
    position = np.repeat(tracks.joints.position[None], len(shifts), axis=0)
    position[..., 0] += shifts[..., None]
    views = views_at(position.reshape(-1, *position.shape[2:]), np.tile(tracks.has, (len(shifts), 1)), view, method)
    return Views(*(values.reshape(len(shifts), -1) for values in views))


def views_at(position: np.ndarray, has: np.ndarray, view: FrameView, method: MethodConstants = METHOD) -> Views:
    """Return what the camera would see of bodies with joints (T, 18, 3) [m], of which they have (T, 18) some."""
    reach, points = method.trunk.reach, view.points
    uv = view.camera.project(position.reshape(-1, 3)).reshape(*position.shape[:-1], 2)
    inside = ((uv > -0.5) & (uv < (points.width - 0.5, points.height - 0.5))).all(axis=2) & has
    depth = surfaces.depths_at(points, np.where(np.isfinite(uv), np.clip(uv, -1e6, 1e6), -1e6))
    beyond = depth - position[..., 2]
    known = np.isfinite(depth) & inside
    seen = (known & (beyond > -reach)).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    shares = inside.sum(axis=1) / np.maximum(has.sum(axis=1), 1)
    empty = 2 * ((beyond > reach) & inside).sum(axis=1) > has.sum(axis=1)
    return Views(np.where(known.any(axis=1), seen, TRACKING.open_view) * shares, shares, empty.astype(np.float64))


def after_time(tracks: Tracks, views: Views, stamp: float, timeout: float) -> np.ndarray:
    """Return the probabilities (T,) at a stamp [s], before it is known what was looked at.

    Args:
        timeout: after which tracks without a detection end [s].
    """
    lasting = np.where(views.inside > 0.5, METHOD.track.existence.lasting * max(timeout, 1e-3), EXISTENCE.leaving)
    return decayed(tracks.existence, stamp - tracks.looked, lasting)


def without_detection(tracks: Tracks, looked: np.ndarray, view: FrameView, timeout: float,
                      method: MethodConstants = METHOD) -> Tracks:
    """Return the tracks without a detection after a frame.

    What is seen to be empty is the place of no person: the rest of the probability is where nothing tells against it.

    Args:
        looked: (T,) bool, those that were looked at.
    """
    if not len(tracks):
        return tracks
    since, sigma = view.stamp - tracks.looked, tracks.root.sigmas()[:, 0] / np.sqrt(3)
    covered = erf(method.track.existence.reach / (np.sqrt(2) * np.maximum(sigma, 1e-3)))
    views = _views_by_place(tracks, view, method)
    existence = after_time(tracks, views_of(tracks, view, method), view.stamp, timeout)
    evidence = np.where(looked, of_miss(views.visible * covered, since), 0.0) + of_emptiness(views.empty, since)
    likelihood = tracks.places.T * np.exp(evidence)
    total = likelihood.sum(axis=0)
    told = looked | (views.empty > 0).any(axis=0)
    return replace(tracks, existence=np.where(told, with_evidence(existence, np.log(total)), tracks.existence),
                   places=(likelihood / total).T, looked=np.where(told, view.stamp, tracks.looked))


def with_detection(tracks: Tracks, before: np.ndarray, evidence: np.ndarray, stamp: float) -> Tracks:
    """Return the tracks with a detection after a frame.

    Args:
        before: (T,) probabilities before it.
        evidence: (T,) log likelihood ratios.
    """
    most = np.where(tracks.born == stamp, EXISTENCE.born, EXISTENCE.most)
    existence = np.minimum(with_evidence(before, evidence), most)
    return replace(tracks, existence=existence, looked=np.full(len(tracks), stamp),
                   places=np.broadcast_to(PLACE_WEIGHTS, tracks.places.shape))


def evidence_of(observed: ObservedPeople, lifted: Lifted, since: np.ndarray, view: FrameView,
                method: MethodConstants = METHOD) -> np.ndarray:
    """Return the log likelihood ratios of detections: by their scores, their relief and their size, (P,).

    Args:
        since: (P,) time since the look before, infinite for new people [s].
    """
    constants, people = method.track.existence, observed.people_2d
    few = ~observed.has_measured(lifted.measured, constants.body_joints)
    by_score = np.maximum(of_detection(people.scores) + constants.against_few * few, EXISTENCE.least_evidence)
    relief = relief_of(observed, view, method)
    with np.errstate(invalid='ignore'):
        flat = (relief < constants.flat) | (_spread_of(observed, lifted, view, method) < constants.flat_body)
        small = _size(lifted, method) < method.body.stature_limits[0] / method.body.adult_stature
    weight = np.minimum(since / EXISTENCE.independent, 1.0)
    evidence = np.where(people.looked, by_score, EXISTENCE.least_evidence * weight)
    return np.where(flat | small, constants.against_flat * weight, evidence)


def relief_of(observed: ObservedPeople, view: FrameView, method: MethodConstants = METHOD) -> np.ndarray:
    """Return how far people stand out from the plane around them, (P,) [m].

    It is the median distance of the surfaces at their joints from the plane through those around them; NaN where these
    are no plane.
    """
    constants, relief = method.track.existence, np.full(len(observed), np.nan)
    joints = surfaces.lower_median(observed.samples)  # (P, 18)
    for i in range(len(observed)):
        there = np.isfinite(joints[i])
        if there.sum() < constants.least_points:
            continue
        uv, depth = observed.uv[i, there], joints[i, there]
        middle = float(np.median(depth))
        radii = constants.around * observed.focal / middle * np.array([1.0, 1.5])
        ring = (uv[:, None, None] + radii[:, None, None] * _AROUND).reshape(-1, 2)
        off = np.linalg.norm(ring[:, None] - uv[None], axis=2).min(axis=1)
        ring = ring[off > 0.9 * radii[0]]
        far = surfaces.depths_at(view.points, ring) if len(ring) else np.zeros(0)
        known = np.isfinite(far)
        around = _points(ring[known], far[known], view)
        around = around[np.isfinite(around).all(axis=1)]  # the borders of a wide lens may have depth without rays
        if len(around) < constants.least_points:
            continue
        plane, spread = _plane(around)
        noise = constants.noise * middle ** 2
        if spread > constants.plane_spread + noise:
            continue
        # the median of all joints errs by much less than one depth
        relief[i] = abs(float(np.median(_points(uv, depth, view) @ plane[:3] + plane[3]))) - noise / 4
    return relief


def _spread_of(observed: ObservedPeople, lifted: Lifted, view: FrameView, method: MethodConstants) -> np.ndarray:
    """Return the median distances of the surfaces at measured joints from one plane, (P,) [m]; NaN with few of them."""
    spread, joints = np.full(len(observed), np.nan), surfaces.lower_median(observed.samples)
    measured = lifted.measured & np.isfinite(joints)
    for i in np.flatnonzero(measured.sum(axis=1) >= method.track.existence.flat_joints):
        spread[i] = _plane(_points(observed.uv[i, measured[i]], joints[i, measured[i]], view))[1]
    return spread


def _points(uv: np.ndarray, depth: np.ndarray, view: FrameView) -> np.ndarray:
    """Return the points at pixels of the grid (N, 2) with depths (N,) [m], (N, 3)."""
    return view.camera.rays(uv) * depth[:, None]


def _plane(points: np.ndarray) -> Tuple[np.ndarray, float]:
    """Return a plane through points (N, 3), (4,) normal and distance [m], and their median distance from it [m]."""
    weights = np.ones(len(points))
    for _ in range(3):  # the surroundings hold things before the wall too
        middle = weights @ points / weights.sum()
        apart = points - middle
        normal = np.linalg.eigh((apart * weights[:, None]).T @ apart)[1][:, 0]
        off = np.abs(apart @ normal)
        weights = 1 / (1 + (off / max(float(np.median(off)), 0.01)) ** 2)
    return np.append(normal, -middle @ normal), float(np.median(off))


def _size(lifted: Lifted, method: MethodConstants) -> np.ndarray:
    """Return the sizes of people as a share of an adult's, by the median of measured bones, (P,); NaN: unknown."""
    kinds = MEASURED_KINDS[:-1]  # without that of neck to hips
    lengths = measured_lengths(lifted.xyz, lifted.measured) / method.body.bone_lengths[kinds]
    enough = np.isfinite(lengths).sum(axis=1) >= method.sizes.least_bones
    return np.where(enough, surfaces.lower_median(lengths), np.nan)
