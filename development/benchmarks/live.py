#!/usr/bin/python3
"""Measure the running nodes: rate, latency by stage, processor and memory, for rates, numbers of people, points.

Each row of the table: a camera driver plays a sequence of 960 x 540 forth and back, and the results of the nodes are
counted for a while: the 3D chain with its visualization, or for 2d the service node in stream mode. The sequences
are made of the shipped one, or given by --folder. In 3D `target_rate` is the camera's rate unless it is given. Latency:
from the camera's stamp to the arrival of the message in a subscriber. T: one f32 pass of mobilenet_thin at 656 x 368 on
two threads, before and after the nodes run; latencies in T are by the mean of both. Start: to the first result. The
stages of `age` add up to the latency. --points cloud_to_depth: a nodelet makes depth images of clouds. --virtual: the
chain alone, in virtual time, see virtual.py.

    ./run bench live 3d                                       # all rates, numbers of people and points
    ./run bench live 3d --rates 30 --people 2 --points depth_image --seconds 30 mode:=balanced
    ./run bench live 2d --people 1 2 5 8 --rates 30 target_rate:=30
    ./run bench live --virtual SEQUENCE ... --rates 15 30 --slow 1 2 4
"""
import argparse
import itertools
import sys
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray

import nodes
import virtual
from common import Parser, markdown, run_command, run_live
from crowd import make_crowd
from results.machine import Unit
from session import ResultWatch, Session
from skeleton_extract_3d.ros.extractor import AGE_STAGES

PEOPLE_2D = '/openpose_ros/detected_poses'
SERVICE = '/openpose_ros_service_node'
EXTRACTOR = '/skeleton_extract_3d_node'
TOTALS = ('total', 'age')  # sums of stages
STAGES_2D = ('wait', 'decode_message', 'detection', 'publish')
MADE_DEPTH = f'{nodes.NAMESPACE}/depth_registered'
# Points for the chain: arguments of people.launch.
POINTS = {'depth_image': [f'depth:={nodes.NAMESPACE}/image_depth_rect'], 'point_cloud': [],
          'cloud_to_depth': [f'depth:={MADE_DEPTH}/image_rect']}


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('chain', choices=('2d', '3d'))
    parser.add_argument('--rates', type=float, nargs='+', default=[10.0, 15.0, 30.0], help='of the camera [Hz]')
    parser.add_argument('--people', type=int, nargs='+', default=[1, 2, 5, 8], choices=range(1, 9), metavar='1..8')
    parser.add_argument('--points', nargs='+', choices=POINTS, default=['depth_image', 'point_cloud'])
    parser.add_argument('--folder', type=Path, nargs='+', help='sequence folders to play instead of --people')
    parser.add_live(seconds=15.0, warm_up=5.0)
    return parser.parse_live()


def measure_row(session: Session, bag: Path, rate: float, points: str, arguments: argparse.Namespace) -> nodes.Watched:
    """Run the nodes before a camera; `points` is one of POINTS, '-' in 2D."""
    children = [nodes.start_camera(session, bag, rate)]
    if points == 'cloud_to_depth':
        children.append(session.start('cloud_to_depth', [
            'roslaunch', 'openpose_ros_bringup', 'nodelets.launch', 'cloud_to_depth:=true', 'manager:=/camera']))
    if points == '-':
        seen = nodes.watch_nodes(session, [
            'rosrun', 'openpose_ros_pkg', 'openpose_ros_node', f'__name:={SERVICE[1:]}',
            f'_image_topic:={nodes.NAMESPACE}/image_color',
            *(f'_{text}' for text in ['target_rate:=0', *arguments.launch])],
            ResultWatch(PEOPLE_2D, PersonDetectionArray), arguments, f'{SERVICE}/timing')
    else:
        seen = nodes.watch_nodes(session, [
            'roslaunch', 'openpose_ros_bringup', 'people.launch', 'signals:=false', f'target_rate:={rate}',
            *POINTS[points], *arguments.launch], ResultWatch(nodes.PEOPLE_3D, PersonDetection_3dArray), arguments,
            f'{EXTRACTOR}/timing')
    for child in reversed(children):
        session.stop(child)
    return seen


def figures_of(seen: nodes.Watched, stages: Sequence[str], unit: float) -> Dict[str, object]:
    """Return the cells of the nodes in a row; `stages` add up to the latency, `unit` is T [ms]."""
    means = {name: value for name, value in seen.stages.items() if np.isfinite(value) and name not in TOTALS}
    return {'results [Hz]': round(len(seen.arrivals) / seen.seconds, 1),
            'latency median / 95 % [ms]': nodes.median_and_95(seen.latencies),
            'in T': ' / '.join(f'{value:.2f}' for value in 1e3 * np.percentile(seen.latencies, (50, 95)) / unit),
            'sum of the stages': round(sum(means.get(name, 0.0) for name in stages)),
            'stages, means [ms]': ', '.join(f'{name} {value:.1f}' for name, value in means.items()),
            'frames with 0, 1, ... people': ', '.join(map(str, np.bincount(seen.people))),
            'processor [% of a core]': nodes.by_node(seen.processor), 'memory [MB]': nodes.by_node(seen.memory),
            'start [s]': round(seen.start, 1)}


def measure_all(session: Session, folder: Path, arguments: argparse.Namespace
                ) -> List[Tuple[Dict[str, object], nodes.Watched]]:
    """Measure all rows and print each; return their cells and what was seen."""
    rospy.init_node('live', disable_signals=True)
    unit, measured = Unit(), []
    stages, all_points = (STAGES_2D, ['-']) if arguments.chain == '2d' else (AGE_STAGES, arguments.points)
    sequences = {path.name: path for path in arguments.folder or ()} or {
        people: make_crowd(folder / f'crowd_{people}', people) for people in arguments.people}
    for points, rate, (people, sequence) in itertools.product(all_points, arguments.rates, sequences.items()):
        before = unit.milliseconds()
        seen = measure_row(session, nodes.make_bag(sequence, folder / 'camera.bag'), rate, points, arguments)
        after = unit.milliseconds()
        row = {'camera [Hz]': rate, 'people': people, 'points': points, 'T [ms]': f'{before:.0f} - {after:.0f}',
               **figures_of(seen, stages, (before + after) / 2)}
        measured.append((row, seen))
        log = (folder / 'nodes.log').read_text(errors='replace').splitlines()
        print(' | '.join(map(str, row.values())),
              *(line for line in log if 'networks may take' in line or 'WARN' in line), sep='\n', flush=True)
    return measured


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> List[str]:
    """Measure all rows and print the table."""
    rows = [row for row, _ in measure_all(session, folder, arguments)]
    print('\n' + markdown([[*rows[0]], *(row.values() for row in rows)]), flush=True)
    return []


if __name__ == '__main__':
    if '--virtual' in sys.argv:
        sys.argv.remove('--virtual')
        sys.exit(run_command('bench', virtual.main))
    sys.exit(run_live(measure, parse_arguments()))
