#!/usr/bin/python3
"""Measure how many cameras one detector serves: rate, latency and people of each, for numbers of cameras and modes.

Each row of the table: camera drivers play sequences of 960 x 540 forth and back, `cameras.launch` starts the chain, and
the results of all cameras are counted for a while. The sequences are made of the shipped one (--people). Several rates
and numbers of people are those of the cameras in turn. `target_rate` is the greatest of the rates.

Fairness: least rate of a camera by the greatest; of cameras of several rates, by their share of the frames. Latency:
from the camera's stamp to the arrival of the 3D message in a subscriber, all cameras together. People: mean number per
frame. T: one f32 pass of mobilenet_thin at 656 x 368 on two threads, before each row.

    ./run bench cameras many --processes one                      # the table of docs/several_cameras.md
    ./run bench cameras many --cameras 3 --rates 30 15 5 --processes one --people 1 2 0
"""
import argparse
import itertools
import os
import sys
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray

from common import Parser, markdown, run_live
from crowd import make_crowd
from nodes import PEOPLE_3D, TOPICS, by_node, make_bag, median_and_95, start_camera, watch_nodes
from results.machine import Unit
from session import Session

# One process, or a service and an extractor for each camera: arguments of cameras.launch.
PROCESSES = {'one': 'one_process:=true', 'extractors': 'one_process:=false'}


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--cameras', type=int, nargs='+', default=[1, 2, 3, 4, 6, 8], help='numbers of cameras')
    parser.add_argument('--modes', nargs='+', default=['fast', 'balanced'], choices=('fast', 'balanced', 'accurate'))
    parser.add_argument('--processes', nargs='+', default=list(PROCESSES), choices=PROCESSES, help='(default: both)')
    parser.add_argument('--rates', type=float, nargs='+', default=[15.0], help='of the cameras in turn [Hz]')
    parser.add_argument('--people', type=int, nargs='+', default=[1], choices=range(9), metavar='0..8',
                        help='before the cameras in turn')
    parser.add_live(seconds=15.0, warm_up=8.0)
    return parser.parse_live()


def measure_row(session: Session, bags: Sequence[Path], combination: Tuple[str, int, str],
                arguments: argparse.Namespace) -> Dict[str, object]:
    """Run the chain in a mode before a number of cameras, in one process or not, and return the figures."""
    mode, count, processes = combination
    names = [f'camera{number}' for number in range(1, count + 1)]
    rates = list(itertools.islice(itertools.cycle(arguments.rates), count))
    drivers = [start_camera(session, bag, rate, bag.with_name(f'{name}.txt'), (f'driver_{name}', f'/{name}/qhd'),
                            topics=TOPICS['depth_image'], frame_id=name)
               for name, rate, bag in zip(names, rates, itertools.cycle(bags))]
    seen = watch_nodes(session, [
        'roslaunch', 'skeleton_extract_3d', 'cameras.launch', f"cameras:={' '.join(names)}", f'mode:={mode}',
        'points_source:=depth_image', f'target_rate:={max(rates)}', PROCESSES[processes], *arguments.launch],
        {f'/{name}{PEOPLE_3D}': PersonDetection_3dArray for name in names}, arguments)
    load = os.getloadavg()[0]
    for driver in drivers:
        session.stop(driver)
    found = np.array([len(each) / seen.seconds for each in seen.arrivals])
    return {'mode': mode, 'processes': processes, 'cameras': count, 'load': round(load, 1),
            'results of each camera [Hz]': ', '.join(f'{rate:.1f}' for rate in found),
            'of all [Hz]': round(found.sum(), 1),
            'fairness': round((found / rates).min() / (found / rates).max(), 2),
            'latency median / 95 % [ms]': median_and_95(np.concatenate(seen.latencies)),
            'people': ', '.join(f'{np.mean(each) if len(each) else np.nan:.2f}' for each in seen.people),
            'processor [% of a core]': by_node(seen.processor), 'memory [MB]': by_node(seen.memory)}


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> List[str]:
    """Measure all rows and print the table."""
    rospy.init_node('many_cameras', disable_signals=True)
    unit, rows = Unit(), []
    sequences = [make_crowd(folder / f'crowd_{people}', [people]) for people in arguments.people]
    bags = [make_bag(sequence, folder / f'{number}.bag', cloud=False) for number, sequence in enumerate(sequences)]
    for combination in itertools.product(arguments.modes, arguments.cameras, arguments.processes):
        milliseconds = round(unit.milliseconds())
        rows.append({'T [ms]': milliseconds, **measure_row(session, bags, combination, arguments)})
        print(*rows[-1].values(), sep=' | ', flush=True)
    print('\n' + markdown([[*rows[0]], *(row.values() for row in rows)]), flush=True)
    return []


if __name__ == '__main__':
    sys.exit(run_live(measure, parse_arguments()))
