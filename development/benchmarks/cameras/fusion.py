#!/usr/bin/python3
"""Measure the fusion of several cameras, without ROS: time per update, and accuracy on a sequence with known joints.

Time: simulated people before simulated cameras, median and 99th percentile, and median of the processor's time.

Accuracy (--stage): a folder with one sequence per camera (cam0, cam1, ...; see chain_runs.py) of the same instants,
with T_world_camera in each meta.json. The chain runs on each camera, mode balanced, then the fusion, once for each case
of the table. Coverage: share of visible joints whose error in space is within 1 and 2 sigma; 0.61 and 0.993 of a normal
distribution are.

Sigma (--sigma): the same shares for simulated people who walk, seen by 1 to 3 cameras of 5 to 60 Hz whose errors are as
large as they say: independent from frame to frame, or fading within half a second (1 / e).

    ./run bench cameras fusion --cameras 4 --people 2
    ./run bench cameras fusion --sigma
    ./run bench cameras fusion --stage STAGE
"""
import itertools
import sys
from pathlib import Path
from time import thread_time
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from chain_runs import Finder, Frames, camera_poses, open_sequence
from common import Parser, elapsed, markdown
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import Sighting, from_image, from_space
from openpose_ros_pkg.command_line import run_command
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from scoring.figures import figures
from scoring.world import STATISTICS, score_world
from simulated_errors import cameras as erring_cameras
from simulated_errors import fusion_shares, striding
from simulated_rig import around, walking
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import Transform

# Rate of the simulated cameras [Hz], timed updates, and those before them.
RATE, UPDATES, WARM_UP = 30.0, 300, 30
# Sigma: rates of the cameras [Hz], length [s], error of the joints per axis [m], time in which errors fade [s].
RATES, SECONDS, NOISE, CORRELATION = (5.0, 10.0, 15.0, 30.0, 60.0), 6.0, 0.06, 0.5


class Recorded(NamedTuple):
    """Name, model and pose of a camera in the world, and stamp [s] and people of its frames."""

    name: str
    model: CameraModel
    pose: Transform
    frames: List[Tuple[float, People3D, People2D]]


class Case(NamedTuple):
    """How the recorded cameras are given to the fusion.

    Attributes:
        sent: (cameras, frames) whether a camera sends a frame.
        rgb: numbers of the cameras whose depth is withheld.
        moved: number of the camera that is believed to stand 100 mm aside.
        late: (cameras, frames) error of the stamps [s].
    """

    title: str
    sent: np.ndarray
    rgb: Tuple[int, ...] = ()
    moved: Optional[int] = None
    late: Optional[np.ndarray] = None


def record(stage: Path) -> List[Recorded]:
    """Run the chain on each camera of a folder."""
    settings, recorded = build(ChainSettings, {'mode': 'balanced'}), []
    for folder in sorted(stage.glob('cam*')):
        sequence = open_sequence(folder)
        run, pose = Finder(settings, rate=sequence.fps).run(sequence), camera_poses(folder, sequence)[0]
        frames = [(stamp, people, image) for (stamp, people), image in zip(run.frames, run.people)]
        recorded.append(Recorded(folder.name, sequence.camera, (pose[:3, :3], pose[:3, 3]), frames))
    return recorded


def cases(number: int, frames: int) -> List[Case]:
    """Return the cases for a number of cameras and frames."""
    everyone, jitter = tuple(range(number)), np.random.RandomState(0).uniform(-0.02, 0.02, (number, frames))
    every, camera, frame = np.ones((number, frames), bool), np.arange(number)[:, np.newaxis], np.arange(frames)
    return [
        Case('all cameras', every),
        *(Case(f'camera {one} alone', every & (camera == one)) for one in everyone),
        *(Case(f'without camera {one}', every & (camera != one)) for one in everyone),
        *(Case(f'camera {one} dead from the middle on', (camera != one) | (frame < frames // 2)) for one in everyone),
        *(Case(f'camera {one} moved by 100 mm', every, moved=one) for one in everyone),
        *(Case(f'camera {one} at half the rate', (camera != one) | (frame % 2 == 0)) for one in everyone),
        Case('stamps wrong by up to 20 ms', every, late=jitter),
        Case('camera 0 with depth, the others without', every, everyone[1:]),
        Case('no depth', every, everyone),
        *(Case(f'no depth, cameras {first} and {second}', every & ((camera == first) | (camera == second)), everyone)
          for first, second in itertools.combinations(everyone, 2))]


def fuse(recorded: Sequence[Recorded], case: Case) -> Tuple[Frames, List[float]]:
    """Return the fused people of each frame, and what the updates took [ms]."""
    fusion, fused, times = PeopleFusion(), [], []
    for frame in range(min(len(camera.frames) for camera in recorded)):
        stamp = recorded[0].frames[frame][0]
        sightings = [_sighting(camera, frame, case, number) for number, camera in enumerate(recorded)
                     if case.sent[number, frame]]
        took, people = elapsed(lambda seen=sightings, at=stamp: fusion.update(seen, at))
        fused.append((stamp, people))
        times.append(took)
    return fused, times


def _sighting(camera: Recorded, frame: int, case: Case, number: int) -> Sighting:
    stamp, people, image = camera.frames[frame]
    if case.late is not None:
        stamp += case.late[number, frame]
    pose = (camera.pose[0], camera.pose[1] + np.array([0.1 if case.moved == number else 0.0, 0.0, 0.0]))
    if number in case.rgb:
        return from_image(camera.name, stamp, image, camera.model, pose)
    return from_space(camera.name, stamp, people, pose)


def accuracy(stage: Path, recorded: Sequence[Recorded]) -> List[Sequence[object]]:
    """Return the table of all cases."""
    rows: List[Sequence[object]] = [('case', 'median mm', 'mean mm', 'within 100 mm', 'of one camera', 'recall',
                                     'precision', 'switches', 'within 1, 2 sigma', 'ms')]
    for case in cases(len(recorded), len(recorded[0].frames)):
        fused, times = fuse(recorded, case)
        counts = score_world(stage, fused)
        found = figures([counts], STATISTICS)
        alone = figures([counts.where('joints', lambda joints: joints['cameras'] == 1)], STATISTICS)
        rows.append((case.title, found['visible_median'], found['visible_mean'], found['visible_100'],
                     alone['visible_100'], found['persons_recall'], found['persons_precision'], found['switches'],
                     f"{found['within_1_sigma']}, {found['within_2_sigma']}", f'{np.median(times):.2f}'))
    return rows


def sigma() -> str:
    """Return the table of the shares of joints within 1 and 2 sigma, by cameras and rate."""
    rows: List[Sequence[object]] = [('cameras', 'errors last', *(f'{rate:g} Hz' for rate in RATES))]
    room = striding(SECONDS + 1, 5)
    for count, lasting in itertools.product((1, 2, 3), (0.0, CORRELATION)):
        shares = [fusion_shares(room, erring_cameras(count, NOISE, lasting), rate, SECONDS) for rate in RATES]
        rows.append((count, f'{lasting:g} s' if lasting else 'a frame',
                     *(f'{found.within_1:.2f}, {found.within_2:.2f}' for found in shares)))
    return markdown(rows)


def speed(cameras: int, people: int) -> str:
    """Return what an update takes, as text."""
    rig, room = around(cameras), walking((UPDATES + WARM_UP) / RATE + 1, people)
    fusion, times, computing = PeopleFusion(), [], []
    for number in range(UPDATES + WARM_UP):
        stamp = (number + 1) / RATE
        sightings = [camera.see(room, stamp) for camera in rig]
        began = thread_time()
        times.append(elapsed(lambda seen=sightings, at=stamp: fusion.update(seen, at))[0])
        computing.append(1e3 * (thread_time() - began))
    median, most = np.percentile(times[WARM_UP:], (50, 99))
    return (f'{cameras} cameras, {people} people: {median:.2f} ms per update, 99 % within {most:.2f} ms; '
            f'processor {np.median(computing[WARM_UP:]):.2f} ms\n')


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('--cameras', type=int, default=3, help='number of simulated cameras (default: 3)')
    parser.add_argument('--people', type=int, default=5, help='number of simulated people (default: 5)')
    parser.add_argument('--stage', type=Path, help='folder with the sequences of cameras and gt_world.json')
    parser.add_argument('--sigma', action='store_true', help='check sigma on simulated people, at all rates')
    arguments = parser.parse_args()
    sys.stdout.write(sigma() if arguments.sigma else speed(arguments.cameras, arguments.people))
    if arguments.stage:
        sys.stdout.write(markdown(accuracy(arguments.stage, record(arguments.stage))))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))
