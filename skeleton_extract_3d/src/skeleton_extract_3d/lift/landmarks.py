"""Hands and faces in space: the depth at each of their points, or one inferred from the other points.

A point is measured where the surface around it lies at the depth of its hand or face. Others are inferred: of a hand at
the depth of the nearest measured point of the finger, of a face by the depth of the network's mesh relative to the
measured ones. Points of a hand behind another hand, and tips of fingers that are folded behind their own hand, lie
behind the surface that is seen there, and are inferred too.
"""
from dataclasses import replace
from typing import Tuple

import numpy as np

from openpose_ros_pkg.landmarks.face_points import face_points
from openpose_ros_pkg.landmarks.records import HAND_POINTS, Faces2D, Hands2D, Landmarks2D
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Landmarks3D, Points3D
from skeleton_extract_3d.lift.constants import LandmarkConstants
from skeleton_extract_3d.lift.face_direction import PointSurfaces, orientations
from skeleton_extract_3d.lift.observation import grid_positions
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.point_grid import PointGrid

# Which of `LandmarkConstants.flesh` holds for each point of a hand: wrist, thumb, fingers from the knuckle to the tip.
_FLESH = np.array([0, 1, 2, 4, 4, *(4 * [3, 4, 4, 4])])
# Points from which the depth of a hidden point of a hand is taken: the next ones of its finger, (5, 4).
_FINGER = np.arange(1, HAND_POINTS).reshape(5, 4)
# Ends of the bones of a hand and of the lines across its palm, (2, 23).
_BONES = np.array([(0, 1), *((base, base + 1) for base in range(1, 20) if base % 4), (0, 5), (0, 9), (0, 13), (0, 17),
                   (5, 9), (9, 13), (13, 17)]).T


@np.errstate(invalid='ignore')  # what is missing is NaN
def lift_landmarks(found: Landmarks2D, points: PointGrid, image_size: Tuple[int, int], people: People3D,
                   constants: LandmarkConstants = METHOD.landmarks) -> Landmarks3D:
    """Return hands and faces [px of the image] in the frame of the points.

    Hands whose depth is not that of the person's wrist are of another person, or none, and left out.

    Raises:
        BadInputError: the points are in no optical frame.
    """
    camera, lifted = points.camera_model(), Landmarks3D()
    if camera is None:
        return lifted
    if len(found.hands):
        surfaces = _surfaces(found.hands.keypoints, points, image_size, camera, constants)
        lifted = replace(lifted, hands=_lift_hands(found.hands, surfaces, people, constants))
    if len(found.faces):
        surfaces = _surfaces(found.faces.keypoints, points, image_size, camera, constants)
        meshes = _surfaces(found.faces.mesh, points, image_size, camera, constants)
        directions = orientations(found.faces.mesh, meshes, constants)
        lifted = replace(lifted, faces=Faces3D(_lift_faces(found.faces, surfaces, constants), found.faces.scores,
                                               found.faces.people, *directions))
    return lifted


def _lift_hands(hands: Hands2D, seen: PointSurfaces, people: People3D, constants: LandmarkConstants) -> Hands3D:
    middle = _median(seen.depth)
    wrists = _wrist_depths(hands, people)
    own = ~(np.abs(middle - wrists) > constants.wrist_depth)
    near = np.abs(seen.depth - middle[:, np.newaxis]) <= constants.hand_depth
    behind = _behind(hands, seen, _first(wrists, middle), constants)
    measured = near & own[:, np.newaxis] & np.isnan(behind)
    depth = np.where(measured, seen.depth, np.nan)
    filled = _first(np.where(near & own[:, np.newaxis], behind, np.nan),
                    _filled(depth, np.where(own, _median(depth), np.nan)))
    kept = np.isfinite(filled).any(axis=1)
    flesh = np.array(constants.flesh)[_FLESH]
    depth = np.where(measured, depth, filled) + flesh
    points = _placed(PointSurfaces(seen.rays[kept], seen.depth[kept], seen.focal), depth[kept], measured[kept],
                     hands.keypoints[kept, :, 2], constants)
    return Hands3D(points, hands.scores[kept], hands.people[kept], hands.left[kept])


def _wrist_depths(hands: Hands2D, people: People3D) -> np.ndarray:
    """Return the depth of the measured wrist of each hand's person, (H,) [m]; NaN where not known."""
    index = people.skeleton.index
    depths = np.full(len(hands), np.nan)
    for hand, (person, left) in enumerate(zip(hands.people.tolist(), hands.left.tolist())):
        row, wrist = np.flatnonzero(people.ids == person), index.get('left_wrist' if left else 'right_wrist')
        if len(row) and wrist is not None and people.status[row[0], wrist] == MEASURED:
            depths[hand] = people.xyz[row[0], wrist, 2]
    return depths


def _behind(hands: Hands2D, seen: PointSurfaces, wrists: np.ndarray, constants: LandmarkConstants) -> np.ndarray:
    """Return the depth of points that are behind the surface at their pixel, (H, 21) [m]; NaN of all others.

    A point on the bones of a hand whose wrist (H,) is nearer [m] is between the surface of that hand and its own wrist.
    Of a hand that shows its back, the ends of fingers on their own first bones are behind these.
    """
    xy = hands.keypoints[..., :2].astype(np.float64)  # [px of the image]
    behind = np.full(xy.shape[:2], np.nan)
    near = constants.half_finger * seen.focal / wrists  # [px]
    for hand, front in np.argwhere(wrists[:, np.newaxis] - wrists > constants.in_front):
        covered = _distances(xy[hand], *xy[front, _BONES]).min(axis=1) < near[hand]
        surface = seen.depth[hand] + constants.in_front
        behind[hand, covered] = ((surface + np.maximum(surface, wrists[hand])) / 2)[covered]
    for hand in np.flatnonzero(_shows_back(xy, hands.left, constants.back)):
        for base, middle, *ends in _FINGER[1:]:
            bones = xy[hand, [0, base]], xy[hand, [base, middle]]
            folded = _distances(xy[hand, ends], *bones).min(axis=1) < near[hand]
            fold = np.array(ends)[folded & np.isnan(behind[hand, ends])]
            behind[hand, fold] = seen.depth[hand, fold] + 2 * constants.half_finger
    return behind


def _shows_back(xy: np.ndarray, left: np.ndarray, least: float) -> np.ndarray:
    """Return which hands (H, 21, 2) [px] show their back: the knuckles run the other way than those of a palm, (H,)."""
    index, middle, little = (xy[:, knuckle] - xy[:, 0] for knuckle in (5, 9, 17))
    turn = index[:, 0] * little[:, 1] - index[:, 1] * little[:, 0]
    return np.asarray(np.where(left, -turn, turn) > least * (middle ** 2).sum(axis=1))


def _distances(points: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return how far points (K, 2) are from lines between starts and ends (B, 2), (K, B)."""
    along, to = ends - starts, points[:, np.newaxis] - starts
    share = (to * along).sum(axis=2) / np.maximum((along ** 2).sum(axis=1), 1e-9)
    return np.asarray(np.linalg.norm(to - np.clip(share, 0, 1)[..., np.newaxis] * along, axis=2))


def _filled(depth: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return the depth of points of hands (H, 21), where it is missing that of the nearest one of the finger."""
    filled, fingers = depth.copy(), depth[:, _FINGER]
    # outwards, then inwards for what begins a finger
    for joint, other in ((1, 0), (2, 1), (3, 2), (2, 3), (1, 2), (0, 1)):
        fingers[..., joint] = _first(fingers[..., joint], fingers[..., other])
    filled[:, _FINGER] = fingers
    return _first(filled, middle[:, np.newaxis])


def _lift_faces(faces: Faces2D, seen: PointSurfaces, constants: LandmarkConstants) -> Points3D:
    # depth of the points beside that of the whole face, by the network [px of the image] and then [m]
    relief = face_points(np.nan_to_num(faces.mesh.astype(np.float64)))[..., 2] / seen.focal * _median(
        seen.depth)[:, np.newaxis]
    base = _median(seen.depth - relief)[:, np.newaxis]
    measured = np.abs(seen.depth - relief - base) <= constants.face_depth
    return _placed(seen, np.where(measured, seen.depth, base + relief), measured, faces.keypoints[..., 2], constants)


def _surfaces(keypoints: np.ndarray, points: PointGrid, image_size: Tuple[int, int], camera: CameraModel,
              constants: LandmarkConstants) -> PointSurfaces:
    """Return rays and depths of points (N, K, 3) of an image: x, y [px], score."""
    uv = grid_positions(keypoints[..., :2], image_size, (points.width, points.height))
    shape = uv.shape[:2]
    rays = camera.rays(uv.reshape(-1, 2)).reshape(*shape, 3)
    pixels = np.where(np.isfinite(uv), np.round(np.nan_to_num(uv)), -1e6).astype(np.int64).reshape(-1, 2)
    window = points.window(pixels[:, 0], pixels[:, 1], constants.window)[..., 2]
    enough = np.isfinite(window).sum(axis=1, keepdims=True) >= constants.least_points
    depth = _median(np.where(enough, window, np.nan))
    return PointSurfaces(rays, depth.reshape(shape), camera.focal_in(image_size))


def _placed(seen: PointSurfaces, depth: np.ndarray, measured: np.ndarray, confidence: np.ndarray,
            constants: LandmarkConstants) -> Points3D:
    """Return points at depths (N, K) [m] on their rays; missing where there is none."""
    xyz = seen.rays * depth[..., np.newaxis]
    known = np.isfinite(xyz).all(axis=2)
    status = np.where(known, np.where(measured, MEASURED, INFERRED), MISSING).astype(np.uint8)
    sigma = np.hypot(np.where(measured, constants.measured_sigma, constants.inferred_sigma),
                     constants.pixel_sigma * depth / seen.focal)
    return Points3D(np.where(known[..., np.newaxis], xyz, np.nan), confidence, status, np.where(known, sigma, np.nan))


def _first(values: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return values, or others where they are NaN."""
    return np.where(np.isfinite(values), values, others)


def _median(values: np.ndarray) -> np.ndarray:
    """Return the medians of the rows (N, K); NaN where a row has no number."""
    result = np.full(len(values), np.nan)
    known = np.isfinite(values).any(axis=1)
    result[known] = np.nanmedian(values[known], axis=1)
    return result
