#!/usr/bin/python3
"""Measure the live chain's rate with a network of a file against the rate of the networks alone.

Each row: a camera driver plays the shipped sequence (960 x 540, two people) faster than the networks can, and the
people node (colour and depth images, 2D, lifting, tracking, publishing) computes every newest image in full, as without
following. The passes of its networks in the measured time are recorded, and computed again alone right after it, in the
same order, on noise: what that takes, as a share of the measured time, is the chain's rate against that of the networks
alone. Rounds take turns; a cell is the median of the rounds.

Files with random weights (`make_random.py`) find no people. So that the chain has work, MoveNet's people are put into
the outputs (`stand_ins.py`): MultiPose's for networks of the whole image, Thunder's for those of crops; what MoveNet
computes for this, of inputs that it has not seen yet, is recorded and computed again as well. Networks of crops run
behind the searchers of the mode `balanced`; for boxes (YOLOX) Thunder is the crop network. With all threads the rest of
the chain takes time from the networks where the machine has no other cores; --threads below the number of cores shows
what the pipeline alone leaves open. `computing`: share of the time in which a network computes; what is missing to 1 is
decoding and cutting between passes, and what the share is below it is cores and memory that others use meanwhile.

    ./run bench networks rate FOLDER/rtmo_s.onnx FOLDER/rtmpose_m.onnx
    ./run bench networks rate FOLDER/*.onnx --threads 1 --precision auto
"""
import argparse
import os
import sys
import time
from pathlib import Path
from typing import Dict, List, NamedTuple

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray

import nodes
from common import DEMO, ROOT, Parser, markdown, run_live
from networks.stand_ins import Call, read_calls
from openpose_ros_pkg.networks.backends import BackendParams, create_backend
from openpose_ros_pkg.networks.model_types import Decoder
from openpose_ros_pkg.networks.models import find_model, weights_path
from results.machine import Unit
from session import ResultWatch, Session

EXTRACTOR = '/skeleton_extract_3d_node'
NODE = ROOT / 'development/benchmarks/networks/node.py'


class Row(NamedTuple):
    """What was measured in a round: seconds, results and their people, seconds of the passes in it and alone."""

    seconds: float
    results: int
    people: float
    computing: float
    alone: float
    stages: Dict[str, float]


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('files', type=Path, nargs='+', help='networks (.onnx, .xml)')
    parser.add_argument('--rate', type=float, default=30.0, help='of the camera [Hz] (default %(default)s)')
    parser.add_argument('--threads', type=int, nargs='+', default=[1, 2], help='of the networks (default: 1 2)')
    parser.add_argument('--precision', choices=('f32', 'auto'), default='f32', help='default: %(default)s')
    parser.add_argument('--rounds', type=int, default=3, help='default: %(default)s')
    parser.add_argument('--folder', type=Path, default=DEMO, help='sequence folder to play')
    parser.add_live(seconds=12.0, warm_up=6.0)
    return parser.parse_live()


def measure_round(session: Session, folder: Path, file: Path, threads: int, options: argparse.Namespace) -> Row:
    """Run the chain, then its networks alone."""
    model, calls_file = find_model(str(file)), folder / 'calls.txt'
    name = 'crop_model' if model.decoder == Decoder.SIMCC else 'pose_model'
    os.environ['NETWORK_CALLS'] = str(calls_file)
    if rospy.has_param(EXTRACTOR):
        rospy.delete_param(EXTRACTOR)  # those of the row before
    camera = nodes.start_camera(session, folder / 'camera.bag', options.rate)
    watch = ResultWatch(nodes.PEOPLE_3D, PersonDetection_3dArray)
    seen = nodes.watch_nodes(session, [
        sys.executable, str(NODE), f'__name:={EXTRACTOR[1:]}', f'_{name}:={file.resolve()}',
        '_points_source:=depth_image', '_following:=never', '_target_rate:=0', f'_threads:={threads}',
        f'_precision:={options.precision}', *(f'_{text}' for text in options.launch)], watch, options,
        f'{EXTRACTOR}/timing')
    session.stop(camera)
    begin, end = seen.arrivals[0], seen.arrivals[-1]
    calls = [call for call in read_calls(calls_file) if begin < call.end <= end]
    return Row(end - begin, len(seen.arrivals) - 1, float(np.mean(seen.people)),
               sum(call.seconds for call in calls), seconds_alone(calls, file, threads, options.precision), seen.stages)


def seconds_alone(calls: List[Call], file: Path, threads: int, precision: str) -> float:
    """Return the time that passes take with nothing between them [s]."""
    params, noise = BackendParams(threads=threads, precision=precision), np.random.default_rng(1)
    models = {model.name: model for model in (find_model(str(file)), *map(find_model, {
        call.network for call in calls} - {file.name}))}
    networks = {name: create_backend(model, weights_path(model), params) for name, model in models.items()}
    images = {tuple(shape): noise.integers(0, 256, shape).astype(np.uint8) for call in calls for shape in call.shapes}

    def compute(call: Call) -> None:
        inputs = [images[tuple(shape)] for shape in call.shapes]
        if call.together:
            networks[call.network].infer_many(inputs)
        else:
            networks[call.network].infer(inputs[0])

    for call in {repr(call[1:4]): call for call in calls}.values():
        compute(call)  # compiled now
    begin = time.perf_counter()
    for call in calls:
        compute(call)
    return time.perf_counter() - begin


def measure(session: Session, folder: Path, options: argparse.Namespace) -> List[str]:
    """Measure all rows and print the table."""
    rospy.init_node('rate', disable_signals=True)
    unit = Unit()
    nodes.make_bag(options.folder, folder / 'camera.bag')
    measured: Dict[tuple, List[Row]] = {}
    units = []
    for number in range(options.rounds):
        for threads in options.threads:
            for file in options.files:
                units.append(unit.milliseconds())
                row = measure_round(session, folder, file, threads, options)
                measured.setdefault((file.stem, threads), []).append(row)
                print(f'round {number + 1}: {file.stem}, {threads} threads: {row.results / row.seconds:.1f} Hz, '
                      f'{row.people:.1f} people, {row.alone / row.seconds:.3f} of the networks alone, computing '
                      f'{row.computing / row.seconds:.3f} of the time; stages [ms]: ',
                      ', '.join(f'{name} {value:.1f}' for name, value in row.stages.items()), flush=True)
    rows: List[List[object]] = [['network', 'threads', 'chain [Hz]', 'networks alone [Hz]', 'share', 'least',
                                 'computing', 'people']]
    for (name, threads), rounds in measured.items():
        shares = [row.alone / row.seconds for row in rounds]
        rows.append([name, threads, f'{np.median([row.results / row.seconds for row in rounds]):.1f}',
                     f'{np.median([row.results / row.alone for row in rounds]):.1f}', f'{np.median(shares):.3f}',
                     f'{min(shares):.3f}', f'{np.median([row.computing / row.seconds for row in rounds]):.3f}',
                     f'{np.mean([row.people for row in rounds]):.1f}'])
    print(f'\n{options.precision}, camera {options.rate:g} Hz, T = {min(units):.1f} - {max(units):.1f} ms, '
          f'{os.cpu_count()} cores\n\n{markdown(rows)}', flush=True)
    return []


if __name__ == '__main__':
    sys.exit(run_live(measure, parse_arguments()))
