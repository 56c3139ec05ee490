#!/usr/bin/python3
"""Measure where the time of the 2D detector goes on this machine, with one network alone.

For each size of the network's input, number of threads and runtime: milliseconds of the bare network, of preprocessing,
of decoding, and of the whole. All are medians of rounds in which the runtimes take turns. The image shows one person of
the shipped sequence --people times.

    ./run bench speed 2d
    ./run bench speed 2d --rounds 20 --sizes 656x368 --threads 2 --backends openvino --people 20
"""
import argparse
import itertools
import sys
from typing import Dict, List

import cv2
import numpy as np
import pandas as pd

from common import DEMO, Parser, elapsed, markdown
from openpose_ros_pkg.command_line import run_command
from openpose_ros_pkg.detect.detector import Detector, create_detector
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.detect.views import decode_views, prepare_views
from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.params.parameters import build

SIZES = ('368x208', '432x240', '496x280', '656x368')
BACKENDS = ('openvino', 'onnxruntime', 'opencv_dnn')
IMAGE_SIZE = (540, 960)
# One person in the first image of the shipped sequence: left, top, right, bottom [px].
CUT = (590, 80, 805, 525)


def image_of(people: int) -> np.ndarray:
    """Return an image, (540, 960, 3) uint8 BGR, with a person several times."""
    source = cv2.imread(str(min((DEMO / 'rgb').iterdir())))
    left, top, right, bottom = CUT
    person, rows = source[top:bottom, left:right], 1 if people <= 6 else 2
    columns = -(-people // rows)
    height, width = IMAGE_SIZE[0] // rows, IMAGE_SIZE[1] // max(columns, 3)
    scale = min(height / person.shape[0], width / person.shape[1])
    person = cv2.resize(person, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    canvas = np.full((*IMAGE_SIZE, 3), source[5, 5], np.uint8)
    for y, x in ((i // columns * height, i % columns * width) for i in range(people)):
        canvas[y:y + person.shape[0], x:x + person.shape[1]] = person
    return canvas


def load_detectors(size: str, threads: int, options: argparse.Namespace) -> Dict[str, Detector]:
    """Load the network for one size of its input with each runtime that can compute it."""
    width, height = (int(side) for side in size.split('x'))
    detectors = {}
    for backend in options.backends:
        try:
            detectors[backend] = create_detector(build(DetectorSettings, {
                'pose_model': options.model, 'net_input_width': width, 'net_input_height': height, 'backend': backend,
                'threads': threads}))
        except OpenposeRosError as error:
            sys.stderr.write(f'{backend} is left out: {error}\n')
    return detectors


def time_stages(detector: Detector, image: np.ndarray) -> Dict[str, float]:
    """Return the milliseconds of each stage of a detection, and of a whole one."""
    setup, (one,) = detector.setup, detector.recipe.passes
    preparing, prepared = elapsed(lambda: prepare_views(image, one))
    network, views = elapsed(lambda: [view.compute(setup.networks[one.model.name]) for view in prepared])
    decoding, _ = elapsed(lambda: decode_views(one, views, setup))
    return {'network': network, 'prepare': preparing, 'decode': decoding,
            'whole': elapsed(lambda: people_in(image, detector))[0]}


def whole_table(options: argparse.Namespace) -> List[List[object]]:
    """Time runtimes, sizes and threads; return the rows of the table."""
    rows, image = [], image_of(options.people)
    for size, threads in itertools.product(options.sizes, options.threads):
        detectors = load_detectors(size, threads, options)
        cv2.setNumThreads(threads)
        rounds = [{backend: time_stages(detector, image) for backend, detector in detectors.items()}
                  for _ in range(options.rounds + 2)][2:]
        times = {backend: pd.DataFrame([each[backend] for each in rounds]) for backend in detectors}
        for backend, table in times.items():
            against = times.get('opencv_dnn', np.nan * table)['network']
            rows.append([size, threads, backend, *(f'{ms:.2f}' for ms in table.median()),
                         *(f"{(each / table['network']).median():.2f}" for each in (table['whole'], against))])
    return rows


def main() -> int:
    """Parse the command line, measure, print; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('--model', default='mobilenet_thin', help='network (default: %(default)s)')
    parser.add_argument('--sizes', nargs='+', default=SIZES, help='inputs of the network (default: all)')
    parser.add_argument('--threads', nargs='+', type=int, default=(1, 2), help='threads (default: 1 2)')
    parser.add_argument('--backends', nargs='+', default=BACKENDS, help='runtimes (default: all)')
    parser.add_argument('--people', type=int, default=5, help='people in the image (default: %(default)s)')
    parser.add_argument('--rounds', type=int, default=10, help='rounds (default: %(default)s)')
    options = parser.parse_args()
    print(f'\n{options.model}, {options.people} people, ms: medians of {options.rounds} rounds\n')
    print(markdown([['input', 'threads', 'runtime', 'network', 'preprocess', 'decode', 'whole',
                     'whole / network', 'opencv_dnn / this'], *whole_table(options)]), flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))
