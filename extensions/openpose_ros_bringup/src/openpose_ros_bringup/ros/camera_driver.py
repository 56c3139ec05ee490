"""Starts the driver of a camera with the arguments that give registered depth, or says which line does."""
import argparse
import os
import sys
from pathlib import Path

import rospkg

from openpose_ros_pkg.command_options import command_parser
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.camera_presets import AUTO, find_preset, read_presets

# The preset whose driver has a substitute here.
_WEBCAM = 'usb_cam'


def main() -> int:
    """Become the driver, if it is installed; else say how to start it, and rest until the end."""
    # names of roslaunch; all others with := are arguments of the driver
    own = [word for word in sys.argv[1:] if word.startswith('__')]
    options = _parser().parse_args([word for word in sys.argv[1:] if word not in own])
    if options.camera in ('', AUTO):
        names = ', '.join(name for name, preset in read_presets().items() if preset.package)
        return _rest(f'to start a driver, name the camera: camera:=NAME, one of {names}')
    try:
        preset = find_preset(options.camera)
        if not preset.package:
            return _rest(f'{preset.name} has no driver that could be started')
        command = preset.driver_command('', options.words)
        if not is_installed(preset.package):
            if preset.name != _WEBCAM:
                return _rest(f'the package {preset.package} is not installed here; where it is, start the driver: '
                             f'{" ".join(command)}')
            import roslib.packages

            command = [*roslib.packages.find_node('openpose_ros_pkg', 'camera_node')[:1], '__name:=camera_node',
                       f"__ns:={preset.topic('image').rpartition('/')[0]}", f'--source={options.source or 0}', '--loop',
                       f'--frame_id={preset.frame}']
    except ParameterError as error:
        return _rest(str(error))
    sys.stdout.write(f'camera_driver: {" ".join(command)}\n')
    sys.stdout.flush()
    os.environ.pop('ROS_NAMESPACE', None)  # that of the chain
    os.execvp(command[0], command)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('camera_driver', __doc__)
    parser.add_argument('--camera', default='', help='name of cameras.yaml, or a YAML file with one camera')
    parser.add_argument('--source', default='', help='webcam number, video or folder, without the package usb_cam')
    parser.add_argument('words', nargs='*', metavar='NAME:=VALUE | FILE.launch',
                        help="arguments of the driver, and another launch file of its package")
    return parser


def is_installed(package: str) -> bool:
    try:
        return bool(package) and Path(rospkg.RosPack().get_path(package)).is_dir()
    except rospkg.ResourceNotFound:
        return False


def _rest(text: str) -> int:
    """Say it, also on /rosout; where roslaunch would start the program again and again, wait for the end."""
    import rospy

    from openpose_ros_pkg.ros.node import RESPAWNS

    rospy.init_node('camera_driver')
    rospy.logwarn('%s', text)
    if RESPAWNS in os.environ:
        rospy.spin()
    return 1
