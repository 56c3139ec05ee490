"""The direction of a head, by the mesh of its face.

The network gives the mesh in orthographic projection along the line of sight to the face. Three axes are taken from
points of both sides and of top and bottom, and turned with the line of sight. As both sides of a face are alike, the
mesh tells its turn. Its tilt depends on how far the mouth is before the eyes, which the network knows of an average
face only: it is corrected by the slope of the measured surface against the mesh, from chin to forehead.
"""
from typing import NamedTuple, Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.landmarks.records import FACE_POINTS, MESH_POINTS
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.constants import LandmarkConstants
from skeleton_extract_3d.points.transform import quaternions

# By the number of points of a mesh: points of the person's left and right that mirror each other (corners of eyes and
# mouth, jaw), corners of the eyes, corners of the mouth.
_LANDMARKS = {
    MESH_POINTS: ([263, 362, 291, 454, 389, 397], [33, 133, 61, 234, 162, 172], [33, 133, 263, 362], [61, 291]),
    FACE_POINTS: ([45, 42, 54, 15, 16, 12], [36, 39, 48, 1, 0, 4], [36, 39, 42, 45], [48, 54])}
# A slope is fitted to so many points at least, in so many rounds, each without those this many deviations off.
_LEAST_POINTS = 16
_ROUNDS, _OUTLIER = 5, 2.5
# A face that is turned further away is as uncertain as one at this cosine to the line of sight.
_LEAST_COSINE = 0.2


class PointSurfaces(NamedTuple):
    """Points of N hands or faces in an image: rays (N, K, 3) with z = 1, NaN where a point is missing, depth of the
    surfaces (N, K) [m], NaN where there is none, and focal length [px of the image].
    """

    rays: np.ndarray
    depth: np.ndarray
    focal: float


def orientations(mesh: np.ndarray, seen: PointSurfaces, constants: LandmarkConstants = METHOD.landmarks
                 ) -> Tuple[np.ndarray, np.ndarray]:
    """Return the orientations of heads, (F, 4) quaternions, and their errors, (F,) [rad]; see `Faces3D`.

    Args:
        mesh: (F, M, 3) [px of an image], see `Faces2D`; NaN where it is not known.
        seen: the surfaces at the points of the mesh.
    """
    known = np.isfinite(mesh).all(axis=(1, 2))
    if not known.all():
        turns, errors = np.full((len(mesh), 4), np.nan, np.float32), np.full(len(mesh), np.nan, np.float32)
        if known.any():
            turns[known], errors[known] = orientations(
                mesh[known], PointSurfaces(seen.rays[known], seen.depth[known], seen.focal), constants)
        return turns, errors
    mesh, (on_left, on_right, eyes, mouth) = mesh.astype(np.float64), _LANDMARKS[mesh.shape[1]]
    left = _unit((mesh[:, on_left] - mesh[:, on_right]).mean(axis=1))
    up = _square(mesh[:, eyes].mean(axis=1) - mesh[:, mouth].mean(axis=1), left)
    sight = _unit(seen.rays.mean(axis=1))
    slopes, errors = _slopes(mesh, up, sight, seen, constants)
    mesh_variance = constants.face_tilt_sigma ** 2
    share = mesh_variance / (mesh_variance + errors ** 2)
    up = _square(up + (share * slopes)[:, np.newaxis] * [0.0, 0.0, 1.0], left)
    axes = np.stack([np.cross(left, up), left, up], axis=2)
    # of a face that is turned away, the visible part shrinks in the image
    turn_sigma = constants.face_turn_sigma / np.maximum(-axes[:, 2, 0], _LEAST_COSINE)
    sigma = np.sqrt(turn_sigma ** 2 + constants.face_shape_sigma ** 2 + (1 - share) * mesh_variance)
    return quaternions(_turned(axes, sight)).astype(np.float32), sigma.astype(np.float32)


def _slopes(mesh: np.ndarray, up: np.ndarray, sight: np.ndarray, seen: PointSurfaces, constants: LandmarkConstants
            ) -> Tuple[np.ndarray, np.ndarray]:
    """Return how much further the surfaces are than the meshes per way along `up` (F, 3), and its errors, (F,) each."""
    slopes, errors = np.zeros(len(mesh)), np.full(len(mesh), np.inf)
    density = mesh.shape[1] / MESH_POINTS
    least, alike = max(constants.face_points * density, _LEAST_POINTS), max(constants.face_alike * density, 1.0)
    for face, depth in enumerate(seen.depth):
        if np.isfinite(depth).sum() < least:
            continue
        shape = (mesh[face] - mesh[face].mean(axis=0)) * float(np.nanmedian(depth)) / seen.focal  # [m]
        further = (seen.rays[face] * depth[:, np.newaxis]) @ sight[face] - shape[:, 2]
        front = shape[:, 2] <= np.percentile(shape[:, 2], constants.face_front)
        with np.errstate(invalid='ignore'):
            used = front & (np.abs(further - np.nanmedian(further)) <= constants.face_depth)
        slopes[face], errors[face] = _slope(shape[used] @ up[face], further[used], least, alike)
    return slopes, errors


def _slope(x: np.ndarray, y: np.ndarray, least: float, alike: float) -> Tuple[float, float]:
    """Return the slope of y over x, (N,) each, without outliers, and its error; 0 and infinity of less points than
    `least`; so many have the same error.
    """
    used, slope, error = np.ones(len(x), bool), 0.0, np.inf
    for _ in range(_ROUNDS):
        if used.sum() < least:
            return 0.0, np.inf
        middle = x[used].mean()
        along = x[used] - middle
        slope, offset = along @ y[used] / (along @ along), y[used].mean()
        off = np.abs(y - offset - slope * (x - middle))
        spread = 1.4826 * np.median(off[used])
        error = spread * np.sqrt(alike / (along @ along))
        used &= off <= _OUTLIER * spread + 1e-6
    return float(slope), float(error)


def _turned(axes: np.ndarray, sight: np.ndarray) -> np.ndarray:
    """Turn axes (F, 3, 3) as the optical axis is turned onto the lines of sight (F, 3)."""
    around = np.cross([0.0, 0.0, 1.0], sight)
    sine = np.linalg.norm(around, axis=1, keepdims=True)
    turn = np.arctan2(sine, sight[:, 2:])
    rotation = Rotation.from_rotvec(around * np.where(sine > 1e-9, turn / np.maximum(sine, 1e-9), 0.0))
    return np.stack([rotation.apply(axes[:, :, axis]) for axis in range(3)], axis=2)


def _square(vectors: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the parts of vectors (F, 3) that are square to an axis (F, 3), with length 1."""
    return _unit(vectors - (vectors * axis).sum(axis=1, keepdims=True) * axis)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
