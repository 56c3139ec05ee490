#!/usr/bin/python3
"""Measure the memory of the running service node while each image has another size.

Starts the service node on a ROS master of its own and sends it images one after the other, each with a width and a
height of its own (log-uniform between 16 and 2000 px, the same ones in every run) and an encoding of its own. Prints
the node's memory in the course of them, which belongs to nobody else (unique set size), and its threads.

    ./run bench image_sizes mode:=fast
    ./run bench image_sizes --images 500 backend:=opencv_dnn
"""
import argparse
import sys
from typing import Dict, List

import cv2
import numpy as np
import psutil
import rospy
from openpose_ros_msgs.srv import GetPersons
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from common import DEMO, Figures, Parser, run_live
from session import Session

NODE = 'openpose_ros_node'
SMALLEST, LARGEST = 16, 2000
CHANNELS = {'bgr8': 3, 'rgb8': 3, 'bgra8': 4, 'mono8': 1}
START_TIMEOUT = 180.0


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--images', type=int, default=3000, help='(default %(default)s)')
    parser.add_argument('--rows', type=int, default=20, help='of the table (default %(default)s)')
    return parser.parse_named('parameters')


def made_up(source: np.ndarray, number: int, random: np.random.RandomState) -> Image:
    """Return an image of a size and an encoding of its own."""
    width, height = np.exp(random.uniform(*np.log([SMALLEST, LARGEST]), 2)).astype(int)
    encoding = list(CHANNELS)[random.randint(len(CHANNELS))]
    pixels = np.resize(cv2.resize(source, (width, height)), (height, width, CHANNELS[encoding]))
    return Image(header=Header(stamp=rospy.Time(1 + number), frame_id='camera'), width=width, height=height,
                 encoding=encoding, step=pixels.strides[0], data=pixels.tobytes())


def measure(options: argparse.Namespace, session: Session) -> Figures:
    """Send all images; return the curve."""
    command = ['rosrun', 'openpose_ros_pkg', NODE, *(f'_{parameter}' for parameter in options.parameters)]
    node = psutil.Process(session.start('service', command).pid)
    rospy.init_node('image_sizes', disable_signals=True)
    rospy.wait_for_service('detect_poses', START_TIMEOUT)
    detect = rospy.ServiceProxy('detect_poses', GetPersons, persistent=True)
    node = next((child for child in node.children(recursive=True) if NODE in ' '.join(child.cmdline())), node)
    source = cv2.imread(str(min((DEMO / 'rgb').iterdir())))
    random, refused = np.random.RandomState(0), 0
    curve: Dict[int, List[float]] = {}
    for number in range(options.images + 1):
        if number % max(options.images // options.rows, 1) == 0:
            curve[number] = [node.memory_full_info().uss / 1e6, node.num_threads()]
            print(f'{number:6d} images {curve[number][0]:7.0f} MB {curve[number][1]:4.0f} threads', flush=True)
        try:
            detect(made_up(source, number, random))
        except rospy.ServiceException:
            refused += 1
    return {'images': options.images, 'refused': refused, 'parameters': options.parameters,
            'memory [MB] and threads after images': curve}


def main() -> int:
    """Run the benchmark."""
    options = parse_arguments()
    return run_live(lambda session, _: measure(options, session))


if __name__ == '__main__':
    sys.exit(main())
