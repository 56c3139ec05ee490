#!/usr/bin/python3
"""Measure where the time of the 2D detector goes on this machine, with one network alone.

For each size of the network's input, number of threads and runtime: milliseconds of the bare network, of preprocessing,
and of a whole `detect()`; for the largest size, those of decoding the fields of 1, 5 and 20 people. All are medians of
rounds in which everything takes its turn, so that a busy moment hits all alike. The images show one person of the
shipped sequence many times.

With --side-by-side: several images of one network one after the other on all threads, or side by side on a thread each;
crops beside a pass over the full image; and all of it in bf16. Times are the least of all rounds, as shares of one f32
pass of mobilenet_thin at 656x368 in the same run.

With --memory: whether the memory of the detector stays the same over so many images of 0 to 5 people in changing sizes.
Small inputs make it quick; what is lost with each image shows all the same.

    benchmarks/speed_2d.py
    benchmarks/speed_2d.py --side-by-side --rounds 100
    benchmarks/speed_2d.py --memory 10000
    benchmarks/speed_2d.py --memory 540 --image-sizes 30
    benchmarks/speed_2d.py --rounds 20 --sizes 656x368 --threads 2 --markdown
"""
import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, Callable, Dict, List, Sequence, Tuple

import cv2
import numpy as np
import pandas as pd
import psutil

from common import DEMO, Parser, elapsed, markdown
from openpose_ros_pkg.detect.detector import Detector, DetectorSettings, PreparedFrame, create_detector
from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.networks.backends import Backend, BackendParams, create_backend
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MOVENET_MULTIPOSE, MOVENET_THUNDER
from openpose_ros_pkg.networks.models import weights_path
from openpose_ros_pkg.params.parameters import build

SIZES = ('368x208', '432x240', '496x280', '656x368')
BACKENDS = ('openvino', 'onnxruntime', 'opencv_dnn')
PEOPLE = (1, 5, 20)
IMAGE_SIZE = (540, 960)
# Inputs of what is timed side by side; those of crops are square.
SIDE_BY_SIDE = {MOBILENET_THIN: (656, 368), MOVENET_MULTIPOSE: (384, 224), MOVENET_THUNDER: (256, 256)}
CROPS = (1, 2, 3, 5)
BESIDE = 2
# What the memory is measured with.
QUICK = {'mode': 'fast', 'net_input_height': 128, 'look_closer': 2, 'precision': 'auto'}
# One person in the first image of the shipped sequence: left, top, right, bottom [px].
CUT = (590, 80, 805, 525)


def image_of(people: int) -> np.ndarray:
    """Return (540, 960, 3) uint8 BGR with a person `people` times."""
    source = cv2.imread(str(min((DEMO / 'rgb').iterdir())))
    if source is None:
        raise SystemExit(f'no image in {DEMO}')
    left, top, right, bottom = CUT
    person = source[top:bottom, left:right]
    rows = 1 if people <= 6 else 2
    columns = -(-people // rows)
    height, width = IMAGE_SIZE[0] // rows, IMAGE_SIZE[1] // max(columns, 3)
    scale = min(height / person.shape[0], width / person.shape[1])
    person = cv2.resize(person, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    canvas = np.full((*IMAGE_SIZE, 3), source[5, 5], np.uint8)
    for i in range(people):
        y, x = i // columns * height, i % columns * width
        canvas[y:y + person.shape[0], x:x + person.shape[1]] = person
    return canvas


def time_rounds(cases: Dict[Any, Callable[[], float]], rounds: int) -> pd.DataFrame:
    """Return the milliseconds of every case in each round, after two rounds that do not count."""
    times = [{name: measure() for name, measure in cases.items()} for _ in range(rounds + 2)]
    return pd.DataFrame(times[2:])


def decoding(detector: Detector, frame: PreparedFrame) -> float:
    """Return the milliseconds from the outputs of the networks to people."""
    computing, computed = elapsed(lambda: detector.compute(frame))
    return computing + elapsed(lambda: detector.finish(computed))[0] - 1e3 * computed.network_seconds


class Replay:
    """A network that answers at once, with what another one has computed for an image."""

    name = description = 'replay'
    fallback = ''

    def __init__(self, network: Backend, images: np.ndarray) -> None:
        self._outputs = network.infer(images)

    def infer(self, images: np.ndarray) -> Tuple[np.ndarray, ...]:
        """Return the outputs."""
        return self._outputs

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Tuple[np.ndarray, ...]]:
        """Return the outputs for each image."""
        return [self._outputs for _ in images]


def detector_for(backend: str, size: str, threads: int, model: str) -> Detector:
    """Load one network with one runtime for one size of its input."""
    width, height = (int(side) for side in size.split('x'))
    return create_detector(build(DetectorSettings, {
        'pose_model': model, 'net_input_width': width, 'net_input_height': height, 'backend': backend,
        'threads': threads}))


def with_threads(threads: int, measure: Callable[[], float]) -> Callable[[], float]:
    """Return a measurement with a number of threads for OpenCV, which is one number for the whole process."""
    def run() -> float:
        cv2.setNumThreads(threads)
        return measure()
    return run


def whole_table(options: argparse.Namespace) -> List[List[str]]:
    """Time runtimes, sizes and threads; return the rows of the table."""
    rows = []
    image = image_of(options.people)
    for size in options.sizes:
        for threads in options.threads:
            cases = {}
            for backend in options.backends:
                try:
                    detector = detector_for(backend, size, threads, options.model)
                except OpenposeRosError as error:
                    sys.stderr.write(f'{backend} is left out: {error}\n')
                    continue
                frame = detector.prepare(image)
                for name, measure in (
                        ('prepare', lambda d=detector: elapsed(lambda: d.prepare(image))[0]),
                        ('network', lambda d=detector, f=frame: 1e3 * d.compute(f).network_seconds),
                        ('decode', lambda d=detector, f=frame: decoding(d, f)),
                        ('detect', lambda d=detector: elapsed(lambda: d.detect(image))[0])):
                    cases[f'{name} {backend}'] = with_threads(threads, measure)
            times = time_rounds(cases, options.rounds)
            for backend in [name for name in options.backends if f'network {name}' in times]:
                columns = [times[f'{name} {backend}'] for name in ('network', 'prepare', 'decode', 'detect')]
                against = times.get('network opencv_dnn')
                rows.append([size, str(threads), backend, *(f'{column.median():.1f}' for column in columns),
                             f'{(columns[3] / columns[0]).median():.2f}',
                             '-' if against is None else f'{(against / columns[0]).median():.2f}'])
    return rows


def decode_table(options: argparse.Namespace) -> List[List[str]]:
    """Time the decoder on what the network says of 1, 5 and 20 people; return the rows of the table."""
    detector = detector_for(options.backends[0], options.sizes[-1], 0, options.model)
    cases, found = {}, []
    for people in PEOPLE:
        frame = detector.prepare(image_of(people))
        networks = {name: Replay(network, frame.views[0][0].input[np.newaxis])
                    for name, network in frame.setup.networks.items()}
        frame = replace(frame, setup=replace(frame.setup, networks=networks))
        cases[people] = lambda f=frame: decoding(detector, f)
        found.append(len(detector.finish(detector.compute(frame))))
    times = time_rounds(cases, 10 * options.rounds)
    return [[*(f'{median:.2f}' for median in times.median()), f'{(times[PEOPLE[-1]] / times[PEOPLE[0]]).median():.2f}',
             '/'.join(str(number) for number in found)]]


def side_by_side_cases(cores: int, precision: str) -> Dict[Tuple[str, str], Callable[[], float]]:
    """Return what is timed with one precision, by row and column of the table."""
    random = np.random.default_rng(0)
    cases: Dict[Tuple[str, str], Callable[[], float]] = {}

    def case(row: str, column: str, call: Callable[[], Any]) -> None:
        cases[f'{row}, {precision}', column] = lambda: elapsed(call)[0]

    pool, one_thread = ThreadPoolExecutor(1), {}
    crops = [random.integers(0, 256, (1, 256, 256, 3), dtype=np.uint8) for _ in range(max(CROPS))]
    for model, (width, height) in SIDE_BY_SIDE.items():
        images = crops if width == height else [random.integers(0, 256, (1, height, width, 3), dtype=np.uint8)] * 2
        weights = weights_path(model)
        wide, narrow = (create_backend(model, weights, BackendParams(threads=threads, precision=precision))
                        for threads in (cores, 1))
        one_thread[model] = narrow
        for count in CROPS if width == height else (1, 2):
            row, these = f'{model.name} {width}x{height}, {count}', images[:count]
            case(row, 'in turn, all threads', lambda n=wide, i=these: [n.infer(image) for image in i])
            case(row, 'in turn, 1 thread', lambda n=narrow, i=these: [n.infer(image) for image in i])
            case(row, 'side by side', lambda n=wide, i=these: n.infer_many(i))
        if width == height:
            continue

        def beside(search: Backend = narrow, image: np.ndarray = images[0]) -> None:
            searched = pool.submit(search.infer, image)
            for crop in crops[:BESIDE]:
                one_thread[MOVENET_THUNDER].infer(crop)
            searched.result()

        def after(search: Backend = wide, image: np.ndarray = images[0]) -> None:
            search.infer(image)
            thunder.infer_many(crops[:BESIDE])

        row = f'{model.name} {width}x{height} and {BESIDE} crops of {MOVENET_THUNDER.name}'
        case(row, 'side by side', beside)
        case(row, 'in turn, all threads', after)
    thunder = create_backend(MOVENET_THUNDER, weights_path(MOVENET_THUNDER),
                             BackendParams(threads=cores, precision=precision))
    return cases


def side_by_side_table(options: argparse.Namespace) -> List[List[str]]:
    """Time images one after the other and side by side; return the table."""
    cores = max(options.threads)
    cases = {**side_by_side_cases(cores, 'f32'), **side_by_side_cases(cores, 'auto')}
    least = time_rounds(cases, options.rounds).min()
    columns = ['in turn, all threads', 'in turn, 1 thread', 'side by side']
    rows = list(dict.fromkeys(row for row, _ in cases))
    unit = least[rows[0], columns[0]]
    print(f'{rows[0]}: {unit:.1f} ms on {cores} threads\n')
    return [['network, images, precision', *columns],
            *([row, *(f'{least[row, column] / unit:.3f}' if (row, column) in cases else '-' for column in columns)]
              for row in rows)]


def memory_table(options: argparse.Namespace) -> List[List[str]]:
    """Return the resident memory after some numbers of images [MB]."""
    detector, process = create_detector(build(DetectorSettings, QUICK)), psutil.Process()
    people = [np.zeros((*IMAGE_SIZE, 3), np.uint8), *(image_of(count) for count in range(1, 6))]
    images = [cv2.resize(image, (480 + 16 * number, 360)) for number in range(options.image_sizes) for image in people]
    rows = [['images', 'resident memory [MB]']]
    for number in range(1, options.memory + 1):
        detector.detect(images[number % len(images)])
        if number in (len(images), 100, 1000, 3000, options.memory):
            rows.append([str(number), f'{process.memory_info().rss / 1e6:.0f}'])
            sys.stderr.write(f'{rows[-1]}\n')
    return rows


def main() -> None:
    """Parse the command line, measure, print."""
    parser = Parser(__doc__)
    parser.add_argument('--model', default='mobilenet_thin', help='network (default: %(default)s)')
    parser.add_argument('--sizes', nargs='+', default=SIZES, help='inputs of the network (default: all)')
    parser.add_argument('--threads', nargs='+', type=int, default=(1, 2), help='threads (default: 1 2)')
    parser.add_argument('--backends', nargs='+', default=BACKENDS, help='runtimes (default: all)')
    parser.add_argument('--people', type=int, default=5, help='people in the image (default: %(default)s)')
    parser.add_argument('--side-by-side', action='store_true', help='time several images at a time instead')
    parser.add_argument('--memory', type=int, default=0, help='number of images: measure memory instead')
    parser.add_argument('--image-sizes', type=int, default=4, help='sizes of these images (default: %(default)s)')
    parser.add_argument('--rounds', type=int, default=10, help='rounds (default: %(default)s)')
    options = parser.parse_args()
    if options.side_by_side:
        print(markdown(side_by_side_table(options)))
        return
    if options.memory:
        print(markdown(memory_table(options)))
        return
    print(f'\n{options.model}, {options.people} people, ms: medians of {options.rounds} rounds\n')
    print(markdown([['input', 'threads', 'runtime', 'network', 'preprocess', 'decode', 'detect()',
                     'detect() / network', 'opencv_dnn / this'], *whole_table(options)]), flush=True)
    if options.model == 'mobilenet_thin':
        print(f'decoding at {options.sizes[-1]}, ms\n')
        print(markdown([[*(f'{people} people' for people in PEOPLE), f'{PEOPLE[-1]} / {PEOPLE[0]}', 'found'],
                        *decode_table(options)]))


if __name__ == '__main__':
    main()
