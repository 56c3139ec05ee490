#!/usr/bin/python3
"""Measure the whole 3D chain live: rate, latency of the results, processor and memory of each node.

Starts rgbd_player (in place of a camera), the detection service, the extractor and the visualization by roslaunch on a
ROS master of its own, and counts the results for a while. Latency: from the camera's stamp to the arrival of the 3D
message in a subscriber. Then all subscribers leave a few times, until the chain rests: first_result is the time
from the next subscription to the first result.

With --camera, a driver in C++ takes the place of rgbd_player: a nodelet manager that plays the same sequence. Its
points reach the extractor as cloud, as depth image, or as the depth image that cloud_to_depth makes of the cloud in
the driver's process.
"""
import argparse
import subprocess
import sys
import time
import xmlrpc.client
from pathlib import Path
from typing import Dict, List

import numpy as np
import psutil
import rosnode
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray

from common import DEMO, Figures, Parser, Usage, run_live
from live_points import start_camera, start_cloud_to_depth
from openpose_ros_pkg.ros.session import ResultWatch, Session, wait_for

TOPIC = '/openpose_ros/skeleton_3d/detected_poses_3d'
START_TIMEOUT = 90.0
# How often the chain rests, and for how long: the nodes notice within a second that nobody listens.
RESTS, REST_SECONDS = 10, 3.0
MADE_DEPTH = '/kinect2/qhd/depth_registered'
# How points leave the driver: arguments of demo.launch.
CAMERAS = {'cloud': [], 'depth': ['points_source:=depth_image'],
           'cloud_to_depth': ['points_source:=depth_image', f'depth:={MADE_DEPTH}/image_rect',
                              f'camera_info:={MADE_DEPTH}/camera_info']}


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--seconds', type=float, default=60.0, help='how long to measure (default %(default)s)')
    parser.add_argument('--rate', type=float, default=15.0, help='frames per second (default %(default)s)')
    parser.add_argument('--folder', type=Path, help='sequence folder to play (default: the shipped one)')
    parser.add_argument('--camera', choices=CAMERAS, help='a driver in C++, and how its points reach the extractor')
    parser.add_argument('--warm-up', type=float, default=5.0, help='not measured at first [s] (default %(default)s)')
    parser.add_argument('--json', type=Path, help='write the figures here')
    parser.add_argument('launch_arguments', nargs='*', metavar='NAME:=VALUE', help='passed on to demo.launch')
    return parser.parse_args()


def node_processes() -> Dict[str, psutil.Process]:
    """Return the process of each node of the chain."""
    processes = {}
    for name in rosnode.get_node_names():
        if name not in ('/rosout', rospy.get_name()):
            node = xmlrpc.client.ServerProxy(rospy.get_master().lookupNode(name)[2])
            processes[name] = psutil.Process(node.getPid(rospy.get_name())[2])
    return processes


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


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> Figures:
    """Run the chain and return the figures."""
    command = ['roslaunch', 'skeleton_extract_3d', 'demo.launch', f'rate:={arguments.rate}',
               *arguments.launch_arguments]
    if arguments.camera:
        start_camera(session, folder, arguments.folder or DEMO, arguments.rate)
        if arguments.camera == 'cloud_to_depth':
            start_cloud_to_depth(session)
        # with the height given nobody else reads the points
        command += ['play:=false', 'camera_height:=1.35', *CAMERAS[arguments.camera]]
    elif arguments.folder:
        command.append(f'folder:={arguments.folder.resolve()}')
    nodes = session.start('nodes', command)
    rospy.init_node('live_3d', disable_signals=True)
    results = ResultWatch(TOPIC, PersonDetection_3dArray)
    wait_for(lambda: len(results.arrivals) > 0, START_TIMEOUT, 'first result', nodes)
    time.sleep(arguments.warm_up)
    first = len(results.arrivals)
    usage = Usage(node_processes())
    time.sleep(arguments.seconds)
    cpu, memory = usage.processor(), usage.memory()
    results.stop()
    waits = first_results(nodes)
    latencies, arrivals = np.array(results.latencies[first:]), np.array(results.arrivals[first:])
    log = (folder / 'nodes.log').read_text(errors='replace').splitlines()
    return {'log': [line for line in log if 'the networks may take' in line or 'WARN' in line],
            'frames': len(latencies), 'rate_hz': (len(latencies) - 1) / (arrivals[-1] - arrivals[0]),
            'age_ms': {name: 1000 * float(np.percentile(latencies, share)) for name, share in
                       (('median', 50), ('p95', 95), ('max', 100))},
            'first_result_ms': {'median': float(np.median(waits)), 'max': max(waits)},
            'age_median_by_fifth_ms': [1000 * float(np.median(part)) for part in np.array_split(latencies, 5)],
            'longest_gap_ms': 1000 * float(np.diff(arrivals).max()),
            'people_per_frame': {str(number): results.people[first:].count(number)
                                 for number in sorted(set(results.people[first:]))},
            'cpu_percent_of_a_core': cpu, 'memory_mb': memory}


def main() -> int:
    """Run the benchmark; return the exit status."""
    arguments = parse_arguments()
    return run_live(lambda session, folder: measure(session, folder, arguments), arguments.json)


if __name__ == '__main__':
    sys.exit(main())
