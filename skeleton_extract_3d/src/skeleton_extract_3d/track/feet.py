"""Toes and heels: each foot is a rigid body on its tracked ankle.

A foot has a shape, and turns about the ankle. Its turn is known from the frame before and from the shin. In a frame,
each keypoint tells a ray, and a depth where the surface there is the foot's own; the floor bears the foot. All of them
are measurements of one Gaussian state per foot: errors of the ankle, of the turn, and of the shape (a Kalman update in
information form, linearized `FootConstants.rounds` times). What hides toes or heel, the own foot as well, leaves what
the rest of the foot and the shin tell, with its greater error.
"""
import itertools
from dataclasses import dataclass, field, replace
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.body.constants import FootConstants
from skeleton_extract_3d.body.extra_joints import Joint
from skeleton_extract_3d.body.joint_frames import joint_frames
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift.observation import pixel_sigmas
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.lift.surfaces import lower_median, window_depths
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.transform import rotation_of
from skeleton_extract_3d.track.tracks import Rows

FEET = tuple(f'{side}_{part}' for side in ('left', 'right') for part in ('big_toe', 'small_toe', 'heel'))
_ANKLES = ('left_ankle', 'right_ankle')
# A right foot mirrors a left one.
_MIRROR = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])[:, None]
# Places of the errors of the ankle, of the turn and of the shape in the state of a foot.
_ANKLE, _TURN, _SHAPE, _STATE = slice(0, 3), slice(3, 6), slice(6, 15), 15
_LEAST_ANGLE = 1e-9


@dataclass(frozen=True, eq=False)
class Feet(Rows):
    """The feet of T tracks, the left one first.

    Attributes:
        ids: (T,) int64 of the tracks.
        axes: (T, 2, 3, 3) forwards, left and up of each foot as columns, in the frame of the points.
        turn: (T, 2, 3, 3) covariances of their turns about these axes [rad^2].
        shape: (T, 3, 3) big toe, small toe and heel of the left foot from its ankle, in its axes [m].
        frames: (T,) in which the shape was measured.
    """

    ids: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    axes: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 3, 3)))
    turn: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 3, 3)))
    shape: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3)))
    frames: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def rotated(self, rotation: np.ndarray) -> 'Feet':
        """Return the feet in a frame of other axes: x' = R x."""
        return replace(self, axes=rotation @ self.axes)


class _Prior(NamedTuple):
    """What is known of F feet before their keypoints: whether there is an ankle (F,), ankles (F, 3) [m] and their
    variances per axis (F,), axes (F, 3, 3), mean (F, 3) [rad] and information (F, 3, 3) of their turn, shapes
    (F, 3, 3) [m].
    """

    known: np.ndarray
    ankle: np.ndarray
    variance: np.ndarray
    axes: np.ndarray
    mean: np.ndarray
    turn: np.ndarray
    shape: np.ndarray


class _Seen(NamedTuple):
    """Keypoints of F feet: rays (F, 3, 3) with z = 1, whether there is one (F, 3), errors across (F, 3) [m], samples of
    the surface there (F, 3, 25) [m], and the floor as in `Frame`, or None.
    """

    rays: np.ndarray
    known: np.ndarray
    across: np.ndarray
    samples: np.ndarray
    floor: Optional[np.ndarray]


class _State(NamedTuple):
    """F feet: points (F, 3, 3) [m] and their covariances (F, 3, 3, 3), axes, means (F, 15), covariances (F, 15, 15)."""

    points: np.ndarray
    covariance: np.ndarray
    axes: np.ndarray
    mean: np.ndarray
    full: np.ndarray


def has_feet(skeleton: SkeletonModel) -> bool:
    """Return whether a joint set has toes and heels."""
    return all(name in skeleton.index for name in FEET)


def follow_feet(before: Feet, people: People3D, statures: np.ndarray, observed: ObservedPeople, view: FrameView,
                method: MethodConstants = METHOD) -> Tuple[Feet, Dict[str, Joint]]:
    """Return the feet of people, (M,), after a frame, and their toes and heels by name; MISSING without the ankle.

    Args:
        before: of the tracks.
        people: with the joints of COCO_18; the first are those of `observed`, the others are hidden.
        statures: (M,) [m].
    """
    if not len(people) or not has_feet(observed.people_2d.skeleton):
        return Feet(), {}
    constants = method.feet
    feet = _of_people(before, people, statures / method.body.adult_stature, constants)
    ankles = [people.skeleton.index[name] for name in _ANKLES]
    there = (people.status[:, ankles] != MISSING).ravel()
    prior = _prior(feet, people, ankles, view, constants)
    seen = _seen(observed, len(people), prior, view, method)
    state, measured = _updated(prior, None, seen, method)
    for _ in range(1, constants.rounds):
        state, measured = _updated(prior, state, seen, method)
    sigma = np.sqrt(np.trace(state.covariance, axis1=2, axis2=3) + method.inference.keypoint_error ** 2)
    status = np.where(measured, MEASURED, INFERRED)
    xyz, status, sigma = (np.where(there.reshape(-1, 2, *(1,) * (values.ndim - 1)), values.reshape(
        -1, 2, *values.shape[1:]), missing) for values, missing in (
            (state.points, np.nan), (status, MISSING), (sigma, np.nan)))
    velocity = people.velocity[:, ankles]
    joints = {name: (xyz[:, side, point], status[:, side, point], sigma[:, side, point], velocity[:, side])
              for name, (side, point) in zip(FEET, itertools.product(range(2), range(3)))}
    feet = _learnt(feet, state, measured & there[:, None], constants)
    # a foot without an ankle tells nothing
    return replace(feet, turn=np.where(there.reshape(-1, 2, 1, 1), feet.turn, np.inf)), joints


def _of_people(before: Feet, people: People3D, scale: np.ndarray, constants: FootConstants) -> Feet:
    """Return the feet of people by their ids, an adult's of new ones; `scale`: statures per an adult's."""
    count = len(people)
    new = Feet(people.ids, np.zeros((count, 2, 3, 3)), np.full((count, 2, 3, 3), np.inf),
               constants.shape * scale[:, None, None], np.zeros(count))
    if not len(before):
        return new
    order = np.argsort(before.ids)
    row = order[np.minimum(np.searchsorted(before.ids, people.ids, sorter=order), len(before) - 1)]
    known = before.ids[row] == people.ids
    return Feet(people.ids, *(np.where(known.reshape(-1, *(1,) * (old.ndim - 1)), old[row], other)
                              for old, other in ((before.axes, new.axes), (before.turn, new.turn),
                                                 (before.shape, new.shape), (before.frames, new.frames))))


def _prior(feet: Feet, people: People3D, ankles: List[int], view: FrameView, constants: FootConstants) -> _Prior:
    """Return what feet before a frame and the shins tell: two measurements of the turn."""
    shins = joint_frames(people)[:, ankles].reshape(-1, 3, 3)
    shins = np.stack([shins[..., 2], shins[..., 1], -shins[..., 0]], axis=2)
    shin = np.broadcast_to(np.diag(constants.shin_spread ** -2.0), shins.shape)
    turn, axes = feet.turn.reshape(-1, 3, 3), feet.axes.reshape(-1, 3, 3)
    old = np.isfinite(turn[:, 0, 0])
    turn = np.where(old[:, None, None], turn, 0.0) + np.eye(3) * constants.turning ** 2 * max(view.elapsed, 1e-3)
    kept = np.where(old[:, None, None], np.linalg.inv(turn), 0.0)
    axes = np.where(old[:, None, None], axes, shins)
    away = rotation_of(np.swapaxes(axes, 1, 2) @ shins).as_rotvec()
    information = kept + shin
    mean = np.linalg.solve(information, (shin @ away[..., None]))[..., 0]
    position = people.xyz[:, ankles].reshape(-1, 3).astype(np.float64)
    sigma = people.sigma[:, ankles].ravel().astype(np.float64)
    known = np.isfinite(position).all(axis=1) & (sigma > 0)
    return _Prior(known, np.where(known[:, None], position, (0.0, 0.0, 1.0)), np.where(known, sigma, 1.0) ** 2 / 3,
                  axes, mean, information, (feet.shape[:, None] * _MIRROR).reshape(-1, 3, 3))


@np.errstate(invalid='ignore')
def _seen(observed: ObservedPeople, count: int, prior: _Prior, view: FrameView, method: MethodConstants) -> _Seen:
    """Return the keypoints of toes and heels of people, of which the first ones are observed."""
    skeleton, points, constants = observed.people_2d.skeleton, view.points, method.feet
    columns = [skeleton.index[name] for name in FEET]
    uv = np.full((count, 6, 2), np.nan)
    uv[:len(observed)] = observed.grid_xy[:, columns]
    scores = np.zeros((count, 6))
    scores[:len(observed)] = observed.people_2d.confidence[:, columns]
    known = np.isfinite(uv).all(axis=2)
    rays = view.camera.rays(np.where(known[..., None], uv, 0.0).reshape(-1, 2)).reshape(-1, 3, 3)
    known = known.reshape(-1, 3) & np.isfinite(rays).all(axis=2)
    rays = np.where(known[..., None], rays, (0.0, 0.0, 1.0))
    off = np.linalg.norm(_across(rays, prior.ankle[:, None]), axis=2)
    known &= prior.known[:, None] & (off < constants.reach + 2 * np.sqrt(prior.variance)[:, None])
    ankles = prior.known.reshape(count, 2)
    depth = np.where(ankles, prior.ankle[:, 2].reshape(count, 2), 0).sum(axis=1) / np.maximum(ankles.sum(axis=1), 1)
    depth = np.where(ankles.any(axis=1), depth, 1.0)
    focal = view.camera.focal_in((points.width, points.height))
    radius = np.clip(constants.window * focal / depth, *method.windows.limits)
    correction = method.track.correction
    across = correction.across + correction.across_by_score * (1 - np.minimum(scores, 1.0)) ** 2
    told = pixel_sigmas(observed.people_2d, observed.image_size, points)[:, columns]
    across[:len(observed)] = np.fmax(across[:len(observed)], told * depth[:len(observed), None] / focal)
    samples = window_depths(points, np.where(known.reshape(count, 6)[..., None], uv, np.nan), radius, method.windows)
    return _Seen(rays, known, across.reshape(-1, 3),
                 samples.reshape(len(known), 3, samples.shape[-1]) + constants.under_skin[:, None], view.floor)


def _across(rays: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the parts of points (..., 3) that are square to rays (..., 3)."""
    return points - rays * ((points * rays).sum(axis=-1) / (rays * rays).sum(axis=-1))[..., None]


def _updated(prior: _Prior, state: Optional[_State], seen: _Seen, method: MethodConstants) -> Tuple[_State, np.ndarray]:
    """Return feet with their keypoints, linearized at a state, None: before any, and which points are measured."""
    constants = method.feet
    axes = prior.axes if state is None else state.axes
    turned = np.zeros_like(prior.mean) if state is None else rotation_of(
        np.swapaxes(prior.axes, 1, 2) @ axes).as_rotvec()
    ways = _ways(axes, prior.shape)
    linear = prior.ankle[:, None] + prior.shape @ np.swapaxes(axes, 1, 2)
    mean = np.zeros((len(axes), _STATE))
    mean[:, _TURN] = prior.mean - turned
    information = _information(prior, constants)
    if state is None:
        state = _state((linear, ways, axes), mean, np.linalg.inv(information))
    weights, targets, measured = _measurements(state, seen, method)
    flat, missing = ways.reshape(-1, 9, _STATE), (targets - _times(weights, linear)).reshape(-1, 9)
    back = np.swapaxes(flat, 1, 2)
    covariance = np.linalg.inv(information + back @ (weights @ ways).reshape(flat.shape))
    vector = _times(information, mean) + _times(back, missing)
    return _state((linear, ways, axes), _times(covariance, vector), covariance), measured


def _information(prior: _Prior, constants: FootConstants) -> np.ndarray:
    """Return the information of states before any keypoint, (F, 15, 15)."""
    information = np.zeros((len(prior.axes), _STATE, _STATE))
    information[:, _ANKLE, _ANKLE] = np.eye(3) / prior.variance[:, None, None]
    information[:, _TURN, _TURN] = prior.turn
    information[:, _SHAPE, _SHAPE] = np.eye(9) / constants.shape_spread ** 2
    return information


def _ways(axes: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Return how points move with the state of a foot, (F, 3, 3, 15)."""
    ways = np.zeros((len(axes), 3, 3, _STATE))
    ways[..., _ANKLE] = np.eye(3)
    for point in range(3):
        ways[:, point, :, _TURN] = -axes @ _cross(shape[:, point])
        ways[:, point, :, 6 + 3 * point:9 + 3 * point] = axes
    return ways


def _state(at: Tuple[np.ndarray, np.ndarray, np.ndarray], mean: np.ndarray, covariance: np.ndarray) -> _State:
    """Return feet by their states; `at`: points, how they move, and axes, where these are 0."""
    linear, ways, axes = at
    return _State(linear + _times(ways, mean[:, None]), ways @ covariance[:, None] @ np.swapaxes(ways, 2, 3),
                  axes @ _rotation(mean[:, _TURN]), mean, covariance)


@np.errstate(invalid='ignore')
def _measurements(state: _State, seen: _Seen, method: MethodConstants) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return weights (F, 3, 3, 3) [1/m^2] and weighted places (F, 3, 3) of points, and which are on a surface, (F, 3).

    The surface is the foot's own where it is about as far as the point is expected.
    """
    constants = method.feet
    length = np.linalg.norm(seen.rays, axis=2)
    rays = seen.rays / length[..., None]
    expected = (state.points * rays).sum(axis=2)
    variance = (_times(state.covariance, rays) * rays).sum(axis=2)
    gate = constants.gate * np.sqrt(variance + constants.along ** 2)
    depth = seen.samples * length[..., None]
    own = np.abs(depth - expected[..., None]) < gate[..., None]
    measured = seen.known & (own.sum(axis=2) > constants.support * np.isfinite(depth).sum(axis=2))
    along = np.where(measured, lower_median(np.where(own, depth, np.nan)), expected)
    across = seen.across + np.where(measured, 0.0, method.inference.keypoint_error)
    line = rays[..., :, None] * rays[..., None, :]
    weights = np.where(seen.known, across ** -2.0, 0.0)[..., None, None] * (np.eye(3) - line) + np.where(
        measured, constants.along ** -2.0, 0.0)[..., None, None] * line
    targets = _times(weights, along[..., None] * rays)
    if seen.floor is not None:
        height = state.points @ seen.floor[:3] + seen.floor[3]
        below = np.where(height < 0, constants.sole ** -2.0, 0.0)[..., None]
        weights = weights + below[..., None] * np.outer(seen.floor[:3], seen.floor[:3])
        targets = targets - below * seen.floor[3] * seen.floor[:3]
    return weights, targets, measured


def _learnt(feet: Feet, state: _State, measured: np.ndarray, constants: FootConstants) -> Feet:
    """Return feet with the turns of a frame, and shapes that move towards those of its measured points."""
    count = len(feet)
    errors = state.mean[:, _SHAPE].reshape(count, 2, 3, 3) * _MIRROR
    seen = measured.reshape(count, 2, 3, 1)
    mean = np.where(seen, errors, 0.0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    share = 1 / (constants.frames + np.minimum(feet.frames, constants.frames))
    return Feet(feet.ids, state.axes.reshape(count, 2, 3, 3), state.full[:, _TURN, _TURN].reshape(count, 2, 3, 3),
                feet.shape + share[:, None, None] * mean, feet.frames + seen.any(axis=(1, 2, 3)))


def _times(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return the products of matrices (..., M, N) and vectors (..., N), (..., M)."""
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _cross(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices (N, 3, 3) of cross products with vectors (N, 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)


def _rotation(vectors: np.ndarray) -> np.ndarray:
    """Return rotation matrices (N, 3, 3) of rotation vectors (N, 3) [rad]: Rodrigues' formula."""
    angle = np.maximum(np.linalg.norm(vectors, axis=1), _LEAST_ANGLE)[:, None, None]
    cross = _cross(vectors)
    return np.eye(3) + np.sin(angle) / angle * cross + (1 - np.cos(angle)) / angle ** 2 * (cross @ cross)
