"""Joints that several cameras see at single times, by the poses of the cameras: what is adjusted together."""
import itertools
from dataclasses import dataclass
from typing import List, NamedTuple, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.constants import FUSION
from openpose_ros_fusion.rays import ray_gaps
from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.calibration.edges import CameraPose
from openpose_ros_tools.calibration.recording import CameraPaths

# Rays that meet at a smaller angle tell no position: least eigenvalue of the sum of their projections.
_LEAST_EIGENVALUE = 0.01
# Two cameras see people at the same time if their frames are less apart [s].
_SAME_TIME = 0.1
# Joints at single times, at most.
_MOST_JOINTS = 5000
# People of two cameras are one if their rays are nearer (median), as a share of the distance; in space [m].
_RAY_GATE, _SPACE_GATE = 0.06, FUSION.association.gate
_LEAST_JOINTS = FUSION.association.least_joints
# Joints are not nearer to a camera, where errors across rays become angles [m].
_NEAREST = 0.3
# Distance that a person, or a joint, has to move before a camera sees another side, so that keypoints err differently
# [m].
_RENEWED, _JOINT_RENEWED = 0.5, 0.25


@dataclass(frozen=True, eq=False)
class Gathered:
    """P joints of people at single times, and M measurements of them.

    Attributes:
        joints: (P, 3) [m] in the frame of the root.
        person, name: (P,) int, person (of one time) and joint in the joint set.
        times: (P,) [s] by the clock of the root.
        camera, point: (M,) int, of each measurement.
        block: (M,) int; measurements of one block are of a track in a camera while the person stays in one place.
        alike: (M,) int, how many measurements are of the same joint, track and camera while the joint stays there.
        measured, velocity: (M, 3) points of the camera (see `CameraRecording.positions`) and what they move by [1/s].
        sigma: (M,) error per axis of `measured`.
    """

    joints: np.ndarray
    person: np.ndarray
    name: np.ndarray
    times: np.ndarray
    camera: np.ndarray
    point: np.ndarray
    block: np.ndarray
    alike: np.ndarray
    measured: np.ndarray
    velocity: np.ndarray
    sigma: np.ndarray

    def people(self, joints: np.ndarray) -> np.ndarray:
        """Return joints (P, 3) [m] as people, each at one time, (N, 18, 3); NaN where not known."""
        people = np.full((int(self.person.max()) + 1, len(COCO_18.joints), 3), np.nan)
        people[self.person, self.name] = joints
        return people


class _View(NamedTuple):
    """A person in a camera at a time, in the frame of the root.

    points: (K, 3) positions [m], or unit vectors from the origin; known: (K,) bool.
    """

    camera: int
    slot: int
    origin: np.ndarray
    points: np.ndarray
    known: np.ndarray
    has_depth: bool


_Person = Tuple[_View, ...]


def gather(cameras: Sequence[CameraPaths], poses: Sequence[CameraPose], wide: float = 1.0) -> Gathered:
    """Return the joints that two cameras or more see at the same time.

    Args:
        wide: factor of the gates.

    Raises:
        BadInputError: there are none.
    """
    times = _common_times(cameras, poses)
    own = [times - one.clock_offset for one in poses]
    points = [paths.at(at) for paths, at in zip(cameras, own)]
    order = sorted(range(len(cameras)), key=lambda camera: not cameras[camera].has_depth)
    joints: List[Tuple[float, ...]] = []
    rows: List[Tuple[int, int, int, int]] = []
    count = 0
    for number in range(len(times)):
        people: List[_Person] = []
        for camera in order:
            views = _views(camera, points[camera][:, number], cameras[camera].has_depth, poses[camera])
            people = _joined(people, views, wide)
        for person, seen in enumerate(people, count):
            if len(seen) > 1:
                middle = _middle(seen)
                shared = np.isfinite(middle).all(axis=1) & (np.sum([one.known for one in seen], axis=0) > 1)
                for name in np.flatnonzero(shared):
                    rows += [(one.camera, len(joints), one.slot, number) for one in seen if one.known[name]]
                    joints.append((*middle[name], times[number], person, name))
        count += len(people)
    if not joints:
        raise BadInputError('no two cameras see a joint of the same person at the same time')
    camera, point, slot, number = np.array(rows).T
    table = np.array(joints)
    owner, name = table[:, 4:].astype(int).T
    measured, velocity, sigma = (
        np.array([each[c][s, n, j] for c, s, n, j in zip(camera, slot, number, name[point])]) for each in
        (points, *([read(paths, at) for paths, at in zip(cameras, own)]
                   for read in (CameraPaths.motion, CameraPaths.sigma))))
    away = np.linalg.norm(table[point, :3] - np.array([one.pose[1] for one in poses])[camera], axis=1)
    sigma = sigma / np.where([cameras[one].has_depth for one in camera], 1, np.maximum(away, _NEAREST))
    sums = np.stack([np.bincount(owner, axis) for axis in table[:, :3].T], axis=1)
    places = (sums / np.maximum(np.bincount(owner), 1)[:, None])[owner[point]]
    block = _blocks(np.stack([camera, slot, number], axis=1), places, _RENEWED)
    of_joint = _blocks(np.stack([camera, slot, name[point], number], axis=1), table[point, :3], _JOINT_RENEWED)
    return Gathered(table[:, :3], owner, name, table[:, 3], camera, point, block, np.bincount(of_joint)[of_joint],
                    measured, velocity, sigma)


def _blocks(views: np.ndarray, places: np.ndarray, renewed: float) -> np.ndarray:
    """Return the blocks (M,) of views (M, 3 or more), the last one time: one ends where the place (M, 3) is off [m]."""
    block, count, before, begin = np.zeros(len(views), int), -1, None, places[0]
    for row in np.lexsort(views.T[::-1]).tolist():
        track = tuple(views[row, :-1])
        if track != before or np.linalg.norm(places[row] - begin) > renewed:
            count, before, begin = count + 1, track, places[row]
        block[row] = count
    return block


def _common_times(cameras: Sequence[CameraPaths], poses: Sequence[CameraPose]) -> np.ndarray:
    """Return times of the root at which two cameras see people, evenly (N,) [s]."""
    chosen: List[np.ndarray] = []
    for first, second in itertools.combinations(range(len(cameras)), 2):
        times, other = (cameras[camera].times + poses[camera].clock_offset for camera in (first, second))
        after = np.clip(np.searchsorted(other, times), 1, len(other) - 1)
        chosen.append(times[np.minimum(np.abs(other[after] - times), np.abs(times - other[after - 1])) < _SAME_TIME])
    times = np.unique(np.round(np.concatenate(chosen), 4))
    people = max(len(paths.positions) * paths.positions.shape[2] for paths in cameras)
    most = min(max(_MOST_JOINTS // people, 1), len(times))
    return times[np.linspace(0, len(times) - 1, most).astype(int)]


def _views(camera: int, points: np.ndarray, has_depth: bool, pose: CameraPose) -> List[_View]:
    """Return the people of a camera at a time, from its points (S, K, 3), without those with a few joints."""
    rotation, origin = pose.pose
    turned = points @ rotation.T
    with np.errstate(invalid='ignore'):
        placed = turned + origin if has_depth else turned / np.linalg.norm(turned, axis=2, keepdims=True)
    known = np.isfinite(placed).all(axis=2)
    return [_View(camera, slot, origin, placed[slot], known[slot], has_depth)
            for slot in np.flatnonzero(known.sum(axis=1) >= _LEAST_JOINTS).tolist()]


def _joined(people: List[_Person], views: List[_View], wide: float) -> List[_Person]:
    """Return the people with the views of one more camera, those that belong to no person as new ones."""
    middles = [_middle(person) for person in people]
    costs = np.array([[_distance(view, person, middle) for person, middle in zip(people, middles)]
                      for view in views]).reshape(len(views), len(people))
    found = {column: row for row, column in match(costs, np.isfinite(costs)) if costs[row, column] < wide}
    return ([(*person, views[found[column]]) if column in found else person for column, person in enumerate(people)]
            + [(view,) for row, view in enumerate(views) if row not in found.values()])


def _distance(view: _View, person: _Person, middle: np.ndarray) -> float:
    """Return the median distance of a view from a person, as a share of the gate; infinite where they share little."""
    if np.isfinite(middle).any():
        offsets = middle - view.origin
        if view.has_depth:
            distances = np.linalg.norm(middle - view.points, axis=1) / _SPACE_GATE
        else:
            depth = np.linalg.norm(offsets, axis=1, keepdims=True)
            distances = np.linalg.norm(offsets / depth - view.points, axis=1) / _RAY_GATE
    else:
        first = person[0]
        gaps, in_front = ray_gaps(first.origin, first.points, view.origin, view.points)
        reach = np.linalg.norm(first.origin - view.origin)
        distances = np.where(in_front, gaps / max(float(reach), 1e-6) / _RAY_GATE, np.nan)
    known = np.isfinite(distances)
    return float(np.median(distances[known])) if known.sum() >= _LEAST_JOINTS else np.inf


def _middle(person: _Person) -> np.ndarray:
    """Return where the joints of a person are, (K, 3): nearest to all positions and rays; NaN where not known."""
    total, right = np.zeros((len(person[0].points), 3, 3)), np.zeros((len(person[0].points), 3))
    for view in person:
        known = view.known[:, None, None]
        squares = np.where(known, view.points[:, :, None] * view.points[:, None, :], 0)
        share = np.where(known, np.eye(3) if view.has_depth else np.eye(3) - squares, 0)
        at = np.where(known[..., 0], view.points, 0) if view.has_depth else view.origin
        total = total + share
        right = right + (share * at[..., None, :]).sum(axis=2)
    solvable = np.linalg.eigvalsh(total)[:, 0] > _LEAST_EIGENVALUE
    safe = np.where(solvable[:, None, None], total, np.eye(3))
    return np.where(solvable[:, None], np.linalg.solve(safe, right[..., None])[..., 0], np.nan)
