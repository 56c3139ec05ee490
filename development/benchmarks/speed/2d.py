#!/usr/bin/python3
"""Measure where the time of the 2D detector goes on this machine, with one network alone.

For each size of the network's input, number of threads and runtime: milliseconds of the bare network, of preprocessing,
of decoding, and of a whole `detect()`. All are medians of rounds in which everything takes its turn, so that a busy
moment hits all alike. The image shows one person of the shipped sequence --people times.

    ./run bench speed 2d
    ./run bench speed 2d --rounds 20 --sizes 656x368 --threads 2 --backends openvino --people 20
"""
import argparse
import itertools
import sys
from typing import Any, Callable, Dict, List

import cv2
import numpy as np
import pandas as pd

from common import DEMO, Parser, elapsed, markdown
from openpose_ros_pkg.detect.detector import Detector, DetectorSettings, PreparedImage, create_detector
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


def time_rounds(cases: Dict[Any, Callable[[], float]], rounds: int) -> pd.DataFrame:
    """Return the milliseconds of every case in each round, after two rounds that do not count."""
    return pd.DataFrame([{name: measure() for name, measure in cases.items()} for _ in range(rounds + 2)][2:])


def decoding(detector: Detector, frame: PreparedImage) -> float:
    """Return the milliseconds from the outputs of the networks to people."""
    computing, computed = elapsed(lambda: detector.compute(frame))
    return computing + elapsed(lambda: detector.finish(computed))[0] - 1e3 * computed.network_seconds


def detector_for(backend: str, size: str, threads: int, model: str) -> Detector:
    """Load one network with one runtime for one size of its input."""
    width, height = (int(side) for side in size.split('x'))
    return create_detector(build(DetectorSettings, {
        'pose_model': model, 'net_input_width': width, 'net_input_height': height, 'backend': backend,
        'threads': threads}))


def whole_table(options: argparse.Namespace) -> List[List[str]]:
    """Time runtimes, sizes and threads; return the rows of the table."""
    rows, image = [], image_of(options.people)
    for size, threads in itertools.product(options.sizes, options.threads):
        cases = {}
        for backend in options.backends:
            try:
                detector = detector_for(backend, size, threads, options.model)
            except OpenposeRosError as error:
                sys.stderr.write(f'{backend} is left out: {error}\n')
                continue
            frame = detector.prepare(image)
            cases.update({
                f'prepare {backend}': lambda d=detector: elapsed(lambda: d.prepare(image))[0],
                f'network {backend}': lambda d=detector, f=frame: 1e3 * d.compute(f).network_seconds,
                f'decode {backend}': lambda d=detector, f=frame: decoding(d, f),
                f'detect {backend}': lambda d=detector: elapsed(lambda: d.detect(image))[0]})
        cv2.setNumThreads(threads)
        times = time_rounds(cases, options.rounds)
        for backend in [name for name in options.backends if f'network {name}' in times]:
            columns = [times[f'{name} {backend}'] for name in ('network', 'prepare', 'decode', 'detect')]
            against = times.get('network opencv_dnn')
            rows.append([size, str(threads), backend, *(f'{column.median():.2f}' for column in columns),
                         f'{(columns[3] / columns[0]).median():.2f}',
                         '-' if against is None else f'{(against / columns[0]).median():.2f}'])
    return rows


def main() -> None:
    """Parse the command line, measure, print."""
    parser = Parser(__doc__)
    parser.add_argument('--model', default='mobilenet_thin', help='network (default: %(default)s)')
    parser.add_argument('--sizes', nargs='+', default=SIZES, help='inputs of the network (default: all)')
    parser.add_argument('--threads', nargs='+', type=int, default=(1, 2), help='threads (default: 1 2)')
    parser.add_argument('--backends', nargs='+', default=BACKENDS, help='runtimes (default: all)')
    parser.add_argument('--people', type=int, default=5, help='people in the image (default: %(default)s)')
    parser.add_argument('--rounds', type=int, default=10, help='rounds (default: %(default)s)')
    options = parser.parse_args()
    print(f'\n{options.model}, {options.people} people, ms: medians of {options.rounds} rounds\n')
    print(markdown([['input', 'threads', 'runtime', 'network', 'preprocess', 'decode', 'detect()',
                     'detect() / network', 'opencv_dnn / this'], *whole_table(options)]), flush=True)


if __name__ == '__main__':
    main()
