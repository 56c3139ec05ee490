#!/usr/bin/python3
"""Measure the 3D chain, without ROS, on RGB-D sequences with known joints.

Runs detector, tracker and lifting over sequence folders and writes the joints as the CSV that
`rostopic echo -p` makes of the per-person 3D message. With --evaluate, the given script scores them.
A sequence folder holds rgb/, depth/ (16-bit PNG [mm]), gt.json and either meta.json (K, width, height, fps) or
camera.yaml and sequence.yaml.

    benchmarks/accuracy_3d.py SEQUENCE [SEQUENCE ...] --evaluate evaluate.py
    benchmarks/accuracy_3d.py SEQUENCE --exact-2d --set window=5 --set statistic=median --out FOLDER
"""
import argparse
import csv
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'openpose_ros_pkg' / 'src'))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'skeleton_extract_3d' / 'src'))

from openpose_ros_pkg.detector import DETECTOR_PARAMETERS, create_detector
from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.params import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_pkg.tracking import KeypointTracker, TrackingParams
from skeleton_extract_3d.camera import CameraModel
from skeleton_extract_3d.depth import DepthImage
from skeleton_extract_3d.lifting import LiftingParams, lift
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.rgbd_sequence import RgbdSequence

PARAMETERS = (*DETECTOR_PARAMETERS, TrackingParams, LiftingParams)
PART_FIELDS = ('x', 'y', 'z', 'confidence', 'status', 'sigma')

# From the number of a frame and its picture to the people in it.
FindPeople = Callable[[int, np.ndarray], People2D]


def open_sequence(folder: Path) -> RgbdSequence:
    """Open a sequence with the camera of its camera.yaml or meta.json."""
    if (folder / 'camera.yaml').is_file():
        return RgbdSequence.read(folder)
    meta = json.loads((folder / 'meta.json').read_text())
    camera = CameraModel(meta['width'], meta['height'], meta['K'])
    return RgbdSequence(folder, camera, meta['fps'], meta.get('frame_id', ''))


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


def run_chain(sequence: RgbdSequence, find: FindPeople, tracking: TrackingParams, lifting: LiftingParams
              ) -> Tuple[List[Tuple[float, People3D]], np.ndarray]:
    """Return time [s] and people of each frame, and the milliseconds (2D, tracking, lifting) of each, (F, 3)."""
    tracker, frames, times = KeypointTracker(tracking), [], []
    for i, frame in enumerate(sequence):
        began = time.perf_counter()
        people = find(i, frame.bgr)
        found = time.perf_counter()
        people = tracker.update(people, frame.time)
        tracked = time.perf_counter()
        size = (sequence.camera.width, sequence.camera.height)
        frames.append((frame.time, lift(people, size, DepthImage(frame.depth, sequence.camera), lifting)))
        times.append((found - began, tracked - found, time.perf_counter() - tracked))
    return frames, 1e3 * np.array(times)


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
            for person, row in zip(people.ids.tolist(), values.reshape(len(people), -1).tolist()):
                writer.writerow([stamp, stamp, len(people), person, *row])


def parameter_values(settings: List[str]) -> Dict[str, Any]:
    """Return the mapping of KEY=VALUE settings, values as in YAML."""
    pairs = [setting.partition('=') for setting in settings]
    return {key: yaml.safe_load(value) for key, _, value in pairs}


def main() -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    parser.add_argument('--exact-2d', action='store_true', help='take the true pixels instead of the detector')
    parser.add_argument('--set', action='append', default=[], metavar='KEY=VALUE', help='a parameter of the chain')
    parser.add_argument('--out', type=Path, help='folder for the CSV files (default: a temporary one)')
    parser.add_argument('--evaluate', type=Path, help='script that scores pairs of sequence folder and CSV')
    arguments = parser.parse_args()
    try:
        *detector_params, tracking, lifting = build(PARAMETERS, parameter_values(arguments.set))
        detector = None if arguments.exact_2d else create_detector(*detector_params)
        with tempfile.TemporaryDirectory() as temporary:
            out = arguments.out or Path(temporary)
            out.mkdir(parents=True, exist_ok=True)
            items, times = [], []
            for folder in arguments.sequences:
                find = exact_people(folder) if detector is None else lambda _, bgr: detector.detect(bgr)
                frames, milliseconds = run_chain(open_sequence(folder), find, tracking, lifting)
                path = out / f'{folder.resolve().parent.name}_{folder.resolve().name}.csv'
                write_csv(path, frames)
                items += [str(folder), str(path)]
                times.append(milliseconds)
            detection, tracks, lifts = np.median(np.concatenate(times), axis=0)
            sys.stdout.write(f'median ms per frame: 2D {detection:.1f}, tracking {tracks:.2f}, lifting {lifts:.2f}\n')
            sys.stdout.flush()
            if arguments.evaluate:
                subprocess.run([sys.executable, str(arguments.evaluate), *items], check=True)
    except (OpenposeRosError, OSError, subprocess.CalledProcessError) as error:
        raise SystemExit(f'error: {error}') from error


if __name__ == '__main__':
    main()
