#!/usr/bin/python3
"""Measure the floor that floor_node finds, on RGB-D sequences whose camera's place is known.

Starts the node on a ROS master of its own and sends it each cloud of the sequences, 960 x 540 points or what they have.
A sequence folder holds rgb/, depth/ (16-bit PNG [mm]) and either meta.json (K, width, height, fps, T_world_camera or,
for a moving camera, poses) or camera.yaml and sequence.yaml; in the world, z is up and the floor is z = 0. A plane is
published when it was seen twice, so that the first cloud has none. Parameters of the node are given as in floor.yaml.

    benchmarks/live/floor.py SEQUENCE [SEQUENCE ...]
    benchmarks/live/floor.py SEQUENCE --set smoothing_time=0 --set points=50000
"""
import sys
import time
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from pcl_msgs.msg import ModelCoefficients
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from accuracy_3d import open_sequence, true_floors
from common import Figures, Parser, markdown, new_path, run_live
from session import Session, wait_for
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.ros.convert import cloud_to_message

# A cloud without a plane in this time has none [s].
PATIENCE = 1.0
# Sequences are this far apart in time, so that the node forgets the floor of the one before [s].
APART = 1000.0


class Node(NamedTuple):
    """The running node: where its clouds go, the planes that came, how long it computed [ms]."""

    clouds: rospy.Publisher
    planes: Dict[rospy.Time, np.ndarray]
    milliseconds: List[float]


def start(session: Session, settings: Dict[str, Any]) -> Node:
    """Start the node with some parameters and connect to it."""
    child = session.start('floor', ['rosrun', 'openpose_ros_nodelets', 'floor_node', '_rate:=1000',
                                    *(f'_{key}:={value}' for key, value in settings.items())])
    rospy.init_node('measure_floor', disable_signals=True)
    node = Node(rospy.Publisher('points', PointCloud2, queue_size=1), {}, [])
    subscribers = [
        rospy.Subscriber('floor/plane', ModelCoefficients,
                         lambda plane: node.planes.update({plane.header.stamp: np.array(plane.values)})),
        rospy.Subscriber('/diagnostics', DiagnosticArray, lambda message: node.milliseconds.extend(
            float(pair.value) for status in message.status for pair in status.values
            if pair.key == 'computing [ms]' and node.planes))]
    wait_for(lambda: node.clouds.get_num_connections() > 0, 30.0, f'{len(subscribers)} connections', child)
    return node


def measure(node: Node, folder: Path, begin: float) -> List[object]:
    """Return the row of a sequence: greatest and mean errors, and the share of clouds with a plane."""
    sequence = open_sequence(folder)
    angles, heights = [], []
    truth = true_floors(folder, sequence)
    rays = sequence.camera.ray_grid()
    for frame, plane in zip(sequence, truth):
        stamp = rospy.Time.from_sec(begin + frame.time)
        cloud = cloud_from_depth(frame.depth * 0.001, sequence.camera, frame.bgr, rays)
        node.clouds.publish(cloud_to_message(cloud, Header(stamp=stamp, frame_id='camera')))
        deadline = time.monotonic() + PATIENCE
        while stamp not in node.planes and time.monotonic() < deadline:
            time.sleep(0.001)
        if stamp in node.planes:
            found = node.planes[stamp]
            angles.append(np.degrees(np.arctan2(np.linalg.norm(np.cross(found[:3], plane[:3])), found[:3] @ plane[:3])))
            heights.append(1e3 * (found[3] - plane[3]))
    name = '/'.join(folder.resolve().parts[-2:])
    if not angles:
        return [name, f'0/{len(truth)}', *4 * ['-']]
    return [name, f'{len(angles)}/{len(truth)}', f'{np.mean(angles):.2f}', f'{np.max(angles):.2f}',
            f'{np.mean(heights):.1f}', f'{np.abs(heights).max():.1f}']


def run(session: Session, folders: Sequence[Path], settings: Dict[str, Any]) -> Figures:
    """Return the figures of all sequences, and print their table."""
    node = start(session, settings)
    rows = [measure(node, folder, (number + 1) * APART) for number, folder in enumerate(folders)]
    sys.stdout.write(markdown([['sequence', 'planes', 'angle, mean [deg]', 'greatest', 'height, mean [mm]', 'greatest'],
                               *rows]))
    times = np.array(node.milliseconds)
    return {'computing per cloud [ms]': {'median': float(np.median(times)), 'least': float(times.min()),
                                         '90 %': float(np.percentile(times, 90)), 'samples': len(times)}}


def main() -> int:
    """Run the benchmark from the command line."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    parser.add_settings('of the node')
    parser.add_argument('--json', type=new_path, help='write the times here')
    arguments = parser.parse_args()
    settings = parser.settings(arguments.set)
    return run_live(lambda session, _: run(session, arguments.sequences, settings), arguments.json)


if __name__ == '__main__':
    sys.exit(main())
