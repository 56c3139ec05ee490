"""Edges with cameras without depth: resection in people in space, or the essential matrix of two images.

Clock offset and matching people are searched: for each offset, pairs of people suggest a pose (OpenCV, RANSAC), and the
pose by which most joints of all people meet their rays wins.
"""
from functools import partial
from typing import Callable, List, NamedTuple, Optional, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.alignment.candidates import merit
from openpose_ros_tools.calibration.recording import CameraPaths
from skeleton_extract_3d.points.transform import Transform

# Joints by which one pair of people suggests a pose, at most and at least.
_MOST_POINTS, _LEAST_POINTS = 150, 24
# Maximum clock offset that is searched, as each costs a resection, and its step [s]; times that are compared.
_SEARCH, _STEP, _TIMES = 0.5, 0.05, 60
# Pairs of people that are tried for each offset.
_MOST_PAIRS = 12
# A joint meets a ray at this distance, as a share of the distance from the camera.
_GATE = 0.02
# Joints that must meet, or two cameras have nothing in common; also as a share of those of people visible to both.
LEAST_JOINTS, _LEAST_SHARE = 40, 0.4
# RANSAC: error of inliers in the plane z = 1, its iterations, and its certainty.
_RANSAC_ERROR, _ITERATIONS, _CERTAINTY = 0.012, 100, 0.99
# Offsets near the best one that are tried then [s].
_FINE = np.arange(-4, 5) * 0.0125
_STILL = np.zeros(4)


Solve = Callable[[np.ndarray, np.ndarray], Optional[Transform]]


class _Method(NamedTuple):
    """How two cameras are related: by single pairs of people, then by all joints that meet; and how far joints miss."""

    suggest: Solve
    solve: Solve
    distances: Callable[[Transform, np.ndarray, np.ndarray], np.ndarray]


class _Found(NamedTuple):
    merit: float
    pose: Transform
    lag: float


def resect(first: CameraPaths, second: CameraPaths, clock_offset: Optional[float]) -> Tuple[Transform, float, float]:
    """Return the transform from a camera with depth to one without, the clock offset [s] and the cost.

    Raises:
        BadInputError: joints of the one do not lie on the rays of the other.
    """
    return _search(first, second, clock_offset, _Method(_pose_of_points, _pose_of_points, _image_distances))


def relate_images(first: CameraPaths, second: CameraPaths, clock_offset: Optional[float]
                  ) -> Tuple[Transform, float, float]:
    """Return the transform between two cameras without depth, its translation of length 1, clock offset and cost.

    Raises:
        BadInputError: rays do not meet.
    """
    # RANSAC spends all of its 1000 iterations on pairs of different people; LMedS always needs 90
    suggest = _pose_of_rays if clock_offset is not None else partial(_pose_of_rays, method=cv2.LMEDS)
    return _search(first, second, clock_offset, _Method(suggest, _pose_of_rays, _epipolar_distances))


def _search(first: CameraPaths, second: CameraPaths, clock_offset: Optional[float], method: _Method
            ) -> Tuple[Transform, float, float]:
    """Return the best pose, the clock offset [s] and the cost."""
    frames = first.times[np.unique(np.linspace(0, len(first.times) - 1, _TIMES).astype(int))]
    points, steps = first.at(frames), int(_SEARCH / _STEP)
    lags = _STEP * np.arange(-steps, steps + 1) if clock_offset is None else np.array([clock_offset])

    def found(pose: Transform, lag: float, there: np.ndarray) -> _Found:
        gaps = np.moveaxis(method.distances(pose, points, there), 1, 0)
        return _Found(merit(gaps.reshape(len(gaps), -1, gaps.shape[3]), _GATE), pose, lag)

    suggested = [found(pose, lag, there) for lag in lags.tolist() for there in [second.at(frames + lag)]
                 for pose in _suggested(points, there, method.suggest)]
    if not suggested:
        raise BadInputError('they do not see the same people at the same time')
    best = max(suggested, key=lambda one: one.merit)
    for _ in range(2):
        fine = best.lag + _FINE if clock_offset is None else np.array([best.lag])
        refined = [(_refined(points, there, best.pose, method), lag, there)
                   for lag in fine.tolist() for there in [second.at(frames + lag)]]
        best = max([best, *(found(pose, lag, there) for pose, lag, there in refined if pose is not None)],
                   key=lambda one: one.merit)
    there = second.at(frames + best.lag)
    gaps = method.distances(best.pose, points, there)
    met = int((gaps[_pairs(gaps)] < _GATE).sum())
    # of people that both cameras see at a time, as many as the camera with fewer of them can share
    visible = [np.isfinite(each).all(axis=3).sum(axis=(0, 2)) for each in (points, there)]
    common = max(int(np.minimum(*visible).sum()), 1)
    if met < LEAST_JOINTS or met < _LEAST_SHARE * common:
        raise BadInputError(f'{met} of {common} joints of people visible to both meet their rays, expected '
                            f'{LEAST_JOINTS} and {100 * _LEAST_SHARE:.0f} % or more')
    return best.pose, best.lag, float(_GATE * common / met ** 1.5)


def _suggested(points: np.ndarray, there: np.ndarray, suggest: Solve) -> List[Transform]:
    """Return the poses that single pairs of people suggest, those with most joints in common first."""
    random = np.random.RandomState(0)
    known, known_there = np.isfinite(points).all(axis=3), np.isfinite(there).all(axis=3)
    common = (known[:, None] & known_there[None]).sum(axis=(2, 3))
    found = []
    for pair in np.argsort(-common, axis=None, kind='stable')[:_MOST_PAIRS]:
        one, other = np.unravel_index(pair, common.shape)
        if common[one, other] < _LEAST_POINTS:
            break
        both = np.flatnonzero((known[one] & known_there[other]).ravel())
        some = random.permutation(both)[:_MOST_POINTS]
        pose = suggest(points[one].reshape(-1, 3)[some], there[other].reshape(-1, 3)[some])
        if pose is not None:
            found.append(pose)
    return found


def _refined(points: np.ndarray, there: np.ndarray, pose: Transform, method: _Method) -> Optional[Transform]:
    """Return the pose by all joints of all people that meet with another one."""
    gaps = method.distances(pose, points, there)
    person, other, time = _pairs(gaps)
    near = gaps[person, other, time] < _GATE
    if near.sum() < _LEAST_POINTS:
        return None
    return method.solve(points[person, time][near], there[other, time][near])


def _pairs(gaps: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which people of the two cameras are one, at what time: indices of S1, S2 and N."""
    worth = np.nansum(np.maximum(0, 1 - (gaps / _GATE) ** 2), axis=3)
    other = worth.argmax(axis=1)
    person, time = np.nonzero(worth.max(axis=1) > 0)
    return person, other[person, time], time


def _pose_of_points(points: np.ndarray, rays: np.ndarray) -> Optional[Transform]:
    done, turn, shift, inliers = cv2.solvePnPRansac(
        points, rays[:, :2], np.eye(3), _STILL, iterationsCount=_ITERATIONS, reprojectionError=_RANSAC_ERROR,
        confidence=_CERTAINTY, flags=cv2.SOLVEPNP_EPNP)
    if not done or inliers is None or len(inliers) < _LEAST_POINTS // 2:
        return None
    chosen = inliers[:, 0]
    done, turn, shift = cv2.solvePnP(points[chosen], rays[chosen, :2], np.eye(3), _STILL, turn, shift, True,
                                     cv2.SOLVEPNP_ITERATIVE)
    return (cv2.Rodrigues(turn)[0], shift[:, 0]) if done and np.isfinite(shift).all() else None


def _pose_of_rays(rays: np.ndarray, others: np.ndarray, method: int = cv2.RANSAC) -> Optional[Transform]:
    essential, inliers = cv2.findEssentialMat(rays[:, :2], others[:, :2], 1.0, (0.0, 0.0), method, _CERTAINTY,
                                              _RANSAC_ERROR / 2)
    if essential is None or essential.shape != (3, 3):
        return None
    count, rotation, translation, _ = cv2.recoverPose(essential, rays[:, :2], others[:, :2], np.eye(3), mask=inliers)
    return (rotation, translation[:, 0]) if count >= _LEAST_POINTS // 2 else None


def _image_distances(pose: Transform, points: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Return the distances (S1, S2, N, K) of points from rays in the plane z = 1; NaN behind the camera."""
    moved = points @ pose[0].T + pose[1]
    with np.errstate(invalid='ignore', divide='ignore'):
        plane = np.where(moved[..., 2:] > 0, moved[..., :2] / moved[..., 2:], np.nan)
    return np.asarray(np.linalg.norm(plane[:, None] - there[None, ..., :2], axis=4))


def _epipolar_distances(pose: Transform, rays: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Return the distances (S1, S2, N, K) of rays from the epipolar lines of the others (Sampson)."""
    essential = np.cross(np.eye(3), pose[1]) @ pose[0]
    lines, lines_there = (rays @ essential.T)[:, None], (there @ essential)[None]
    product = (lines * there[None]).sum(axis=4)
    slopes = (lines[..., :2] ** 2).sum(axis=4) + (lines_there[..., :2] ** 2).sum(axis=4)
    return np.asarray(np.abs(product) / np.sqrt(slopes))
