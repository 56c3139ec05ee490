#!/usr/bin/python3
"""Measure the whole 3D chain live: rate, latency by stage, processor and memory, for rates, numbers of people, points.

Each row of the table: a camera driver in C++, a nodelet manager, plays a sequence of 960 x 540 forth and back, on a ROS
master of its own; detection, extractor and visualization are started by roslaunch, and the results are counted for a
while. The sequences are made of the shipped one (1, 2, 5 or 8 people), or given by --folder. `target_rate` is the
camera's rate unless it is given. Latency: from the camera's stamp to the arrival of the 3D message in a subscriber. T:
one f32 pass of mobilenet_thin at 656 x 368 on two threads, before and after each row, while the nodes do not run.
Start: from roslaunch to the first result. Networks alone: images of the sequence through the same networks, one after
the other, with the stamps of the results, when the nodes have ended.

--points cloud_to_depth: the cloud becomes a depth image in the driver's process. With --rests, all subscribers leave a
few times, until the chain rests: first_result is the time from the next subscription to the first result.

    ./run bench live_3d                                       # the table of docs/accuracy_and_speed.md
    ./run bench live_3d --rates 30 --people 2 --points depth_image --seconds 30 mode:=balanced
"""
import argparse
import itertools
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, Sequence

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, Timing

from accuracy_3d import open_sequence
from common import Figures, Parser, Usage, elapsed, markdown, new_path, run_live
from live.camera import NAMESPACE, Unit, make_bag, node_processes, start_camera, start_cloud_to_depth
from live.crowd import make_crowd
from live.figures import by_stage, median_and_95, wanted_rate
from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.params.parameters import build, parameter_fields
from openpose_ros_pkg.ros.session import ResultWatch, Session, wait_for
from skeleton_extract_3d.ros.extractor import AGE_STAGES

TOPIC = '/openpose_ros/skeleton_3d/detected_poses_3d'
EXTRACTOR = '/skeleton_extract_3d_node'
SERVICES = ('/openpose_ros_service_node_3d', EXTRACTOR)
START_TIMEOUT = 120.0
# How often the chain rests, and for how long: the nodes notice within a second that nobody listens.
RESTS, REST_SECONDS = 10, 3.0
MADE_DEPTH = f'{NAMESPACE}/depth_registered'
# How points leave the driver: arguments of demo.launch.
POINTS = {'depth_image': ['points_source:=depth_image'], 'point_cloud': ['points_source:=point_cloud'],
          'cloud_to_depth': ['points_source:=depth_image', f'depth:={MADE_DEPTH}/image_rect',
                             f'camera_info:={MADE_DEPTH}/camera_info']}
COLUMNS = ('camera [Hz]', 'people', 'points', 'T [ms]', 'results [Hz]', 'wanted', 'networks alone [Hz]',
           'latency median / 95 % [ms]', 'sum of the stages', 'stages, means [ms]', 'processor [% of a core]',
           'memory [MB]', 'start [s]')


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--rates', type=float, nargs='+', default=[10.0, 15.0, 30.0], help='of the camera [Hz]')
    parser.add_argument('--people', type=int, nargs='+', default=[1, 2, 5, 8], choices=range(1, 9), metavar='1..8')
    parser.add_argument('--points', nargs='+', choices=POINTS, default=['depth_image', 'point_cloud'])
    parser.add_argument('--folder', type=Path, nargs='+', help='sequence folders to play instead of --people')
    parser.add_argument('--seconds', type=float, default=15.0, help='to measure a row (default %(default)s)')
    parser.add_argument('--warm-up', type=float, default=5.0, help='not measured at first [s] (default %(default)s)')
    parser.add_argument('--rests', action='store_true', help='measure the first result after a rest as well')
    parser.add_argument('--json', type=new_path, help='write the figures here')
    parser.add_argument('launch_arguments', nargs='*', metavar='NAME:=VALUE', help='passed on to demo.launch')
    return parser.parse_named('launch_arguments')


def first_results(nodes: subprocess.Popen) -> List[float]:
    """Return how long a subscriber waits for the first result of a chain that rests, several times [ms]."""
    waits = []
    for _ in range(RESTS):
        time.sleep(REST_SECONDS)
        begin, results = time.monotonic(), ResultWatch(TOPIC, PersonDetection_3dArray)
        wait_for(lambda results=results: len(results.arrivals) > 0, START_TIMEOUT, 'result after a rest', nodes)
        results.stop()
        waits.append(1000 * (results.arrivals[0] - begin))
    return waits


def networks_alone(sequence: Path, stamps: Sequence[float]) -> float:
    """Return the images per second of the networks that the running nodes have, without nodes.

    Args:
        stamps: of the images that the nodes answered [s].
    """
    names = {field.name for field in parameter_fields(ServiceSettings)}
    values = next(rospy.get_param(node) for node in SERVICES if 'target_rate' in rospy.get_param(node, {}))
    settings = build(ServiceSettings, {name: value for name, value in values.items() if name in names})
    stream = NetworkDetection(create_detector(settings.detector), settings.tracking, settings.following)
    stream.warm_up()
    images = [frame.bgr for frame in open_sequence(sequence)]
    there_and_back = images + images[-2:0:-1]
    times = []
    for bgr, stamp in zip(itertools.cycle(there_and_back), stamps):
        frame = stream.prepare(ImageFrame('alone', stamp, bgr))
        times.append(elapsed(lambda frame=frame: stream.finish(stream.compute(frame)))[0])
    return 1000 / float(np.mean(times[len(times) // 5:]))


class Bench:
    """Rows of the table.

    Args:
        folder: for logs and bags.
    """

    def __init__(self, session: Session, folder: Path, arguments: argparse.Namespace) -> None:
        self._session, self._folder, self._arguments = session, folder, arguments
        self._unit, self._timing = Unit(), Timing()
        rospy.init_node('live_3d', disable_signals=True)
        self._listener = rospy.Subscriber(f'{EXTRACTOR}/timing', Timing, self._keep_timing, queue_size=1)

    def _keep_timing(self, message: Timing) -> None:
        self._timing = message

    def row(self, sequence: Path, people: object, rate: float, points: str) -> Figures:
        """Run the chain on a sequence and return the figures."""
        before = self._unit.milliseconds()
        bag = make_bag(sequence, self._folder / 'camera.bag')
        camera = start_camera(self._session, bag, rate)
        if points == 'cloud_to_depth':
            start_cloud_to_depth(self._session)
        began = time.monotonic()
        nodes = self._session.start('nodes', [
            'roslaunch', 'skeleton_extract_3d', 'demo.launch', 'play:=false', 'world_tf:=false', f'target_rate:={rate}',
            *POINTS[points], *self._arguments.launch_arguments])
        results = ResultWatch(TOPIC, PersonDetection_3dArray)
        wait_for(lambda: len(results.arrivals) > 0, START_TIMEOUT, 'first result', nodes)
        start = results.arrivals[0] - began
        time.sleep(self._arguments.warm_up)
        first, usage = len(results.arrivals), Usage(node_processes())
        time.sleep(self._arguments.seconds)
        last, cpu, memory, stages = len(results.arrivals), usage.processor(), usage.memory(), self._timing.stages
        results.stop()
        arrivals, latencies = np.array(results.arrivals[first:last]), np.array(results.latencies[first:last])
        rests = first_results(nodes) if self._arguments.rests else []
        self._session.stop(nodes)
        self._session.stop(camera)
        log = (self._folder / 'nodes.log').read_text(errors='replace').splitlines()
        alone = networks_alone(sequence, arrivals - latencies)
        return {'people': people, 'camera_hz': rate, 'points': points, 'T_ms': [before, self._unit.milliseconds()],
                'log': [line for line in log if 'networks may take' in line or 'WARN' in line],
                'frames': len(latencies), 'rate_hz': (len(latencies) - 1) / (arrivals[-1] - arrivals[0]),
                'networks_alone_hz': alone, 'start_s': start, 'latency_ms': median_and_95(latencies),
                'stages_ms': {stage.stage: stage.mean for stage in stages}, 'first_result_ms': rests,
                'longest_gap_ms': 1000 * float(np.diff(arrivals).max()),
                'people_per_frame': {str(number): results.people[first:last].count(number)
                                     for number in sorted(set(results.people[first:last]))},
                'cpu_percent_of_a_core': cpu, 'memory_mb': memory}


def table_row(row: Figures) -> List[object]:
    """Return the cells of COLUMNS."""
    stages, total = by_stage(row['stages_ms'], AGE_STAGES)
    unit = sum(row['T_ms']) / 2

    def by_node(values: Dict[str, float]) -> str:
        return ', '.join(f'{name.strip("/")} {value:.0f}' for name, value in values.items())

    return [f"{row['camera_hz']:.0f}", row['people'], row['points'], ' - '.join(f'{each:.0f}' for each in row['T_ms']),
            f"{row['rate_hz']:.1f}", f"{wanted_rate(row['camera_hz'], unit):.1f}", f"{row['networks_alone_hz']:.1f}",
            row['latency_ms'], f'{total:.0f}', stages, by_node(row['cpu_percent_of_a_core']),
            by_node(row['memory_mb']), f"{row['start_s']:.1f}"]


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> Figures:
    """Measure all rows and print the table."""
    bench, rows = Bench(session, folder, arguments), []
    sequences = {path.name: path for path in arguments.folder or ()} or {
        number: make_crowd(number, folder / f'crowd_{number}') for number in arguments.people}
    for points, rate, (people, sequence) in itertools.product(arguments.points, arguments.rates, sequences.items()):
        rows.append(bench.row(sequence, people, rate, points))
        print(markdown([COLUMNS, table_row(rows[-1])]).splitlines()[-1], flush=True)
    print('\n' + markdown([COLUMNS, *map(table_row, rows)]), flush=True)
    return {'rows': rows}


def main() -> int:
    """Run the benchmark; return the exit status."""
    arguments = parse_arguments()
    return run_live(lambda session, folder: measure(session, folder, arguments), arguments.json)


if __name__ == '__main__':
    sys.exit(main())
