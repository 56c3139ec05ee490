"""Registration of bodies: where a person is in a frame without a crop, by the points alone.

The points on the body in the last frame in which a network saw it are moved onto the points of this one, by
Gauss-Newton steps from where the track expects it; see docs/method.md#registration-between-crops and registration.cpp.
A body is thirteen places of `lift.robust`: corners of the trunk, elbows and knees, wrists and ankles, head.
"""
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from skeleton_extract_3d.body.body import CHAINS, HEAD, of_all_joints
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.points.transform import Transform

# Bodies whose middles are further apart do not meet [m].
_APART = 1.5
# Depth at least, of what is divided by it [m].
_LEAST_DEPTH = 0.3
# Ends of the eight bones of limbs, among the places, (8, 2).
_LIMBS = np.array([[limb, limb + 4] for limb in range(8)])

# Depths (h, w) float32 [m], not positive or not finite where missing, and the affine map (2, 3) from column, row, 1 to
# x and y of the ray.
DepthGrid = Tuple[np.ndarray, np.ndarray]


class SeenBodies(NamedTuple):
    """The T bodies of a frame.

    Attributes:
        points, camera: of the frame.
        pose: of the camera, see `Frame.tracking_from_points`.
        stamp: of the frame [s].
        ids: (T,) of the tracks.
        looked: (T,) bool, bodies that a network saw.
        places: (T, 13, 3) [m].
        radii: (T, 13) of the bodies at their places [m].
        measured: (T, 18) bool, joints whose surface was seen.
        scores: (T, 18) of the keypoints.
    """

    points: PointGrid
    camera: CameraModel
    pose: Optional[Transform]
    stamp: float
    ids: np.ndarray
    looked: np.ndarray
    places: np.ndarray
    radii: np.ndarray
    measured: np.ndarray
    scores: np.ndarray


class Surface(NamedTuple):
    """The points on a body in the last frame in which a network saw it.

    Attributes:
        samples: points (N, 3) [m], normals (N, 3), and parts of the body (N,).
        places: (13, 3) [m].
        radii: (13,) of the body at its places [m].
        measured: (18,) bool, joints whose surface was seen.
        scores: (18,) of the keypoints.
        stamp: of the frame [s].
        pose: of the camera, see `Frame.tracking_from_points`.
    """

    samples: Tuple[np.ndarray, np.ndarray, np.ndarray]
    places: np.ndarray
    radii: np.ndarray
    measured: np.ndarray
    scores: np.ndarray
    stamp: float
    pose: Optional[Transform]


def moved_joints(position: np.ndarray, before: np.ndarray, places: np.ndarray, sigma: np.ndarray
                 ) -> Tuple[np.ndarray, np.ndarray]:
    """Return joints (18, 3) [m] moved along with places from where these were (13, 3), and their sigma (18,) [m]."""
    return position + of_all_joints((places - before)[None])[0], of_all_joints(sigma[None])[0]


def places_of(position: np.ndarray, has: np.ndarray) -> np.ndarray:
    """Return the places (T, 13, 3) of bodies with joints (T, 18, 3) [m], of which they have (T, 18) some."""
    known = np.where(has[:, HEAD].any(axis=1)[:, None], has[:, HEAD], True)[..., None]
    head = np.where(known, position[:, HEAD], 0.0).sum(axis=1) / known.sum(axis=1)
    return np.concatenate([position[:, CHAINS], head[:, None]], axis=1)


def radii_of(stature: np.ndarray, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the radii of bodies with statures (T,) [m] at their places, (T, 13) [m]."""
    body = method.body
    adult = np.append(np.maximum(body.under_skin[CHAINS], method.registration.least_radius),
                      np.mean(body.head_axes))
    return adult * (stature / body.adult_stature)[:, None]


def surfaces_of(seen: SeenBodies, ids: np.ndarray, method: MethodConstants = METHOD) -> Dict[int, Surface]:
    """Return the surfaces of those of the bodies with ids (N,) that a network saw, by their ids."""
    rows = np.flatnonzero(seen.looked & np.isin(seen.ids, ids))
    if not len(rows):
        return {}
    limbs, trunk = seen.measured[:, CHAINS[_LIMBS]].all(axis=2), seen.measured[:, CHAINS[:4]].sum(axis=1) >= 2
    usable = np.column_stack([limbs, trunk, seen.measured[:, HEAD].any(axis=1)])
    others, surfaces = neighbours(seen.places), {}
    for row, grid in zip(rows.tolist(), grids_of(seen.points, seen.camera, seen.places[rows], method)):
        if grid is not None:
            samples = method.compiled.sample_surface(grid, seen.places[row], usable[row], others[row], seen.radii[row])
            surfaces[int(seen.ids[row])] = Surface(samples, seen.places[row], seen.radii[row], seen.measured[row],
                                                   seen.scores[row], seen.stamp, seen.pose)
    return surfaces


def register(surface: Surface, grid: DepthGrid, expected: Tuple[np.ndarray, np.ndarray], others: np.ndarray,
             change: Optional[Tuple[np.ndarray, np.ndarray]] = None, method: MethodConstants = METHOD
             ) -> Optional[Tuple[np.ndarray, np.ndarray]]:
    """Return the places (13, 3) of a body in a frame and their standard deviations per axis (13,) [m]; None: too little
    of it is in view, or the points do not fit it.

    Args:
        grid: depths around it.
        expected: where its track expects the places (13, 3) [m], with their covariances (13, 3, 3) [m^2].
        others: (Q, 13, 3) bodies near it [m].
        change: rotation and translation [m] of the frame of the points since the body was seen; None: none.
    """
    constants, before, (points, normals, parts) = method.registration, surface.places, surface.samples
    if len(points) < constants.least_points:
        return None
    if change is not None:
        rotation, translation = change
        points, normals = points @ rotation.T + translation, normals @ rotation.T
        before = before @ rotation.T + translation
    places, covariance, (fit, in_view) = method.compiled.register_surface(
        grid, (points, normals, parts), before, expected, others, surface.radii)
    if fit < constants.least_fit or in_view < constants.least_in_view:
        return None
    return places, np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 3)


def grids_of(points: PointGrid, camera: CameraModel, places: np.ndarray, method: MethodConstants = METHOD
             ) -> List[Optional[DepthGrid]]:
    """Return the depths around bodies with places (T, 13, 3) [m]; None: the body is out of view."""
    constants, size, count = method.registration, np.array([points.width, points.height]), len(places)
    focal, depth = camera.focal_in((points.width, points.height)), np.maximum(places[..., 2], _LEAST_DEPTH)
    uv = camera.project(places.reshape(-1, 3)).reshape(count, -1, 2)
    around = (constants.margin * focal / depth)[..., None]
    steps = np.maximum(constants.spacing * focal / np.median(depth, axis=1) + 0.5, 1).astype(np.int64)
    with np.errstate(invalid='ignore'):
        low, high = np.clip((uv - around).min(axis=1), 0, size), np.clip((uv + around).max(axis=1), 0, size)
        inside = (high - low >= 2 * steps[:, None]).all(axis=1)
    low, high = (np.where(inside[:, None], value, 0).astype(np.int64) for value in (low, high))
    # where a lens bends the rays, they are those of an undistorted camera that is like it at the body
    middle, step = (low + high) // 2, steps[:, None]
    corners = np.stack([middle, middle + step * [1, 0], middle + step * [0, 1]], axis=1)
    origin, right, below = np.moveaxis(camera.rays(corners.reshape(-1, 2)).reshape(count, 3, 3)[..., :2], 1, 0)
    slopes = np.stack([right - origin, below - origin], axis=2)
    rays = np.concatenate([slopes, (origin - (slopes @ ((middle - low) / step)[..., None])[..., 0])[..., None]], axis=2)
    inside &= np.isfinite(rays).all(axis=(1, 2))
    return [(points.patch(low[i], high[i], int(steps[i])), rays[i]) if inside[i] else None for i in range(count)]


def neighbours(places: np.ndarray) -> List[np.ndarray]:
    """Return the bodies (Q, 13, 3) that may meet each of the bodies (T, 13, 3) [m], or cover it in the image."""
    depth = np.maximum(places[..., 2], _LEAST_DEPTH)
    middle = (places[..., :2] / depth[..., None]).mean(axis=1)
    apart = np.linalg.norm(middle[:, None] - middle, axis=2) * depth.mean(axis=1)[:, None]
    near = (apart < _APART) & ~np.eye(len(places), dtype=bool)
    return [places[others] for others in near]
