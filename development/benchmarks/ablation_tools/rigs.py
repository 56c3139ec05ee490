"""For the ablation of the fusion: simulated cameras round walking people, recorded ones, counts of what is right."""
from dataclasses import replace
from functools import partial
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from ablation_tools.changes import Counts, Sums, counted
from openpose_ros_fusion.cameras import CameraJudge
from openpose_ros_fusion.collector import Collector
from openpose_ros_fusion.constants import FusionConstants
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import Sighting, from_space
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.alignment.people import pair_people
from simulated_errors import ErringCamera, striding
from simulated_rig import looking_at_the_middle, walking
from skeleton_extract_3d.people import INFERRED, MEASURED, People3D

Random = np.random.RandomState
Arrivals = List[Tuple[float, str, float]]
# Of matched people, by the median of the joints; of joints [m].
SAME_PERSON, NEAR_JOINT, PATIENCE = 0.4, 0.1, 0.5


Case = Tuple[Callable[[FusionConstants], Sequence[Tuple[float, List[Sighting]]]], Sequence[Optional[np.ndarray]],
             Optional[Sequence[np.ndarray]], str]
"""Stamps and sightings by the constants; true joints (P, 18, 3) [m] of each frame, NaN where they do not count, None:
the frame does not; which of them cameras see, all if None; a prefix of the figures."""


def count_fused(sums: Sums, case: Case, constants: FusionConstants) -> None:
    """Compare fused people with true joints, row by row the same person."""
    make, truth, seen, prefix = case
    fusion, ids, switches = PeopleFusion(constants=constants), {}, 0
    for number, ((stamp, sightings), joints) in enumerate(zip(make(constants), truth)):
        people = fusion.update(sightings, stamp)
        if joints is None:
            continue
        pairs = pair_people(people.xyz, joints, SAME_PERSON)
        sums.add(f'{prefix}missed', len(joints) - len(pairs), len(joints))
        sums.add(f'{prefix}extra', len(people) - len(pairs), len(joints))
        for row, other in pairs:
            name = int(people.ids[row])
            switches += other in ids and ids[other] != name
            ids[other] = name
            counts = np.isfinite(joints[other, :, 0]) & (True if seen is None else seen[number][other])
            error = np.linalg.norm(people.xyz[row] - joints[other], axis=1)
            found = counts & np.isfinite(error)
            sums.add(f'{prefix}joints', (error[found] < NEAR_JOINT).sum(), counts.sum())
            sums.add(f'{prefix}error mm', 1e3 * error[found].sum(), found.sum())
            for sigmas in (1, 2):
                right = error[found] <= sigmas * people.sigma[row][found]
                sums.add(f'{prefix}in {sigmas} sigma', right.sum(), found.sum())
    sums.add(f'{prefix}switches', switches, 1)


def _story(seed: int, rgb: int, prefix: str) -> Case:
    """Return frames of 2 to 4 cameras, of which some have no depth, and the true joints.

    Errors of a camera last a while; it is late, stands a little elsewhere, misses frames, loses each person once and
    gives it a new id then, infers joints far off, and sees a false person at times.
    """
    random, people, count = Random(seed), 1 + seed % 4, 2 + seed % 3
    room, rate = striding(4.5, people), (10.0, 15.0, 30.0)[seed % 3]
    angles = 2 * np.pi * (np.arange(count) + random.uniform(-0.2, 0.2, count)) / max(count, 3)
    cameras = [ErringCamera(f'camera{number}', looking_at_the_middle(angle), random.choice([0.02, 0.04]), 0.3,
                            0.008 if number < rgb else None, Random(seed * 10 + number))
               for number, angle in enumerate(angles)]
    late, beside = random.uniform(0, 0.04, count), random.normal(0, 0.012, (count, 3))
    leaves = random.uniform(0.5, 3.5, (count, people))
    comes = leaves + random.uniform(0.1, 0.8, leaves.shape)
    frames, truth = [], []
    for stamp in 0.1 + np.arange(int(4.0 * rate)) / rate:
        seen = []
        for number, camera in enumerate(cameras):
            if random.rand() < 0.05:
                continue
            sighting = camera.see(room.at(stamp - late[number]), stamp - late[number])
            sighting = replace(sighting, ids=sighting.ids + 100 * (stamp > comes[number]),
                               positions=sighting.positions + beside[number])
            seen.append(_with_faults(sighting.select(np.flatnonzero(
                (stamp <= leaves[number]) | (stamp >= comes[number]))), random))
        frames.append((stamp, seen))
        truth.append(room.at(stamp) if len(frames) > 5 else None)
    return lambda constants: frames, truth, None, prefix


def _with_faults(sighting: Sighting, random: Random) -> Sighting:
    """Return a sighting with joints that are inferred far off, and at times a false person; rays as they are."""
    if not sighting.has_depth:
        return sighting
    hidden = random.rand(*sighting.status.shape) < 0.06
    positions = sighting.positions + np.where(hidden[..., np.newaxis], random.normal(0, 0.1, (*hidden.shape, 3)), 0.0)
    sighting = replace(sighting, positions=positions, status=np.where(hidden, INFERRED, sighting.status),
                       sigma=np.where(hidden, 0.1, sighting.sigma))
    if random.rand() >= 0.03:
        return sighting
    both = sighting.select(np.append(np.arange(len(sighting)), 0))
    away = np.zeros((len(both), 1, 1))
    away[-1] = random.uniform(0.5, 2.0)
    return replace(both, ids=np.append(sighting.ids, 999), positions=both.positions + away * np.array([1.0, 0.3, 0.0]))


def _arrivals(seed: int) -> Tuple[Arrivals, float]:
    """Return when messages of three cameras arrive, and the time between common stamps."""
    random = Random(seed)
    rate = random.choice([5.0, 10.0, 15.0, 30.0])
    shared = seed % 2 == 0
    arrivals: Arrivals = []
    for place, camera in enumerate('abc'):
        own = rate / (2 if seed % 5 == 4 and camera == 'c' else 1)
        latency = random.uniform(0.01, 0.1) if not shared else 0.05 + place * 0.3 / rate
        for number in range(int(6 * own)):
            if random.rand() < 0.04 or (seed % 7 == 3 and camera == 'b' and 2 < number / own < 4.5):
                continue
            stamp = number / own + random.uniform(0, 0.003)
            arrivals.append((number / own + latency + random.exponential(0.004), camera, stamp))
    return sorted(arrivals), 1 / rate


def count_collected(sums: Sums, stream: Tuple[Arrivals, float], constants: FusionConstants) -> None:
    """Count messages of one time that make one update, and sum how long updates wait after their last message."""
    arrivals, period = stream
    empty = from_space('', 0.0, People3D.empty(COCO_18), (np.eye(3), np.zeros(3)))
    collector, updates = Collector('abc', PATIENCE, constants.collector), []
    for arrival, camera, stamp in arrivals:
        while collector.deadline is not None and collector.deadline < arrival:
            at = collector.deadline
            updates += [(at, update) for update in collector.due(at)]
        updates += [(arrival, update) for update in collector.add(replace(empty, camera=camera, stamp=stamp), arrival)]
    came = {(camera, stamp): arrival for arrival, camera, stamp in arrivals}
    for at, update in updates:
        if update.stamp < 1.0:
            continue
        together = {camera for _, camera, stamp in arrivals if abs(stamp - update.stamp) < 0.3 * period}
        sums.add('whole updates', len({one.camera for one in update.sightings} & together), len(together))
        sums.add('waits s', at - max(came[one.camera, one.stamp] for one in update.sightings), 1)
    sums.add('dropped', sum(collector.dropped.values()) + sum(collector.out_of_time.values()), len(arrivals))


def _judged_rig(seed: int) -> Any:
    random, room = Random(seed), walking(5.0, 2 + seed % 2, seed)
    count = 2 + seed % 2
    cameras = [ErringCamera(f'camera{number}', looking_at_the_middle(2 * np.pi * number / 3), 0.03, 0.3)
               for number in range(count)]
    moved = random.normal(0, 1, 3)
    moved *= (0.0, 0.09, 0.15)[seed % 3] / np.linalg.norm(moved)
    late = random.choice([0.0, 0.05, -0.03])
    return room, cameras, moved, late, random.uniform(10, 30)


def count_judged(sums: Sums, rig: Any, constants: FusionConstants) -> None:
    """Count whether the wrong camera of a rig, and no other, is told, and sum the error of its clock [s]."""
    room, cameras, moved, late, rate = rig
    judge = CameraJudge([camera.name for camera in cameras], constants.cameras)
    cameras = [replace(camera, random=Random(7 + number)) for number, camera in enumerate(cameras)]
    for number in range(int(4 * rate)):
        time = 0.2 + number / rate
        joints = room.at(time)
        shape = joints.shape[:2]
        fused = People3D(COCO_18, joints, np.ones(shape), np.full(shape, MEASURED, np.uint8), np.full(shape, 0.02),
                         np.arange(len(joints)) + 1, (room.at(time + 0.02) - room.at(time - 0.02)) / 0.04)
        known = {(camera.name, person + 1): person + 1 for camera in cameras for person in range(len(joints))}
        seen = [camera.see(joints, time) for camera in cameras]
        seen[-1] = replace(seen[-1], stamp=time + late, positions=seen[-1].positions + moved)
        judge.update(seen, fused, time, known)
    found, wrong = judge.judgements(), np.linalg.norm(moved) > 0
    told = [found[camera.name].disagrees for camera in cameras]
    expected = [wrong and (number == len(cameras) - 1 or len(cameras) == 2) for number in range(len(cameras))]
    sums.add('judged', told == expected, 1)
    offset = found[cameras[-1].name].clock_offset
    sums.add('clock known', np.isfinite(offset), 1)
    if np.isfinite(offset) and len(cameras) > 2:
        sums.add('clock error s', abs(offset + late), 1)


def suites(count: int) -> Dict[str, Callable[[FusionConstants], Counts]]:
    """Return what counts for constants, by name; with a number of stories of each kind."""
    return {**{name: partial(counted, count_fused, [_story(seed, rgb, prefix) for seed in range(count)])
               for name, rgb, prefix in (('depth', 0, ''), ('rgb', 9, 'rays '), ('mixed', 1, 'mixed '))},
            'collector': partial(counted, count_collected, [_arrivals(seed) for seed in range(2 * count)]),
            'judge': partial(counted, count_judged, [_judged_rig(seed) for seed in range(count)])}
