#!/usr/bin/python3
"""Measure the time that people in space take, against their number, without ROS.

Synthetic people walk side by side before a camera of 960 x 540. Their exact pixels and the cloud, laid out in memory as
drivers send it, go through `PeopleEstimator.update`, on one core; frames of all numbers of people take turns, so that a
busy moment hits all alike. For each number: median and 95th percentile of a frame, the medians of its stages, and the
cost of one person more as the slope of the straight line through the medians.

    benchmarks/speed_3d.py
    benchmarks/speed_3d.py --people 1 5 --rounds 400 --set lifting=mean3x3
"""
import argparse
import os
import sys
import time
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Tuple

import cv2
import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'openpose_ros_pkg' / 'src'))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'skeleton_extract_3d' / 'src'))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'tests' / 'support'))

from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import CameraFrame
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import Person, Room, pinhole, render, walking, with_flying_pixels, with_noise

SIZE = (960, 540)
RATE = 15.0
STRIDE = 1.4
SPEED = 0.8
# People of a row, distance of the first row and from row to row [m]; a row is as wide as the picture there.
ROW, NEAREST, ROW_DEPTH = 10, 3.2, 1.3


class Input(NamedTuple):
    """What the estimator is given of one frame."""

    people: People2D
    points: OrganizedCloud
    bgr: np.ndarray


class Timings:
    """Milliseconds of the frames of one number of people: all of it, and stage by stage."""

    def __init__(self) -> None:
        self.whole: List[float] = []
        self.stages: Dict[str, List[float]] = {}

    def add(self, seconds: float, stages: Dict[str, float]) -> None:
        """Add a frame."""
        self.whole.append(1e3 * seconds)
        for name, part in stages.items():
            self.stages.setdefault(name, []).append(1e3 * part)


def walkers(count: int, seconds: float) -> List[Person]:
    """Return people who walk to the right, side by side in rows of at most ten."""
    people = []
    for i in range(count):
        row, place = divmod(i, ROW)
        # every other row looks through the gaps of the one before it
        gap = row % 2 / 2
        in_row = min(ROW, count - row * ROW)
        z = NEAREST + row * ROW_DEPTH
        width = 0.85 * z / 0.5625
        x = (place + 0.5 + gap) * width / in_row - width / 2 + SPEED * (seconds - 0.25)
        colour = tuple(int(value) for value in np.random.default_rng(i).integers(30, 225, 3))
        people.append(Person(i, x, z, walking(2 * np.pi * (SPEED * seconds / STRIDE + i / 7)), yaw=0.5, shirt=colour))
    return people


def inputs_of(count: int, frames: int) -> List[Input]:
    """Return some frames in a row of so many people."""
    camera, rng = pinhole(*SIZE), np.random.default_rng(count)
    rays, room, result = camera.ray_grid(), Room(wall=7.0), []
    for i in range(frames):
        frame = render(camera, walkers(count, i / RATE), room, seed=i)
        depth = with_flying_pixels(with_noise(frame.depth, rng), rng)
        cloud = cloud_from_depth(depth / 1000, camera, frame.bgr, rays)
        result.append(Input(frame.people, OrganizedCloud(cloud['x'], cloud['y'], cloud['z']), frame.bgr))
    return result


def to_and_fro(inputs: List[Input]) -> Iterator[Input]:
    """Return frames forwards, then backwards, and so on for ever, so that nobody jumps."""
    while True:
        yield from inputs
        yield from inputs[-2:0:-1]


def measure(numbers: List[int], rounds: int, warm_up: int, frames: int, settings: EstimatorSettings
            ) -> Tuple[Dict[int, Timings], Dict[int, float]]:
    """Return the timings of each number of people, and how many people were in the picture on average."""
    scenes = {count: inputs_of(count, frames) for count in numbers}
    shown = {count: float(np.mean([len(each.people) for each in scene])) for count, scene in scenes.items()}
    runs = {count: (PeopleEstimator(settings), to_and_fro(scene)) for count, scene in scenes.items()}
    timings = {count: Timings() for count in numbers}
    for number in range(warm_up + rounds):
        for count, (estimator, stream) in runs.items():
            given = next(stream)
            began = time.perf_counter()
            estimate = estimator.update(given.people, CameraFrame(SIZE, given.points, number / RATE, given.bgr))
            seconds = time.perf_counter() - began
            if number >= warm_up:
                timings[count].add(seconds, getattr(estimate, 'timing', None) or {})
    return timings, shown


def table(timings: Dict[int, Timings], shown: Dict[int, float]) -> str:
    """Return what was measured as text."""
    stages = list(dict.fromkeys(name for each in timings.values() for name in each.stages))
    rows = [['people', 'in view', 'median', 'p95', *stages]]
    rows += [[str(count), f'{shown[count]:.1f}', f'{np.median(each.whole):.2f}', f'{np.percentile(each.whole, 95):.2f}',
              *(f'{np.median(each.stages[name]):.2f}' if name in each.stages else '-' for name in stages)]
             for count, each in timings.items()]
    if len(timings) > 1:
        counts = list(shown.values())
        slopes = [np.polyfit(counts, [np.median(values) for values in columns], 1)[0]
                  for columns in ([each.whole for each in timings.values()],
                                  *([each.stages.get(name, [0.0]) for each in timings.values()] for name in stages))]
        rows.append(['per person', '', f'{slopes[0]:.3f}', '', *(f'{slope:.3f}' for slope in slopes[1:])])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return '\n'.join('  '.join(cell.rjust(width) for cell, width in zip(row, widths)) for row in rows)


def main() -> None:
    """Parse the command line, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--people', nargs='+', type=int, default=[1, 2, 5, 10, 20],
                        help='numbers of people (default: 1 2 5 10 20)')
    parser.add_argument('--rounds', type=int, default=200, help='frames of each number (default: %(default)s)')
    parser.add_argument('--warm-up', type=int, default=15, help='frames before those (default: %(default)s)')
    parser.add_argument('--frames', type=int, default=8,
                        help='different frames, shown to and fro; 17 MB each and number (default: %(default)s)')
    parser.add_argument('--set', action='append', default=[], metavar='KEY=VALUE', help='a parameter of the estimator')
    arguments = parser.parse_args()
    # whatever the libraries do with threads, all of them share one core
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    cv2.setNumThreads(1)
    pairs = [setting.partition('=') for setting in arguments.set]
    try:
        settings = build(EstimatorSettings, {key: yaml.safe_load(value) for key, _, value in pairs})
        timings, shown = measure(arguments.people, arguments.rounds, arguments.warm_up, arguments.frames, settings)
    except OpenposeRosError as error:
        raise SystemExit(f'error: {error}') from error
    sys.stdout.write(f'ms of PeopleEstimator.update at {SIZE[0]} x {SIZE[1]}, one core; stages are medians\n\n'
                     f'{table(timings, shown)}\n')


if __name__ == '__main__':
    main()
