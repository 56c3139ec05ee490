"""Records what process_bag needs of a camera: images, depth images or clouds, calibration and tf.

All other arguments are those of rosbag record, such as -O FILE, --split or --lz4. The folder is made.
"""
import argparse
import os
import sys
from pathlib import Path
from typing import List

from openpose_ros_pkg.command_options import command_parser
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.camera_presets import AUTO

_ALWAYS = ('/tf', '/tf_static')


def main() -> int:
    """Become rosbag record; return 1 where it can not start."""
    options, of_rosbag = _parser().parse_known_args()
    import roslib.packages
    import rospy

    option, value = ('-O', options.output_name) if options.output_name else ('-o', options.output_prefix)
    output = Path(value).expanduser()
    try:
        topics = options.topics.split() or [*_topics_of_camera(options), *_ALWAYS]
        output.parent.mkdir(parents=True, exist_ok=True)
    except (OSError, ParameterError, rospy.ROSInterruptException) as error:
        sys.stderr.write(f'record_camera: {error}\n')
        return 1
    command = [*roslib.packages.find_node('rosbag', 'record')[:1], *of_rosbag, *topics]
    os.execv(command[0], [*command, option, str(output)] if value else command)


def _topics_of_camera(options: argparse.Namespace) -> List[str]:
    import rospy

    from openpose_ros_pkg.ros.cameras import find_camera

    name = options.camera or AUTO
    namespaces = options.cameras.split() or [options.ns]
    if name == AUTO:
        rospy.init_node('record_camera', anonymous=True, argv=[])  # while it waits for the camera
    camera = find_camera(name, namespaces[0], options.dimensions if name == AUTO else 2)
    if name == AUTO:
        rospy.signal_shutdown('rosbag takes over')
    return [topic for ns in (namespaces if options.cameras else [camera.ns])
            for topic in camera.preset.recorded(ns, options.dimensions, options.compressed)]


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('record_camera', __doc__, allow_abbrev=False)
    parser.add_argument('--camera', default='', help='name of cameras.yaml, or a YAML file with one camera; auto or '
                                                     'empty: the one that is published')
    parser.add_argument('--ns', default='', help="namespace of the topics; empty: the preset's")
    parser.add_argument('--cameras', default='', help='namespaces of several cameras of this kind, separated by spaces')
    parser.add_argument('--dimensions', type=int, choices=(2, 3), default=3, help='with auto: 2: images without depth')
    parser.add_argument('--compressed', action='store_true', help='JPEG and PNG, as image_transport publishes them')
    parser.add_argument('--topics', default='', help='these, separated by spaces, in place of those of a camera')
    parser.add_argument('-o', '--output-prefix', default='', help='of the bags, with their folder')
    parser.add_argument('-O', '--output-name', default='', help='of the bag')
    return parser
