"""Time of a frame, without ROS."""
import itertools
import time
from dataclasses import replace
from typing import List, Tuple

import numpy as np
import pandas as pd

import chain_runs
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from results import Options, Section, Table
from results.machine import Unit
from scoring.figures import Figure
from sections.rendered.modes import ROWS, TITLES
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import Person, Room, pinhole, render, walking, with_flying_pixels, with_noise

# Frames of each mode, from several scenes in turn; those of an accurate one; first frames that do not count.
FRAMES, FEW, WARM_UP, SCENES = 40, 10, 3, 4
# Numbers of synthetic people, and frames of each; different ones, shown to and fro; those before the measured ones.
PEOPLE, ROUNDS, DIFFERENT, FIRST = (1, 2, 5, 10, 20), 100, 8, 15
# Of their images: width and height [px], rate [Hz]; of their walk: length of two steps [m], speed [m/s].
SIZE, RATE, STRIDE, SPEED = (960, 540), 15.0, 1.4, 0.8
# People of a row, distance of the first row and from row to row [m]; a row is as wide as the image there.
ROW, NEAREST, ROW_DEPTH = 10, 3.2, 1.3


def measure(options: Options) -> Section:
    """Time the modes on some frames of scenes, and people in space on synthetic ones, with T before each."""
    unit, named = Unit(), {}
    rows: List[List[object]] = [['mode', 'T [ms]', '2D [ms]', '3D [ms]', 'frame [ms]', '95 % [ms]', 'frame in T']]
    for name, row in ROWS.items():
        before = unit.milliseconds()
        limit = WARM_UP + (FEW if name == 'accurate' or options.quick else FRAMES) // SCENES
        settings = build(ChainSettings, {**row['settings'], **options.settings})
        finder = chain_runs.Finder(settings, row.get('budget', 0.0))
        times = 1e3 * np.array([times for folder in options.scenes[:SCENES]  # of frames in 2D and 3D [ms]
                                for times in finder.run(folder, limit=limit).times[WARM_UP:]])
        whole = times.sum(axis=1)
        middle, most = np.percentile(whole, (50, 95))
        rows.append([TITLES.get(name, name), f'{before:.0f}', *(f'{each:.1f}' for each in np.median(times, axis=0)),
                     f'{middle:.0f}', f'{most:.0f}', f'{middle / before:.2f}'])
        named[f'{name}_ms'] = Figure(float(middle), n=len(whole), unit='ms', digits=0, text='median of a frame')
        named[f'{name}_t'] = Figure(float(middle / before), n=len(whole), digits=2, text='median of a frame in T')
    frames = times_of_people(5 if options.quick else ROUNDS)
    medians, late = frames.groupby('people').median(), frames.groupby('people').whole.quantile(0.95)
    people = [['people', 'in view', 'median [ms]', '95 % [ms]'],
              *([number, f"{medians['in view'][number]:.0f}", f'{medians.whole[number]:.2f}', f'{late[number]:.2f}']
                for number in PEOPLE)]
    named['person_ms'] = Figure(float(np.polyfit(medians['in view'], medians.whole, 1)[0]), unit='ms', digits=2,
                                text='of one person more in space')
    return Section(f'Scenes of the section on accuracy, first frames of {SCENES} of them, on all cores; median and 95 '
                   '% of the frames. 2D: networks, decoding, votes; 3D: lifting and tracking.', named,
                   [Table('Modes', rows), Table('People in space (3D) by their number, synthetic', people)])


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
    for i in range(DIFFERENT):
        frame = render(camera, walkers(count, i / RATE), room, seed=i)
        depth = with_flying_pixels(with_noise(frame.depth, rng), rng)
        cloud = cloud_from_depth(depth / 1000, camera, frame.bgr, rays)
        result.append((frame.people, Frame('', 0.0, frame.bgr, OrganizedCloud(cloud['x'], cloud['y'], cloud['z']))))
    return result + result[-2:0:-1]


def times_of_people(rounds: int) -> pd.DataFrame:
    """Return a row per frame of `PeopleEstimator.update`: number of people, how many are in view on average, and [ms].

    Exact pixels and the cloud, as drivers send it, on one core; frames of all numbers of people take turns.
    """
    scenes = {count: frames_of(count) for count in PEOPLE}
    shown = {count: float(np.mean([len(people) for people, _ in scene[:DIFFERENT]])) for count, scene in scenes.items()}
    settings = build(EstimatorSettings, {})
    runs = {count: (PeopleEstimator(settings), itertools.cycle(scene)) for count, scene in scenes.items()}
    rows = []
    for number in range(FIRST + rounds):
        for count, (estimator, stream) in runs.items():
            people, frame = next(stream)
            frame = replace(frame, stamp=number / RATE)
            began = time.perf_counter()
            estimator.update(people, frame)
            rows.append({'people': count, 'in view': shown[count], 'whole': 1e3 * (time.perf_counter() - began)})
    return pd.DataFrame(rows[FIRST * len(runs):])
