"""Joints that several cameras see at single times, by where the cameras stand: what is adjusted together."""
import itertools
from dataclasses import dataclass
from typing import List, NamedTuple, Sequence, Tuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from openpose_ros_fusion.association import ray_gaps
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.calibration.constants import CALIBRATION
from openpose_ros_tools.calibration.edges import Standing
from openpose_ros_tools.calibration.recording import CameraPaths

_GATHER = CALIBRATION.gather
# Rays that meet at a smaller angle tell no position: least eigenvalue of the sum of their projections.
_LEAST_EIGENVALUE = 0.01
_FAR = 1e6


@dataclass(frozen=True, eq=False)
class Gathered:
    """P joints of people at single times, and M measurements of them.

    Attributes:
        joints: (P, 3) [m] in the frame of the root.
        person, name: (P,) int, person (of one time) and joint in the joint set.
        camera, point: (M,) int, of each measurement.
        measured, velocity: (M, 3) points of the camera (see `CameraRecording.points`) and what they move by [1/s].
        sigma: (M,) error per axis, as in `CameraPaths.sigma`.
    """

    joints: np.ndarray
    person: np.ndarray
    name: np.ndarray
    camera: np.ndarray
    point: np.ndarray
    measured: np.ndarray
    velocity: np.ndarray
    sigma: np.ndarray

    def people(self, joints: np.ndarray) -> np.ndarray:
        """Return joints (P, 3) [m] as people, each at one time, (N, 18, 3); NaN where not known."""
        people = np.full((int(self.person.max()) + 1, len(COCO_18.joints), 3), np.nan)
        people[self.person, self.name] = joints
        return people


class _Seen(NamedTuple):
    """A person in a camera at a time, in the frame of the root.

    points: (K, 3) positions [m], or unit vectors from the origin.
    """

    camera: int
    slot: int
    origin: np.ndarray
    points: np.ndarray
    has_depth: bool


def gather(cameras: Sequence[CameraPaths], standing: Sequence[Standing]) -> Gathered:
    """Return the joints that two cameras or more see at the same time.

    Raises:
        BadInputError: there are none.
    """
    times = _common_times(cameras, standing)
    own = [times - one.clock_offset for one in standing]
    points = [paths.at(at) for paths, at in zip(cameras, own)]
    order = sorted(range(len(cameras)), key=lambda camera: not cameras[camera].has_depth)
    joints: List[Tuple[float, ...]] = []
    rows: List[Tuple[int, int, int, int]] = []
    person = 0
    for number in range(len(times)):
        people: List[List[_Seen]] = []
        for camera in order:
            _join(people, _seen(camera, points[camera][:, number], cameras[camera].has_depth, standing[camera]))
        for each in people:
            middle = _middle(each) if len(each) > 1 else np.full((points[0].shape[2], 3), np.nan)
            shared = np.isfinite(middle).all(axis=1) & (np.sum([_known(seen) for seen in each], axis=0) > 1)
            for name in np.flatnonzero(shared):
                rows += [(seen.camera, len(joints), seen.slot, number) for seen in each if _known(seen)[name]]
                joints.append((*middle[name], person, name))
            person += 1
    if not joints:
        raise BadInputError('no two cameras see a joint of the same person at the same time')
    camera, point, slot, number = np.array(rows).T
    table = np.array(joints)
    name = table[:, 4].astype(int)
    velocity = [paths.velocity(at) for paths, at in zip(cameras, own)]
    sigma = [paths.sigma(at) for paths, at in zip(cameras, own)]
    places = list(zip(camera, slot, number, name[point]))
    return Gathered(table[:, :3], table[:, 3].astype(int), name, camera, point,
                    *(np.array([values[c][s, n, j] for c, s, n, j in places]) for values in (points, velocity, sigma)))


def _common_times(cameras: Sequence[CameraPaths], standing: Sequence[Standing]) -> np.ndarray:
    """Return times of the root at which two cameras see somebody, for each pair as many (N,) [s]."""
    chosen: List[np.ndarray] = []
    for first, second in itertools.combinations(range(len(cameras)), 2):
        times = cameras[first].times + standing[first].clock_offset
        other = cameras[second].times + standing[second].clock_offset
        after = np.clip(np.searchsorted(other, times), 1, len(other) - 1)
        both = times[np.minimum(np.abs(other[after] - times), np.abs(times - other[after - 1])) < 0.1]
        chosen.append(both[np.unique(np.linspace(0, len(both) - 1, _GATHER.times).astype(int))] if len(both) else both)
    times = np.unique(np.round(np.concatenate(chosen), 4))
    people = max(len(paths.positions) * paths.positions.shape[2] for paths in cameras)
    most = max(_GATHER.points // people, 1)
    return times if len(times) <= most else times[np.linspace(0, len(times) - 1, most).astype(int)]


def _seen(camera: int, points: np.ndarray, has_depth: bool, standing: Standing) -> List[_Seen]:
    """Return the people of a camera at a time, from its points (S, K, 3)."""
    rotation, origin = standing.pose
    turned = points @ rotation.T
    with np.errstate(invalid='ignore'):
        placed = turned + origin if has_depth else turned / np.linalg.norm(turned, axis=2, keepdims=True)
    return [_Seen(camera, slot, origin, placed[slot], has_depth)
            for slot in np.flatnonzero(np.isfinite(placed).all(axis=2).sum(axis=1) >= _GATHER.least_joints)]


def _join(people: List[List[_Seen]], new: List[_Seen]) -> None:
    """Add who is in a camera to those whom the others see."""
    if people and new:
        middles = [_middle(each) for each in people]
        costs = np.array([[_distance(seen, each, middle) for each, middle in zip(people, middles)] for seen in new])
        pairs = [(one, other) for one, other in zip(*linear_sum_assignment(costs)) if costs[one, other] < 1]
    else:
        pairs = []
    for one, other in pairs:
        people[other].append(new[one])
    joined = {one for one, _ in pairs}
    people += [[seen] for number, seen in enumerate(new) if number not in joined]


def _distance(seen: _Seen, person: List[_Seen], middle: np.ndarray) -> float:
    """Return the median distance of somebody in a camera from a person, as a share of the gate."""
    if np.isfinite(middle).any():
        offsets = middle - seen.origin
        depth = np.linalg.norm(offsets, axis=1)
        if seen.has_depth:
            distances = np.linalg.norm(middle - seen.points, axis=1) / _GATHER.gate
        else:
            distances = np.linalg.norm(offsets / depth[:, None] - seen.points, axis=1) / _GATHER.ray_gate
    else:
        first = person[0]
        gaps, in_front = ray_gaps(first.origin, first.points, seen.origin, seen.points)
        reach = np.linalg.norm(first.origin - seen.origin)
        distances = np.where(in_front, gaps / max(float(reach), 1e-6) / _GATHER.ray_gate, np.nan)
    known = np.isfinite(distances)
    return float(np.median(distances[known])) if known.sum() >= _GATHER.least_joints else _FAR


def _middle(person: List[_Seen]) -> np.ndarray:
    """Return where the joints of a person are, (K, 3): nearest to all positions and rays; NaN where not known."""
    total, right = np.zeros((len(person[0].points), 3, 3)), np.zeros((len(person[0].points), 3))
    for seen in person:
        known = _known(seen)[:, None, None]
        squares = np.where(known, seen.points[:, :, None] * seen.points[:, None, :], 0)
        share = np.where(known, np.eye(3) if seen.has_depth else np.eye(3) - squares, 0)
        at = np.where(known[..., 0], seen.points, 0) if seen.has_depth else seen.origin
        total += share
        right += (share * at[..., None, :]).sum(axis=2)
    solvable = np.linalg.eigvalsh(total)[:, 0] > _LEAST_EIGENVALUE
    safe = np.where(solvable[:, None, None], total, np.eye(3))
    return np.where(solvable[:, None], np.linalg.solve(safe, right[..., None])[..., 0], np.nan)


def _known(seen: _Seen) -> np.ndarray:
    return np.asarray(np.isfinite(seen.points).all(axis=1))
