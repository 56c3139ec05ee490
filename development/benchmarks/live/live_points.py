#!/usr/bin/python3
"""Measure how points reach a node in Python: as cloud, as depth image, as depth image of cloud_to_depth.

A driver in C++, a nodelet manager, plays the shipped sequence. This process subscribes to one topic after the other,
again and again, so that all see the same load. Latency: from the camera's stamp, which is set when the driver
publishes, to the callback. Processor: of driver with nodelet and of this process, which does nothing but receive.
"""
import argparse
import sys
import time
from pathlib import Path
from typing import Dict, List

import numpy as np
import psutil
import rospy
from sensor_msgs.msg import Image, PointCloud2

from common import DEMO, Figures, Parser, Usage, new_path, run_live
from live.camera import NAMESPACE, make_bag, start_camera, start_cloud_to_depth
from session import Session, wait_for

PATHS = {'cloud': ('points', PointCloud2), 'depth image': ('image_depth_rect', Image),
         'cloud_to_depth': ('depth_registered/image_rect', Image)}
TIMEOUT = 90.0


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--rounds', type=int, default=5, help='how often each is measured (default %(default)s)')
    parser.add_argument('--seconds', type=float, default=3.0, help='of a measurement (default %(default)s)')
    parser.add_argument('--rate', type=float, default=15.0, help='frames per second (default %(default)s)')
    parser.add_argument('--folder', type=Path, default=DEMO, help='sequence folder (default: the shipped one)')
    parser.add_argument('--json', type=new_path, help='write the figures here')
    return parser.parse_args()


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> Figures:
    """Alternate the topics and return the figures."""
    camera = start_camera(session, make_bag(arguments.folder, folder / 'camera.bag'), arguments.rate)
    start_cloud_to_depth(session)
    rospy.init_node('live_points', disable_signals=True)
    processes = {'driver': psutil.Process(camera.pid), 'this process': psutil.Process()}
    latencies: Dict[str, List[float]] = {name: [] for name in PATHS}
    shares: Dict[str, List[Dict[str, float]]] = {name: [] for name in PATHS}
    for _ in range(arguments.rounds):
        for name, (topic, kind) in PATHS.items():
            new: List[float] = []
            subscriber = rospy.Subscriber(
                f'{NAMESPACE}/{topic}', kind, queue_size=1,
                callback=lambda message, new=new: new.append((rospy.get_rostime() - message.header.stamp).to_sec()))
            wait_for(lambda new=new: len(new) > 0, TIMEOUT, f'message of {topic}', camera)
            new.clear()
            usage = Usage(processes)
            time.sleep(arguments.seconds)
            shares[name].append(usage.processor())
            latencies[name] += new
            subscriber.unregister()
    return {name: {'messages': len(latencies[name]),
                   'latency_ms': {f'{share} %': 1e3 * float(np.percentile(latencies[name], share))
                                  for share in (5, 50, 95)},
                   'cpu_percent_of_a_core': {process: float(np.median([each[process] for each in shares[name]]))
                                             for process in processes}} for name in PATHS}


def main() -> int:
    """Run the benchmark; return the exit status."""
    arguments = parse_arguments()
    return run_live(lambda session, folder: measure(session, folder, arguments), arguments.json)


if __name__ == '__main__':
    sys.exit(main())
