"""Toes and heels: each foot is a rigid body on its tracked ankle.

Its turn is the one that fits best (Wahba's problem, solved by Markley's SVD) the turn of the frame before, that of the
shin, and the keypoints: each of them tells a ray, and a depth where the surface there is the foot's own. A point is the
mean of its keypoint and of where the rigid foot has it, by their precisions; without a keypoint it is where the foot
has it.
"""
import itertools
from dataclasses import dataclass, field
from typing import Dict, NamedTuple, Sequence, Tuple

import numpy as np

from skeleton_extract_3d.body.constants import FootConstants
from skeleton_extract_3d.body.extra_joints import Joint
from skeleton_extract_3d.body.joint_frames import joint_frames
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.lift.surfaces import lower_median, window_depths
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.track.tracks import Rows

FEET = tuple(f'{side}_{part}' for side in ('left', 'right') for part in ('big_toe', 'small_toe', 'heel'))
_ANKLES = ('left_ankle', 'right_ankle')
# A right foot mirrors a left one.
_MIRROR = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])[:, None]


@dataclass(frozen=True, eq=False)
class Feet(Rows):
    """The feet of T tracks, the left one first.

    Attributes:
        ids: (T,) int64 of the tracks.
        axes: (T, 2, 3, 3) forwards, left and up of each foot as columns, in the frame of the points.
        precision: (T, 2) of their turns, per axis [1/rad^2]; 0: not known.
    """

    ids: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    axes: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 3, 3)))
    precision: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))


class _Keypoints(NamedTuple):
    """Keypoints of P people: unit rays (P, 2, 3, 3), whether there is one (P, 2, 3), errors across (P, 2, 3) [m], and
    samples of the distance of the surface along the ray (P, 2, 3, 25) [m].
    """

    rays: np.ndarray
    known: np.ndarray
    across: np.ndarray
    samples: np.ndarray


def follow_feet(before: Feet, people: People3D, statures: np.ndarray, observed: ObservedPeople, view: FrameView,
                method: MethodConstants = METHOD) -> Tuple[Feet, Dict[str, Joint]]:
    """Return the feet of people, (M,), after a frame, and their toes and heels by name; MISSING without the ankle.

    Args:
        before: of the tracks.
        people: with the joints of COCO_18; the first are those of `observed`, the others are hidden.
        statures: (M,) [m].
    """
    if not len(people) or not set(FEET) <= set(observed.people_2d.skeleton.joints):
        return Feet(), {}
    constants, rows = method.feet, [people.skeleton.index[name] for name in _ANKLES]
    there = people.status[:, rows] != MISSING
    ankle = np.where(there[..., None], people.xyz[:, rows], (0.0, 0.0, 1.0)).astype(np.float64)
    variance = np.where(there, people.sigma[:, rows], 1.0).astype(np.float64) ** 2 / 3
    shape = (constants.shape * (statures / method.body.adult_stature)[:, None, None])[:, None] * _MIRROR
    axes, precision = _expected_axes(before, people, rows, view, constants)
    seen = _keypoints(observed, ankle, there, view, method)
    expected, spread = _rigid(ankle, variance, (axes, precision), shape, constants)
    target, across, measured = _measured(seen, expected, spread, method)
    weights = np.where(seen.known, 1 / (across ** 2 + variance[..., None] + constants.shape_spread ** 2), 0.0)
    turns = np.swapaxes(target - ankle[..., None, :], 2, 3) @ (weights[..., None] * shape)
    axes = _nearest_rotations(turns + precision[..., None, None] / 2 * axes)
    precision = precision + 2 / 3 * (weights * (shape ** 2).sum(axis=3)).sum(axis=2)
    expected, spread = _rigid(ankle, variance, (axes, precision), shape, constants)
    # shares of the keypoint across and along its ray
    of_across = np.where(seen.known, spread / (spread + across ** 2), 0.0)
    of_along = np.where(measured, spread / (spread + constants.along ** 2), 0.0)
    off = target - expected
    far = (off * seen.rays).sum(axis=3, keepdims=True) * seen.rays
    xyz = expected + of_across[..., None] * (off - far) + of_along[..., None] * far
    sigma = np.sqrt(spread * (2 * (1 - of_across) + 1 - of_along) + method.inference.keypoint_error ** 2)
    if view.floor is not None:  # what would be below the floor stands on it
        xyz = xyz - np.minimum(xyz @ view.floor[:3] + view.floor[3], 0.0)[..., None] * view.floor[:3]
    xyz, sigma = np.where(there[..., None, None], xyz, np.nan), np.where(there[..., None], sigma, np.nan)
    status = np.where(there[..., None], np.where(measured, MEASURED, INFERRED), MISSING)
    velocity = people.velocity[:, rows]
    joints = {name: (xyz[:, side, point], status[:, side, point], sigma[:, side, point], velocity[:, side])
              for name, (side, point) in zip(FEET, itertools.product(range(2), range(3)))}
    return Feet(people.ids, axes, np.where(there, precision, 0.0)), joints


def _expected_axes(before: Feet, people: People3D, ankles: Sequence[int], view: FrameView, constants: FootConstants
                   ) -> Tuple[np.ndarray, np.ndarray]:
    """Return axes (P, 2, 3, 3) of feet and their precision (P, 2) by the frame before and by the shins."""
    shins = joint_frames(people)[:, ankles]
    shins = np.stack([shins[..., 2], shins[..., 1], -shins[..., 0]], axis=3)
    rows = {number: row for row, number in enumerate(before.ids.tolist())}
    known = np.array([rows.get(number, -1) for number in people.ids.tolist()])
    old = np.concatenate([before.precision, np.zeros((1, 2))])[known]
    old = 1 / (1 / np.maximum(old, 1e-9) + constants.turning ** 2 * max(view.elapsed, 1e-3))
    axes = np.concatenate([before.axes, np.zeros((1, 2, 3, 3))])[known]
    shin = constants.shin_spread ** -2.0
    return _nearest_rotations(old[..., None, None] * axes + shin * shins), old + shin


def _rigid(ankle: np.ndarray, variance: np.ndarray, turn: Tuple[np.ndarray, np.ndarray], shape: np.ndarray,
           constants: FootConstants) -> Tuple[np.ndarray, np.ndarray]:
    """Return points (P, 2, 3, 3) of rigid feet and their variance per axis (P, 2, 3), by their axes and precision."""
    axes, precision = turn
    arms = (shape ** 2).sum(axis=3)
    return (ankle[..., None, :] + shape @ np.swapaxes(axes, 2, 3),
            variance[..., None] + constants.shape_spread ** 2 + 2 / 3 * arms / precision[..., None])


def _nearest_rotations(matrices: np.ndarray) -> np.ndarray:
    """Return the rotations (..., 3, 3) R with the greatest trace of R^T B for matrices B."""
    left, _, right = np.linalg.svd(np.nan_to_num(matrices))
    left[..., 2] *= np.linalg.det(left @ right)[..., None]
    return left @ right


@np.errstate(invalid='ignore')
def _keypoints(observed: ObservedPeople, ankle: np.ndarray, there: np.ndarray, view: FrameView, method: MethodConstants
               ) -> _Keypoints:
    """Return the keypoints of toes and heels of people with ankles (P, 2, 3), of which the first ones are observed."""
    skeleton, points, constants, count = observed.people_2d.skeleton, view.points, method.feet, len(ankle)
    columns, shape = [skeleton.index[name] for name in FEET], (count, 2, 3)
    uv, scores = np.full((count, 6, 2), np.nan), np.zeros((count, 6))
    uv[:len(observed)] = observed.grid_xy[:, columns]
    scores[:len(observed)] = observed.people_2d.confidence[:, columns]
    rays = view.camera.rays(np.nan_to_num(uv).reshape(-1, 2)).reshape(count, 6, 3)
    known = np.isfinite(uv).all(axis=2) & np.isfinite(rays).all(axis=2)
    rays = np.where(known[..., None], rays, (0.0, 0.0, 1.0))
    length = np.linalg.norm(rays, axis=2)
    depth = np.where(there, ankle[..., 2], 0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
    depth = np.where(there.any(axis=1), depth, 1.0)
    focal = view.camera.focal_in((points.width, points.height))
    radius = np.clip(constants.window * focal / depth, *method.windows.limits)
    # beside the tip of a toe is the floor: what is sampled is nearer to the ankle
    towards = view.camera.project(np.repeat(ankle, 3, axis=1).reshape(-1, 3)).reshape(uv.shape) - uv
    inner = uv + constants.inwards * np.where(np.isfinite(towards), towards, 0.0)
    samples = window_depths(points, np.where(known[..., None], inner, np.nan), radius, method.windows)
    samples = (samples + np.tile(constants.under_skin, 2)[:, None]) * length[..., None]
    correction = method.track.correction
    across = correction.across + correction.across_by_score * (1 - np.minimum(scores, 1.0)) ** 2
    rays = (rays / length[..., None]).reshape(*shape, 3)
    to_ankle = ankle[..., None, :] - (ankle[..., None, :] * rays).sum(axis=3, keepdims=True) * rays
    known = known.reshape(shape) & there[..., None] & (np.linalg.norm(to_ankle, axis=3) < constants.reach)
    return _Keypoints(rays, known, across.reshape(shape), samples.reshape(*shape, -1))


@np.errstate(invalid='ignore')
def _measured(seen: _Keypoints, expected: np.ndarray, spread: np.ndarray, method: MethodConstants
              ) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points (P, 2, 3, 3) on the rays, their errors across (P, 2, 3) [m], and which are on the foot's
    own surface (P, 2, 3): one about as far as the point is expected, with a variance `spread` per axis.
    """
    constants = method.feet
    distance = (expected * seen.rays).sum(axis=3)
    gate = constants.gate * np.sqrt(spread + constants.along ** 2)
    own = np.abs(seen.samples - distance[..., None]) < gate[..., None]
    measured = seen.known & (own.sum(axis=3) > constants.support * np.isfinite(seen.samples).sum(axis=3))
    distance = np.where(measured, lower_median(np.where(own, seen.samples, np.nan)), distance)
    across = seen.across + np.where(measured, 0.0, method.inference.keypoint_error)
    return distance[..., None] * seen.rays, across, measured
