#!/usr/bin/python3
"""Measure the time of pose networks as a share of T, of files with random weights and of the default networks.

FOLDER has the files that `make_random.py` writes, of any other network that is recognised, or none. T: one f32 pass of
mobilenet_thin at 656 x 368 on as many threads, once in each round; a share is the median of those of the rounds. All
networks take turns in a round, so that what disturbs the machine disturbs all. `crop`: a network that sees one person,
alone and four of them side by side, by person. The image is noise: networks with random weights find no people, and
suppression of overlapping boxes takes little time; decoding is not counted.

    ./run bench networks shares FOLDER
    ./run bench networks shares FOLDER --write       # also docs/images/networks_time.svg, development/notes/networks.md

With --write the accuracy that the makers publish is drawn against the time; `networks/published.py` names the sources.
"""
import argparse
import os
import sys
import time
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Tuple

import numpy as np

from common import Parser, markdown
from networks.published import draw_plot, write_table
from openpose_ros_pkg.command_line import run_command
from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.networks.backends import Backend, BackendParams, create_backend
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.models import find_model, weights_path

# Networks that are there by default: sizes (width, height) of their input [px]; the first is T.
DEFAULT = {'mobilenet_thin': (656, 368), 'movenet_multipose': (512, 288), 'movenet_thunder': (256, 256)}
# Longer side of the input of a network that leaves it free [px], for an image of 16:9.
FREE = (640, 384)
CROP_DECODERS = (Decoder.SIMCC, Decoder.MOVENET_SINGLEPOSE)
TOGETHER = 4


class Timed(NamedTuple):
    """A network that is timed: by precision, what is called and by how many its time is divided."""

    name: str
    size: Tuple[int, int]  # of the input [px]
    calls: Dict[str, Tuple[Callable[[], object], int]]  # title of a column -> call, number of images


def timed(name: str, model: Model, size: Tuple[int, int], options: argparse.Namespace) -> Timed:
    """Load a network in all precisions."""
    image = np.random.default_rng(1).integers(0, 256, (1, size[1], size[0], 3)).astype(np.uint8)
    calls: Dict[str, Tuple[Callable[[], object], int]] = {}
    for precision in options.precisions:
        backend: Backend = create_backend(model, weights_path(model), BackendParams(
            threads=options.threads, precision=precision, compiled_cache=options.cache))
        calls[precision] = (lambda network=backend: network.infer(image)), 1
        if model.decoder in CROP_DECODERS:
            calls[f'{precision}, {TOGETHER} crops'] = (
                lambda network=backend: network.infer_many(TOGETHER * [image])), TOGETHER
    return Timed(name, size, calls)


def load_all(options: argparse.Namespace) -> List[Timed]:
    """Load the default networks, the first for T, and those of the folder that are recognised."""
    networks = [timed(name, find_model(name), size, options) for name, size in DEFAULT.items()]
    for path in sorted(options.folder.glob('*.onnx')):
        try:
            model = find_model(str(path))
            networks.append(timed(path.stem, model, model.input.fixed_size or FREE, options))
        except OpenposeRosError as error:
            print(f'{path.name} is left out: {error}', file=sys.stderr, flush=True)
    return networks


def seconds(call: Callable[[], object]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def measure(networks: List[Timed], rounds: int) -> Tuple[float, List[Dict[str, float]]]:
    """Return T [ms] and the shares of T of each network by the titles of `calls`."""
    whole: List[float] = []
    shares: List[Dict[str, List[float]]] = [{title: [] for title in network.calls} for network in networks]
    unit = networks[0].calls['f32'][0]
    for number in range(rounds + 1):
        in_round = [{title: seconds(call) / images for title, (call, images) in network.calls.items()}
                    for network in networks]
        t = float(np.median([seconds(unit) for _ in range(3)] + [in_round[0]['f32']]))
        print(f'round {number}: T = {1e3 * t:.1f} ms', file=sys.stderr, flush=True)
        if number == 0:
            continue  # compiled only now
        whole.append(t)
        for kept, times in zip(shares, in_round):
            for title, value in times.items():
                kept[title].append(value / t)
    medians = [{title: float(np.median(values)) for title, values in kept.items()} for kept in shares]
    return 1e3 * float(np.median(whole)), medians


def main() -> int:
    """Parse the command line, measure, print; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('folder', type=Path, help='of networks (.onnx)')
    parser.add_argument('--threads', type=int, default=2, help='threads (default: %(default)s)')
    parser.add_argument('--rounds', type=int, default=15, help='rounds (default: %(default)s)')
    parser.add_argument('--precisions', nargs='+', choices=('f32', 'auto'), default=['f32', 'auto'],
                        help='f32, and auto: bf16 where the processor has it (default: both)')
    parser.add_argument('--cache', default='off', help='folder of compiled networks (default: %(default)s)')
    parser.add_argument('--write', action='store_true', help='write plot and table of the docs')
    options = parser.parse_args()
    if 'f32' not in options.precisions:
        parser.error('T needs f32')
    networks = load_all(options)
    t, shares = measure(networks, options.rounds)
    titles = list(dict.fromkeys(title for network in networks for title in network.calls))
    rows = [['network', 'input', *titles],
            *([network.name, '{}x{}'.format(*network.size),
               *(f'{share[title]:.3f}' if title in share else '-' for title in titles)]
              for network, share in zip(networks, shares))]
    table = markdown(rows)
    print(f'T = {t:.1f} ms, {options.threads} threads of {os.cpu_count()} cores, shares of T, medians of '
          f'{options.rounds} rounds\n\n{table}', flush=True)
    if options.write:
        write_table(t, options.threads, options.rounds, table)
        draw_plot({network.name: share for network, share in zip(networks, shares)})
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))
