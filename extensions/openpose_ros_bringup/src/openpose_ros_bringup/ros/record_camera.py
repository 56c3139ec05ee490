"""Records what process_bag needs of a camera: images, depth images or clouds, calibration and tf.

All other arguments are those of rosbag record, such as -O FILE, --split or --lz4.
"""
import argparse
import os
import sys

import rospy

from openpose_ros_pkg.command_options import command_parser
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.camera_presets import AUTO
from openpose_ros_pkg.ros.cameras import find_camera

_ALWAYS = ('/tf', '/tf_static')


def main() -> int:
    """Become rosbag record."""
    options, of_rosbag = _parser().parse_known_args()
    name = options.camera or AUTO
    if name == AUTO:
        rospy.init_node('record_camera', argv=[word for word in of_rosbag if word.startswith('__')])
    namespaces = options.cameras.split() or [options.ns]
    try:
        camera = find_camera(name, namespaces[0], options.dimensions if name == AUTO else 2)
    except ParameterError as error:
        sys.stderr.write(f'record_camera: {error}\n')
        return 1
    except rospy.ROSInterruptException:
        return 1
    if name == AUTO:
        rospy.signal_shutdown('rosbag record goes on')
    topics = [topic for ns in (namespaces if options.cameras else [camera.ns])
              for topic in camera.preset.recorded(ns, options.dimensions, options.compressed)]
    command = ['rosbag', 'record', *of_rosbag, *topics, *_ALWAYS]
    sys.stdout.write(f'record_camera: {" ".join(command)}\n')
    sys.stdout.flush()
    os.execvp(command[0], command)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('record_camera', __doc__, allow_abbrev=False)
    parser.add_argument('--camera', default='', help='name of cameras.yaml, or a YAML file with one camera; auto or '
                                                     'empty: the one that is published')
    parser.add_argument('--ns', default='', help="namespace of the topics; empty: the preset's")
    parser.add_argument('--cameras', default='', help='namespaces of several cameras of this kind, separated by spaces')
    parser.add_argument('--dimensions', type=int, choices=(2, 3), default=3, help='with auto: 2: images without depth')
    parser.add_argument('--compressed', action='store_true', help='JPEG and PNG, as image_transport publishes them')
    return parser
