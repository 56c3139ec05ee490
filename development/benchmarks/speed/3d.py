#!/usr/bin/python3
"""Measure the time that people in space take, against their number, without ROS.

Synthetic people walk side by side before a camera of 960 x 540. Their exact pixels and the cloud, as drivers send it,
go through `PeopleEstimator.update`, on one core; frames of all numbers of people take turns. For each number: median
and 95th percentile of a frame, the medians of its stages; the cost of one person more is the slope of the medians.

    ./run bench speed 3d --people 1 5 --rounds 400 --set lifting=mean3x3
"""
import itertools
import os
import sys
from dataclasses import replace
from typing import List, Tuple

import cv2
import numpy as np
import pandas as pd

from common import Parser, elapsed
from openpose_ros_pkg.command_line import add_settings, run_command, setting_values
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import Person, Room, pinhole, render, walking, with_flying_pixels, with_noise

# Of the images: width and height [px], rate [Hz]; different ones, shown to and fro; those before the measured ones.
SIZE, RATE, FRAMES, WARM_UP = (960, 540), 15.0, 8, 15
# Of the people [m, m/s].
STRIDE, SPEED = 1.4, 0.8
# People of a row, distance of the first row and from row to row [m]; a row is as wide as the image there.
ROW, NEAREST, ROW_DEPTH = 10, 3.2, 1.3


def walkers(count: int, seconds: float) -> List[Person]:
    """Return people who walk to the right, side by side in rows of at most ten."""
    people = []
    for i in range(count):
        row, place = divmod(i, ROW)
        gap = row % 2 / 2  # every other row looks through the gaps of the one before it
        in_row = min(ROW, count - row * ROW)
        z = NEAREST + row * ROW_DEPTH
        width = 0.85 * z / 0.5625
        x = (place + 0.5 + gap) * width / in_row - width / 2 + SPEED * (seconds - 0.25)
        colour = tuple(int(value) for value in np.random.default_rng(i).integers(30, 225, 3))
        people.append(Person(i, x, z, walking(2 * np.pi * (SPEED * seconds / STRIDE + i / 7)), yaw=0.5, shirt=colour))
    return people


def frames_of(count: int) -> List[Tuple[People2D, Frame]]:
    """Return the people in consecutive images, and the frames, forwards and backwards, so that no person jumps."""
    camera, rng = pinhole(*SIZE), np.random.default_rng(count)
    rays, room, result = camera.ray_grid(), Room(wall=7.0), []
    for i in range(FRAMES):
        frame = render(camera, walkers(count, i / RATE), room, seed=i)
        depth = with_flying_pixels(with_noise(frame.depth, rng), rng)
        cloud = cloud_from_depth(depth / 1000, camera, frame.bgr, rays)
        result.append((frame.people, Frame('', 0.0, frame.bgr, OrganizedCloud(cloud['x'], cloud['y'], cloud['z']))))
    return result + result[-2:0:-1]


def measure(numbers: List[int], rounds: int, settings: EstimatorSettings) -> pd.DataFrame:
    """Return a row per frame: number of people, how many are in view on average, milliseconds in all and of stages."""
    scenes = {count: frames_of(count) for count in numbers}
    shown = {count: float(np.mean([len(people) for people, _ in scene[:FRAMES]])) for count, scene in scenes.items()}
    runs = {count: (PeopleEstimator(settings), itertools.cycle(scene)) for count, scene in scenes.items()}
    rows = []
    for number in range(WARM_UP + rounds):
        for count, (estimator, stream) in runs.items():
            people, frame = next(stream)
            frame = replace(frame, stamp=number / RATE)
            milliseconds, estimate = elapsed(lambda one=estimator, given=(people, frame): one.update(*given))
            stages = {name: 1e3 * seconds for name, seconds in estimate.timing.items()}
            rows.append({'people': count, 'in view': shown[count], 'whole': milliseconds, **stages})
    return pd.DataFrame(rows[WARM_UP * len(runs):])


def table(frames: pd.DataFrame) -> str:
    """Return medians, the 95th percentile, and the cost of one person more, as text."""
    by_number = frames.groupby('people')
    medians = by_number.median()
    rows = medians.rename(columns={'whole': 'median'})
    rows.insert(2, 'p95', by_number.whole.quantile(0.95))
    if len(rows) > 1:
        slopes = medians.fillna(0).apply(lambda column: np.polyfit(medians['in view'], column, 1)[0])
        rows.loc['per person'] = slopes.rename({'whole': 'median'}).drop('in view')
    return rows.to_string(float_format='%.3f', na_rep='')


def main() -> int:
    """Parse the command line, measure, print; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('--people', nargs='+', type=int, default=[1, 2, 5, 10, 20],
                        help='numbers of people (default: 1 2 5 10 20)')
    parser.add_argument('--rounds', type=int, default=200, help='frames of each number (default: %(default)s)')
    add_settings(parser, 'of the estimator')
    arguments = parser.parse_args()
    # whatever the libraries do with threads, all of them share one core
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    cv2.setNumThreads(1)
    settings = build(EstimatorSettings, setting_values(parser, arguments.settings))
    frames = measure(arguments.people, arguments.rounds, settings)
    print(f'ms of PeopleEstimator.update at {SIZE[0]} x {SIZE[1]}, one core; stages are medians\n\n{table(frames)}')
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))
