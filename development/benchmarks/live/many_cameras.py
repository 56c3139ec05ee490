#!/usr/bin/python3
"""Measure how many cameras one detector serves: rate, latency and people of each, for numbers of cameras and modes.

Each row of the table: camera drivers in C++ play sequences of 960 x 540 forth and back, on a ROS master of their own;
`cameras.launch` starts the chain, and the results of all cameras are counted for a while. The sequences are made of
the shipped one (--people), or given by --folder. Of several rates, numbers of people or folders the first is that of
the first camera, the second that of the next, and so on, in turn. `target_rate` is the greatest of the rates.

Fairness: the rate of the camera that got least by that of the one that got most; of cameras of several rates, by their
share of the frames. Latency: from the camera's stamp to the arrival of the 3D message in a subscriber, all cameras
together. People: mean number per frame. Processor: detection is the node with the networks, which with one process is
all there is. T: one f32 pass of mobilenet_thin at 656 x 368 on two threads, before each row.

    ./run bench many_cameras --ways one_process                   # the table of docs/several_cameras.md
    ./run bench many_cameras --cameras 3 --rates 30 15 5 --ways one_process --people 1 2 0
"""
import argparse
import itertools
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, Sequence

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray

from common import Figures, Parser, Usage, markdown, new_path, run_live
from live.camera import NAMESPACE, TOPICS, Unit, make_bag, node_processes, start_camera
from live.crowd import make_crowd
from live.figures import median_and_95
from session import ResultWatch, Session, wait_for

START_TIMEOUT = 240.0
# How the chain is cut into processes: arguments of cameras.launch.
WAYS = {'one_process': 'one_process:=true', 'extractors': 'one_process:=false'}
COLUMNS = ('mode', 'processes', 'cameras', 'T [ms]', 'load', 'results of a camera [Hz]', 'of all [Hz]', 'fairness',
           'latency median / 95 % [ms]', 'people', 'processor: detection, extractors, cameras [% of a core]',
           'memory [MB]')


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--cameras', type=int, nargs='+', default=[1, 2, 3, 4, 6, 8], help='numbers of cameras')
    parser.add_argument('--modes', nargs='+', default=['fast', 'balanced'], choices=('fast', 'balanced', 'accurate'))
    parser.add_argument('--ways', nargs='+', default=list(WAYS), choices=WAYS, help='one node, or one for each camera')
    parser.add_argument('--rates', type=float, nargs='+', default=[15.0], help='of the cameras in turn [Hz]')
    parser.add_argument('--people', type=int, nargs='+', default=[1], choices=range(9), metavar='0..8',
                        help='before the cameras in turn')
    parser.add_argument('--folder', type=Path, nargs='+', help='sequence folders to play instead of --people')
    parser.add_argument('--seconds', type=float, default=15.0, help='to measure a row (default %(default)s)')
    parser.add_argument('--warm-up', type=float, default=8.0, help='not measured at first [s] (default %(default)s)')
    parser.add_argument('--json', type=new_path, help='write the figures here')
    parser.add_argument('launch_arguments', nargs='*', metavar='NAME:=VALUE', help='passed on to cameras.launch')
    return parser.parse_named('launch_arguments')


def of_groups(values: Dict[str, float]) -> List[float]:
    """Return the sums of detection, extractors and cameras, of values by the name of the node."""
    sums = [0.0, 0.0, 0.0]
    for name, value in values.items():
        if name.startswith('/driver_'):
            sums[2] += value
        elif name in ('/openpose_ros_service_node', '/skeleton_extract_3d_node'):
            sums[0] += value
        elif name.endswith('/skeleton_extract_3d_node'):
            sums[1] += value
    return sums


class Bench:
    """Rows of the table.

    Args:
        folder: for logs.
        bags: of the sequences.
    """

    def __init__(self, session: Session, folder: Path, bags: Sequence[Path], arguments: argparse.Namespace) -> None:
        self._session, self._folder, self._bags, self._arguments = session, folder, bags, arguments
        self._unit = Unit()
        rospy.init_node('many_cameras', disable_signals=True)

    def _driver(self, name: str, rate: float, bag: Path) -> 'subprocess.Popen[bytes]':
        """Start the driver of a camera; return its process."""
        topics = {f'{NAMESPACE}/{topic}': f'/{name}/qhd/{topic}' for topic in TOPICS['depth_image'].split()}
        return start_camera(self._session, bag, rate, self._folder / f'{name}.txt',
                            {'__name': f'driver_{name}', **topics}, frame_id=name, topics=TOPICS['depth_image'])

    def row(self, mode: str, way: str, count: int) -> Figures:
        """Run the chain before a number of cameras and return the figures."""
        unit, names = self._unit.milliseconds(), [f'camera{number}' for number in range(1, count + 1)]
        rates = list(itertools.islice(itertools.cycle(self._arguments.rates), count))
        drivers = [self._driver(name, rate, bag) for name, rate, bag in zip(names, rates, itertools.cycle(self._bags))]
        nodes = self._session.start('nodes', [
            'roslaunch', 'skeleton_extract_3d', 'cameras.launch', f"cameras:={' '.join(names)}", f'mode:={mode}',
            'points_source:=depth_image', f'target_rate:={max(rates)}', WAYS[way], *self._arguments.launch_arguments])
        watches = [ResultWatch(f'/{name}/openpose_ros/skeleton_3d/detected_poses_3d', PersonDetection_3dArray)
                   for name in names]
        wait_for(lambda: all(watch.arrivals for watch in watches), START_TIMEOUT, 'first results', nodes)
        time.sleep(self._arguments.warm_up)
        first, begin, usage = [len(watch.arrivals) for watch in watches], time.monotonic(), Usage(node_processes())
        time.sleep(self._arguments.seconds)
        last, seconds = [len(watch.arrivals) for watch in watches], time.monotonic() - begin
        cpu, memory, load = usage.processor(), usage.memory(), os.getloadavg()[0]
        for watch in watches:
            watch.stop()
        for child in (nodes, *drivers):
            self._session.stop(child)
        frames = [range(*both) for both in zip(first, last)]
        found = np.array([len(each) / seconds for each in frames])
        return {'mode': mode, 'way': way, 'cameras': count, 'T_ms': unit, 'load': load, 'camera_hz': rates,
                'rates_hz': found.tolist(), 'fairness': float((found / rates).min() / (found / rates).max()),
                'latency_ms': median_and_95([watch.latencies[i] for watch, each in zip(watches, frames) for i in each]),
                'people': [float(np.mean([watch.people[i] for i in each])) if each else float('nan')
                           for watch, each in zip(watches, frames)],
                'cpu_percent_of_a_core': of_groups(cpu), 'memory_mb': sum(of_groups(memory)[:2])}


def table_row(row: Figures) -> List[object]:
    """Return the cells of COLUMNS."""
    rates = row['rates_hz']
    each = f'{min(rates):.1f} - {max(rates):.1f}' if len(set(row['camera_hz'])) == 1 else ', '.join(
        f'{rate:.1f}' for rate in rates)
    return [row['mode'], row['way'], row['cameras'], f"{row['T_ms']:.0f}", f"{row['load']:.1f}", each,
            f'{sum(rates):.1f}', f"{row['fairness']:.2f}", row['latency_ms'],
            ', '.join(f'{number:.2f}' for number in row['people']),
            ', '.join(f'{value:.0f}' for value in row['cpu_percent_of_a_core']), f"{row['memory_mb']:.0f}"]


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> Figures:
    """Measure all rows and print the table."""
    sequences = arguments.folder or [make_crowd(people, folder / f'crowd_{number}')
                                     for number, people in enumerate(arguments.people)]
    bags = [make_bag(sequence, folder / f'{number}.bag', cloud=False) for number, sequence in enumerate(sequences)]
    bench, rows = Bench(session, folder, bags, arguments), []
    for mode, count, way in itertools.product(arguments.modes, arguments.cameras, arguments.ways):
        rows.append(bench.row(mode, way, count))
        print(markdown([COLUMNS, table_row(rows[-1])]).splitlines()[-1], flush=True)
    print('\n' + markdown([COLUMNS, *map(table_row, rows)]), flush=True)
    return {'rows': rows}


def main() -> int:
    """Run the benchmark; return the exit status."""
    arguments = parse_arguments()
    return run_live(lambda session, folder: measure(session, folder, arguments), arguments.json)


if __name__ == '__main__':
    sys.exit(main())
