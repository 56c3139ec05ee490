"""Distances of people from links of simulated robots, and the bounds below them, against the true joints.

Robots of three links each, two that stand and one that swings, are put near the people of a scene: a link is 0.5 to
2.5 m away from the true surface of a part at a time that is drawn, and never nearer than 0.3 m to a person where it
stands. A bound counts at 20 Hz, against the true distance at that very time, between two true frames; true capsules are
those of the true joints.
"""
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Dict, List, NamedTuple, Tuple

import numpy as np

from chain_runs import Frames, camera_poses, open_sequence
from ground_truth import VISIBLE, true_frames
from openpose_ros_bridges.guard import View
from openpose_ros_bridges.node_params import SeparationParams
from openpose_ros_bridges.separation import CONSTANTS, Links, SeparationEstimator
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.capsules import Capsules, capsules_of
from skeleton_extract_3d.people import MEASURED, People3D
from skeleton_extract_3d.points.transform import transform_people

from .counts import Counts, tags_of
from .figures import Quantile, of_rows, values_of
from .people import pair

# One row for each robot and time of publication: true distance less bound, and bound [m]; age of the newest people [s];
# whether the nearest person is in view, and whether the person was found in a frame before.
ROW = np.dtype([('slack', 'f8'), ('bound', 'f8'), ('age', 'f8'), ('in_view', '?'), ('known', '?')])
ROBOTS, RATE = 3, 20.0
# Of links: gap when it is drawn, and at least [m]; radius [m]; greatest speed [m/s].
GAPS, LEAST_GAP, RADIUS, SPEED = (0.5, 2.5), 0.3, 0.1, 1.0


class Delivery(NamedTuple):
    """Which frames come, and when.

    Attributes:
        late: from the stamp of a frame to its people [s].
        every: one of so many frames.
        pause: alternately frames come for so long and do not come for so long [s].
        end: share of the scene after which none comes.
        guard: people may come from where the camera does not look.
    """

    late: float = 0.1
    every: int = 1
    pause: float = 0.0
    end: float = 1.0
    guard: bool = False

    def comes(self, number: int, time: float, share: float) -> bool:
        """Return whether the people of a frame come."""
        return number % self.every == 0 and share < self.end and not (self.pause and (time // self.pause) % 2 == 1)


class _Truth:
    """True people in the world.

    Attributes:
        times: stamps of the frames (F,) [s].
        people: by frame.
        seen: by frame and id, whether a person has a visible joint.
    """

    def __init__(self, folder: Path) -> None:
        truth = true_frames(folder)
        self.times = np.array([frame.time for frame in truth])
        self.people = [transform_people(frame.people, pose[:3, :3], pose[:3, 3])
                       for frame, pose in zip(truth, camera_poses(folder))]
        self.seen = [dict(zip(frame.ids, (frame.labels == VISIBLE).any(axis=1))) for frame in truth]

    def at(self, time: float) -> Tuple[People3D, Dict[int, bool]]:
        """Return the people at a time between the first and the last frame, of ids in both frames around it."""
        after = int(np.clip(np.searchsorted(self.times, time, 'right'), 1, len(self.times) - 1))
        share = (time - self.times[after - 1]) / (self.times[after] - self.times[after - 1])
        first, last = self.people[after - 1], self.people[after]
        rows = [(row, last.ids.tolist().index(name)) for row, name in enumerate(first.ids.tolist())
                if name in last.ids]
        xyz = [(1 - share) * first.xyz[row].astype(float) + share * last.xyz[other] for row, other in rows]
        joints = np.array(xyz, np.float64).reshape(-1, len(COCO_18.joints), 3)
        shape = joints.shape[:2]
        return People3D(COCO_18, joints, np.ones(shape), np.full(shape, MEASURED), np.zeros(shape),
                        [first.ids[row] for row, _ in rows]), self.seen[after - 1]


class _Robot(NamedTuple):
    """Links between two places (L, 2, 3) [m], with periods (L,) [s] of their swings; inf: they stand."""

    places: np.ndarray
    periods: np.ndarray

    def at(self, time: float) -> Links:
        share = (0.5 - 0.5 * np.cos(2 * np.pi * time / self.periods))[:, np.newaxis]
        number = len(self.periods)
        return Links([f'link_{each}' for each in range(number)],
                     (1 - share) * self.places[:, 0] + share * self.places[:, 1], np.full(number, RADIUS),
                     np.zeros(number))


def score_separation(folder: Path, frames: Frames, delivery: Delivery) -> Counts:
    """Count how the bounds hold in a scene where the people of these frames, with the stamps of the truth, come."""
    camera, poses, truth = open_sequence(folder).camera, camera_poses(folder), _Truth(folder)
    params = SeparationParams(guard=delivery.guard)
    constants = replace(CONSTANTS, feet=False)  # of which the truth says nothing
    found = [_in_world(people, poses, truth.times, number) for number, (_, people) in enumerate(frames)]
    arrivals = [(time + delivery.late, number) for number, time in enumerate(truth.times[:len(found)].tolist())
                if delivery.comes(number, time - truth.times[0], number / len(truth.times))]
    rows = [np.zeros(0, ROW)]
    for robot in _robots(truth, folder.name):
        estimator, waiting, newest, known = SeparationEstimator(params, constants), arrivals.copy(), 0.0, set()
        for now in np.arange(arrivals[0][0], truth.times[-1] + 1e-9, 1 / RATE).tolist():
            while waiting and waiting[0][0] <= now:
                number = waiting.pop(0)[1]
                newest = float(truth.times[number])
                pose = poses[number][:3, :3], poses[number][:3, 3]
                estimator.take(found[number], newest, View.of(camera, pose))
                true_people = truth.people[number]
                every_joint = np.ones(true_people.xyz.shape[:2], bool)
                known |= {int(true_people.ids[row]) for row in pair(true_people.xyz, every_joint, found[number])}
            links, (people, seen) = robot.at(now), truth.at(now)
            capsules = capsules_of(people)
            if not len(capsules):
                continue
            bound, (true, person) = estimator.at(now, links).bound, true_distance(capsules, links)
            rows.append(np.array([(true - bound, bound, now - newest, seen[person], person in known)], ROW))
    return Counts(folder.resolve().name, tags_of(folder), {'scenes': 1.0}, {'separation': np.concatenate(rows)})


def true_distance(capsules: Capsules, links: Links) -> Tuple[float, int]:
    """Return the least distance of links from capsules [m], at least 0, and the id of the person."""
    begins, along = capsules.ends[:, 0], capsules.ends[:, 1] - capsules.ends[:, 0]
    offsets = links.centres[:, np.newaxis] - begins
    shares = np.clip((offsets * along).sum(axis=2) / np.maximum((along ** 2).sum(axis=1), 1e-12), 0.0, 1.0)
    distances = np.linalg.norm(offsets - shares[..., np.newaxis] * along, axis=2) - capsules.radii
    row = int(distances.min(axis=0).argmin())
    return max(float((distances - links.radii[:, np.newaxis]).min()), 0.0), int(capsules.persons[row])


def _in_world(people: People3D, poses: np.ndarray, times: np.ndarray, number: int) -> People3D:
    """Return people of a frame in the world, with velocities as an extractor with `tracking_frame` tells them."""
    moved = transform_people(people, poses[number][:3, :3], poses[number][:3, 3])
    before, after = max(number - 1, 0), min(number + 1, len(poses) - 1)
    first, last = (transform_people(people, poses[each][:3, :3], poses[each][:3, 3]).xyz for each in (before, after))
    velocity = moved.velocity + (last - first) / (times[after] - times[before])
    return replace(moved, velocity=velocity)


def _robots(truth: _Truth, scene: str) -> List[_Robot]:
    random = np.random.RandomState(zlib.crc32(scene.encode()))
    there = [capsules_of(people) for people in truth.people if len(people)]

    def place() -> np.ndarray:
        while True:
            capsules = there[random.randint(len(there))]
            row, share, away = random.randint(len(capsules)), random.rand(), random.normal(size=3)
            middle = (1 - share) * capsules.ends[row, 0] + share * capsules.ends[row, 1]
            gap = capsules.radii[row] + RADIUS + random.uniform(*GAPS)
            found = np.asarray(middle + gap * away / np.linalg.norm(away))
            link = Links([''], found[np.newaxis], np.array([RADIUS]), np.zeros(1))
            if min(true_distance(each, link)[0] for each in there) >= LEAST_GAP:
                return found

    robots = []
    for _ in range(ROBOTS):
        first, second, begin, end = place(), place(), place(), place()
        # the greatest speed of a swing is pi / period times its length
        period = np.pi * np.linalg.norm(end - begin) / SPEED
        robots.append(_Robot(np.array([[first, first], [second, second], [begin, end]]),
                             np.array([np.inf, np.inf, period])))
    return robots


_SLACK = values_of('separation', 'slack', lambda rows: rows['in_view'])
STATISTICS = {
    'broken': of_rows('bounds above the true distance', 'separation', lambda rows: rows['slack'] < 0, digits=4),
    'broken_known': of_rows('the same, of bounds above 0 where the nearest person was found before', 'separation',
                            lambda rows: rows['slack'] < 0, lambda rows: rows['known'] & (rows['bound'] > 0), digits=4),
    'slack': Quantile('median slack, person in view', _SLACK, 0.5, 'm', 3),
    'slack_95': Quantile('95 % of the slack, person in view', _SLACK, 0.95, 'm', 2),
    'zero': of_rows('bounds of 0', 'separation', lambda rows: rows['bound'] == 0),
    # of each scene one value
    'until_zero': Quantile('greatest age of data with a bound above 0', lambda counts: counts.rows['separation']['age'][
        counts.rows['separation']['bound'] > 0].max(initial=0.0, keepdims=True), 1.0, 's', 2)}
