#!/usr/bin/python3
"""Measure the running nodes: rate, latency by stage, processor and memory, for rates and numbers of people.

Each row of the table: a camera driver plays a sequence of 960 x 540 forth and back, made of the shipped one, and the
results of the 3D chain with its visualization are counted for a while.
`target_rate` is the camera's rate unless it is given. Latency: from the camera's stamp to the arrival of the message in
a subscriber. T: one f32 pass of mobilenet_thin at 656 x 368 on two threads, before and after the nodes run; latencies
in T are by the mean of both. Start: to the first result. The stages of `age` add up to the latency.

    ./run bench live                                          # all rates and numbers of people
    ./run bench live --rates 30 --people 2 --seconds 30 mode:=balanced
"""
import argparse
import contextlib
import io
import itertools
import subprocess
import sys
import time
import xmlrpc.client
from pathlib import Path
from typing import Dict, Iterable, List, Mapping, Optional, Tuple

import numpy as np
import psutil
import rosnode
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, Timing

from common import DEMO, Parser, markdown, run_live
from crowd import make_crowd
from openpose_ros_tools.ros import images_to_bag
from results.machine import Unit
from session import ResultWatch, Session, wait_for
from skeleton_extract_3d.ros.extractor import AGE_STAGES

NAMESPACE = '/kinect2/qhd'
# What the driver publishes.
TOPICS = ('image_color', 'camera_info', 'image_depth_rect')
PEOPLE_3D = '/openpose_ros/skeleton_3d/detected_poses_3d'
TIMING = '/skeleton_extract_3d_node/timing'
START_TIMEOUT, WARM_UP = 240.0, 5.0  # [s]
TOTALS = ('total', 'age')  # sums of stages


def make_bag(sequence: Path, bag: Path) -> Path:
    """Write a sequence folder into a bag for the driver; return the bag."""
    with contextlib.redirect_stdout(io.StringIO()):
        status = images_to_bag.main([str(sequence), '-o', str(bag), '--overwrite'])
    if status:
        raise OSError(f'{sequence} could not be written into {bag}')
    return bag


def start_camera(session: Session, bag: Path, rate: float, stamps: Optional[Path] = None,
                 names: Tuple[str, str] = ('camera', NAMESPACE), **parameters: object) -> 'subprocess.Popen[bytes]':
    """Start the driver; return its process. See bag_camera.cpp for the parameters.

    Args:
        stamps: file for `played_stamps`; None: beside the bag.
        names: of the node, and namespace of the topics.
    """
    node, namespace = names
    return session.start(node, ['rosrun', 'openpose_ros_nodelets', 'bag_camera', f'__name:={node}', f'_bag:={bag}',
                                f'_rate:={rate}', f'_topics:={" ".join(TOPICS)}',
                                *(f'_{key}:={value}' for key, value in parameters.items()),
                                *(f'{NAMESPACE}/{topic}:={namespace}/{topic}' for topic in TOPICS)],
                         stamps or bag.with_suffix('.txt'))


def played_stamps(stamps: Path) -> List[int]:
    """Return the stamps of the frames that a driver has published to a subscriber until now [ns]."""
    lines = stamps.read_text().splitlines(keepends=True)
    return [int(line) for line in lines if line.endswith('\n') and line.strip().isdigit()]  # others are the log's


def node_process(name: str) -> psutil.Process:
    """Return the process of a node; OSError: it does not answer."""
    node = xmlrpc.client.ServerProxy(rospy.get_master().lookupNode(name)[2])
    return psutil.Process(node.getPid(rospy.get_name())[2])


def watch_nodes(session: Session, command: List[str], seconds: float) -> Tuple[
        Dict[str, object], np.ndarray, np.ndarray]:
    """Start nodes, watch their results for a while after they have warmed up, and end them.

    Returns:
        Cells of a row; latency [s] and number of people of each result.
    """
    watch, began = ResultWatch(PEOPLE_3D, PersonDetection_3dArray), time.monotonic()
    nodes = session.start('nodes', command)
    wait_for(lambda: watch.arrivals, START_TIMEOUT, 'first results', nodes)
    start = time.monotonic() - began
    time.sleep(WARM_UP)
    processes = {name: node_process(name) for name in rosnode.get_node_names()
                 if name not in ('/rosout', rospy.get_name())}
    for process in processes.values():
        process.cpu_percent()  # begins to count
    first, begin = len(watch.arrivals), time.monotonic()
    time.sleep(seconds)
    last, measured = len(watch.arrivals), time.monotonic() - begin
    processor = {node: process.cpu_percent() for node, process in processes.items()}
    memory = {node: process.memory_info().rss / 1e6 for node, process in processes.items()}
    timing = rospy.wait_for_message(TIMING, Timing, START_TIMEOUT)
    watch.stop()
    session.stop(nodes)
    latencies, people = np.array(watch.latencies[first:last]), np.array(watch.people[first:last])
    late = 1e3 * np.percentile(latencies, (50, 95))
    means = {stage.stage: stage.mean for stage in timing.stages
             if np.isfinite(stage.mean) and stage.stage not in TOTALS}
    return {'results [Hz]': round(len(people) / measured, 1),
            'latency median / 95 % [ms]': ' / '.join(f'{value:.0f}' for value in late),
            'sum of the stages': round(sum(means.get(name, 0.0) for name in AGE_STAGES)),
            'stages, means [ms]': ', '.join(f'{name} {value:.1f}' for name, value in means.items()),
            'frames with 0, 1, ... people': ', '.join(map(str, np.bincount(people))),
            'processor [% of a core]': by_node(processor), 'memory [MB]': by_node(memory),
            'start [s]': round(start, 1)}, latencies, people


def by_node(values: Mapping[str, float]) -> str:
    """Return a figure of each node as text."""
    return ', '.join(f'{name.strip("/")} {value:.0f}' for name, value in values.items())


def worth_reading(log: Path) -> Iterable[str]:
    """Return the lines of a log of nodes that say how their figures came about."""
    return (line for line in log.read_text(errors='replace').splitlines()
            if any(word in line for word in ('networks may take', 'WARN', 'ERROR')))


def measure_all(session: Session, folder: Path, arguments: argparse.Namespace) -> List[Tuple[
        Dict[str, object], np.ndarray, np.ndarray]]:
    """Measure all rows and print each; return their cells, and latency [s] and number of people of each result."""
    rospy.init_node('live', disable_signals=True)
    unit, measured = Unit(), []
    for rate, people in itertools.product(arguments.rates, arguments.people):
        sequence = DEMO if people == 2 else make_crowd(folder / f'crowd_{people}', [people])
        before = unit.milliseconds()
        camera = start_camera(session, make_bag(sequence, folder / 'camera.bag'), rate)
        cells, *seen = watch_nodes(session, [
            'roslaunch', 'openpose_ros_bringup', 'people.launch', 'signals:=false', f'target_rate:={rate}',
            f'depth:={NAMESPACE}/image_depth_rect', *arguments.launch], arguments.seconds)
        session.stop(camera)
        after = unit.milliseconds()
        in_unit = 1e3 * np.percentile(seen[0], (50, 95)) / ((before + after) / 2)
        row = {'camera [Hz]': rate, 'people': people, **cells,
               'T [ms]': f'{before:.0f} - {after:.0f}', 'in T': ' / '.join(f'{value:.2f}' for value in in_unit)}
        measured.append((row, *seen))
        print(' | '.join(map(str, row.values())), *worth_reading(folder / 'nodes.log'), sep='\n', flush=True)
    return measured


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> List[str]:
    """Measure all rows and print the table."""
    rows = [row for row, *_ in measure_all(session, folder, arguments)]
    print('\n' + markdown([[*rows[0]], *(row.values() for row in rows)]), flush=True)
    return []


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--rates', type=float, nargs='+', default=[10.0, 15.0, 30.0], help='of the camera [Hz]')
    parser.add_argument('--people', type=int, nargs='+', default=[1, 2, 5, 8], choices=range(1, 9), metavar='1..8')
    parser.add_argument('--seconds', type=float, default=15.0, help='to measure a row (default %(default)s)')
    parser.add_argument('launch', nargs='*', metavar='NAME:=VALUE', help='arguments of the launch file, anywhere')
    named = [text for text in sys.argv[1:] if ':=' in text]
    arguments = parser.parse_args([text for text in sys.argv[1:] if text not in named])
    arguments.launch = named
    return arguments


if __name__ == '__main__':
    sys.exit(run_live(measure, parse_arguments()))
