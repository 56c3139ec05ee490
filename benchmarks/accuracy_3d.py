#!/usr/bin/python3
"""Measure the 3D chain, without ROS, on RGB-D sequences with known joints.

Runs detector, 2D tracker and estimator over sequence folders and writes the joints as the CSV that
`rostopic echo -p` makes of the per-person 3D message. With --evaluate, the given script scores them. With --lag, the
frames are estimated a second time without smoothing, and the delay of both against the truth is told.
A sequence folder holds rgb/, depth/ (16-bit PNG [mm]), gt.json and either meta.json (K, width, height, fps) or
camera.yaml and sequence.yaml.

    benchmarks/accuracy_3d.py SEQUENCE [SEQUENCE ...] --evaluate evaluate.py --lag
    benchmarks/accuracy_3d.py SEQUENCE --exact-2d --out FOLDER

The method of the original:

    benchmarks/accuracy_3d.py SEQUENCE --evaluate evaluate.py --set lifting=mean3x3 --set tracking=false
"""
import csv
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Callable, List, Optional, Tuple

import numpy as np
import pandas as pd

from common import Parser, errors_end_the_program
from openpose_ros_mocap.people import pair_people
from openpose_ros_pkg.detect.detector import DetectorSettings, create_detector
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.frame import CameraFrame
from skeleton_extract_3d.people import MEASURED, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence
from skeleton_extract_3d.settings import EstimatorSettings

# Label of joints that are seen, in gt.json.
VISIBLE = 2
# Who is nearer to somebody, by the median of the joints, is that person [m]; frames of a path that tells a lag.
SAME_PERSON, LAG_FRAMES = 0.3, 20
PART_FIELDS = ('x', 'y', 'z', 'confidence', 'status', 'sigma')

# From the number of a frame and its image to the people in it.
FindPeople = Callable[[int, np.ndarray], People2D]


@dataclass(frozen=True)
class ChainSettings:
    """The parameters of the chain; those that tracker and estimator both have are one here."""

    detector: DetectorSettings
    tracking: TrackingParams
    estimator: EstimatorSettings


def open_sequence(folder: Path) -> RgbdSequence:
    """Open a sequence with the camera of its camera.yaml or meta.json."""
    if (folder / 'camera.yaml').is_file():
        return RgbdSequence.read(folder)
    meta = json.loads((folder / 'meta.json').read_text())
    camera = CameraModel(meta['width'], meta['height'], meta['K'])
    return RgbdSequence(folder, camera, meta['fps'], meta.get('frame_id', ''))


def true_floors(folder: Path, sequence: RgbdSequence) -> np.ndarray:
    """Return the floor, z = 0 in the world, in each frame of the camera, (F, 4): see `CameraFrame`."""
    path = folder / 'meta.json'
    meta = json.loads(path.read_text()) if path.is_file() else {'T_world_camera': sequence.T_world_camera}
    poses = meta.get('poses') or [meta['T_world_camera']] * len(sequence)
    return np.array(poses)[:, 2]  # the third row leads from the camera to z in the world


def exact_people(folder: Path) -> FindPeople:
    """Return a finder that knows the true pixels: every joint within the image, hidden or not."""
    truth = json.loads((folder / 'gt.json').read_text())
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]

    def find(index: int, bgr: np.ndarray) -> People2D:
        people = truth['frames'][index]['people']
        keypoints = np.full((len(people), len(order), 3), np.nan, np.float32)
        keypoints[..., 2] = 0
        for person, row in zip(people, keypoints):
            inside = np.array(person['vis'])[order] > 0
            row[inside, :2] = np.array(person['uv'])[order][inside]
            row[inside, 2] = 1
        return People2D(COCO_18, keypoints, np.ones(len(people)), np.full(len(people), -1))

    return find


def find_people(sequence: RgbdSequence, find: FindPeople, chain: PeopleChain) -> Tuple[List[People2D], List[float]]:
    """Return the people in each image, with ids, and the milliseconds that each took."""
    people, times = [], []
    for i, frame in enumerate(sequence):
        began = time.perf_counter()
        found = find(i, frame.bgr)
        times.append(1e3 * (time.perf_counter() - began))
        people.append(chain.in_image(found, '', frame.time))
    return people, times


def estimate(sequence: RgbdSequence, people: List[People2D], chain: PeopleChain, floors: Optional[np.ndarray] = None
             ) -> Tuple[List[Tuple[float, People3D]], List[float]]:
    """Return time [s] and people of each frame, and the milliseconds that each took.

    Args:
        floors: (F, 4) the floor in each frame; None: it is not known.
    """
    frames, times = [], []
    size = (sequence.camera.width, sequence.camera.height)
    for i, (frame, found) in enumerate(zip(sequence, people)):
        floor = None if floors is None else floors[i]
        points = DepthImage(frame.depth, sequence.camera)
        began = time.perf_counter()
        answer = chain.in_space(found, CameraFrame(size, points, frame.time, frame.bgr, floor=floor))
        times.append(1e3 * (time.perf_counter() - began))
        frames.append((frame.time, answer.people))
    return frames, times


def measured_paths(folder: Path, frames: List[Tuple[float, People3D]]) -> List[Tuple[np.ndarray, np.ndarray]]:
    """Return, for each visible joint, where it was measured and where it truly was in frames in a row, (F, 3) [m]."""
    truth = json.loads((folder / 'gt.json').read_text())
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]
    rows: List[Tuple[float, ...]] = []
    for number, ((_, found), frame) in enumerate(zip(frames, truth['frames'])):
        people = [(person['id'], np.array(person['xyz'])[order], np.array(person['vis'])[order] == VISIBLE)
                  for person in frame['people']]
        for row, other in pair_people(found.xyz, np.array([xyz for _, xyz, _ in people]), SAME_PERSON):
            person, xyz, visible = people[other]
            rows += [(person, joint, number, *found.xyz[row, joint], *xyz[joint])
                     for joint in np.flatnonzero(visible & (found.status[row] == MEASURED))]
    paths = []
    for _, path in pd.DataFrame(rows).groupby([0, 1]):
        for _, run in path.groupby((path[2].diff() > 1).cumsum()):
            if len(run) >= LAG_FRAMES:
                paths.append((run[[3, 4, 5]].to_numpy(), run[[6, 7, 8]].to_numpy()))
    return paths


def lag(paths: List[Tuple[np.ndarray, np.ndarray]]) -> float:
    """Return by how many frames the measured paths come after the true ones: the delay with the least squared error.

    The mean difference of each path does not count.
    """
    delays = np.arange(-2, 3.001, 0.05)
    errors = np.zeros(len(delays))
    for measured, true in paths:
        number = np.arange(len(true))
        inner = number[3:-3]
        for i, delay in enumerate(delays):
            then = np.stack([np.interp(inner - delay, number, axis) for axis in true.T], axis=1)
            off = measured[inner] - then
            errors[i] += ((off - off.mean(axis=0)) ** 2).sum()
    return float(delays[errors.argmin()])


def write_csv(path: Path, frames: List[Tuple[float, People3D]]) -> None:
    """Write one row per person and frame, with the columns of the per-person 3D message."""
    with path.open('w', newline='') as handle:
        writer = csv.writer(handle)
        writer.writerow(['%time', 'field.header.stamp', 'field.num_people_detected', 'field.person_ID',
                         *(f'field.{joint}.{part}' for joint in COCO_18.joints for part in PART_FIELDS)])
        for seconds, people in frames:
            stamp = round(seconds * 1e9)
            values = np.concatenate([people.xyz, people.confidence[..., None], people.status[..., None],
                                     people.sigma[..., None]], axis=2)
            for person, row in zip(people.ids.tolist(), values):
                writer.writerow([stamp, stamp, len(people), person, *row.ravel().tolist()])


def main() -> None:
    """Run the benchmark from the command line."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    parser.add_argument('--exact-2d', action='store_true', help='take the true pixels instead of the detector')
    parser.add_settings('of the chain')
    parser.add_argument('--floor', action='store_true', help='the true floor is known, as with use_floor')
    parser.add_argument('--lag', action='store_true', help='tell the delay of the smoothed joints')
    parser.add_argument('--out', type=Path, help='folder for the CSV files (default: a temporary one)')
    parser.add_argument('--evaluate', type=Path, help='script that scores pairs of sequence folder and CSV')
    arguments = parser.parse_args()
    with errors_end_the_program():
        settings = build(ChainSettings, parser.settings(arguments.set))
        raw = replace(settings.estimator, smoothing=replace(settings.estimator.smoothing, smoothing=False))
        detector = None if arguments.exact_2d else create_detector(settings.detector)
        with tempfile.TemporaryDirectory() as temporary:
            out = arguments.out or Path(temporary)
            out.mkdir(parents=True, exist_ok=True)
            items, detecting, estimating, paths, raw_paths = [], [], [], [], []
            for folder in arguments.sequences:
                find = exact_people(folder) if detector is None else lambda _, bgr: detector.detect(bgr)
                sequence = open_sequence(folder)
                chain = PeopleChain(COCO_18, settings.estimator, settings.tracking)
                people, milliseconds = find_people(sequence, find, chain)
                detecting += milliseconds
                floors = true_floors(folder, sequence) if arguments.floor else None
                frames, milliseconds = estimate(sequence, people, chain, floors)
                estimating += milliseconds
                path = out / f'{folder.resolve().parent.name}_{folder.resolve().name}.csv'
                write_csv(path, frames)
                items += [str(folder), str(path)]
                if arguments.lag:
                    paths += measured_paths(folder, frames)
                    raw_paths += measured_paths(folder, estimate(sequence, people, PeopleChain(COCO_18, raw))[0])
            sys.stdout.write(f'median ms per frame: 2D {np.median(detecting):.1f}, 3D {np.median(estimating):.2f}\n')
            if arguments.lag:
                sys.stdout.write(f'lag in frames: smoothed {lag(paths):.2f}, single frames {lag(raw_paths):.2f}\n')
            sys.stdout.flush()
            if arguments.evaluate:
                raise SystemExit(subprocess.call([sys.executable, str(arguments.evaluate), *items]))


if __name__ == '__main__':
    main()
