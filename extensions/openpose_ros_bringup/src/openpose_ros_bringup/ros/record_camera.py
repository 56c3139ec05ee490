"""Records what process_bag needs of a camera: images, depth images or clouds, calibration and tf.

All other arguments are those of rosbag record, such as -O FILE, --split or --lz4. The folder is made. The node
NAME_watch says on /diagnostics whether bags are written; in a launch file, a recorder that has ended starts again.
"""
import argparse
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import List

import roslib.packages
import rospy
from diagnostic_msgs.msg import DiagnosticStatus

from openpose_ros_pkg.command_options import command_parser
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.camera_presets import AUTO
from openpose_ros_pkg.ros.cameras import find_camera
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.node import RESPAWNS

RECORDS = 'records into'  # key of /diagnostics: folder of the bags
_ALWAYS = ('/tf', '/tf_static')
# rosbag record writes nothing while less is free, and says so once [bytes]; times in [s].
_LEAST_SPACE = 2 ** 30
_PAUSE, _PERIOD = 5.0, 0.2


def main() -> int:
    """Run rosbag record and watch it; return its exit status."""
    options, of_rosbag = _parser().parse_known_args()
    own = dict(word.split(':=', 1) for word in of_rosbag if word.startswith('__') and ':=' in word)
    name = own.pop('__name', 'record_camera')
    rospy.init_node(f'{name}_watch', argv=[f'{key}:={value}' for key, value in own.items()])
    try:
        topics = options.topics.split() or [*_topics_of_camera(options), *_ALWAYS]
    except (ParameterError, rospy.ROSInterruptException) as error:
        sys.stderr.write(f'record_camera: {error}\n')
        return 1
    option, value = ('-O', options.output_name) if options.output_name else ('-o', options.output_prefix)
    output = Path(value).expanduser()
    command = [*roslib.packages.find_node('rosbag', 'record')[:1], *of_rosbag, f'__name:={name}', *topics]
    return _Recorder([*command, option, str(output)] if value else command, output.parent).run()


class _Recorder:
    def __init__(self, command: List[str], folder: Path) -> None:
        self._command, self._folder, self._fault = command, folder, ''
        health = Health()
        health.explain_rest(lambda: f'{RECORDS} {folder}')
        health.show(lambda: {RECORDS: str(folder)})
        health.show_lasting(self._find_fault, DiagnosticStatus.ERROR)

    def run(self) -> int:
        """Record until the end, again and again in a launch file."""
        while True:
            status = self._record()
            if rospy.is_shutdown() or status == 0 or not os.environ.get(RESPAWNS):
                return status
            rospy.logerr('%s; it starts again', self._fault)
            end = time.monotonic() + _PAUSE
            while time.monotonic() < end and not rospy.is_shutdown():
                time.sleep(_PERIOD)

    def _record(self) -> int:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            child = subprocess.Popen(self._command)
        except OSError as error:
            self._fault = f'rosbag record can not start: {error}'
            return 1
        begin = time.monotonic()
        while child.poll() is None and not rospy.is_shutdown():
            if time.monotonic() - begin > _PAUSE:
                self._fault = ''
            time.sleep(_PERIOD)
        if child.poll() is None:
            child.send_signal(signal.SIGINT)
        self._fault = f'rosbag record has ended with status {child.wait()}: see its log'
        return child.returncode

    def _find_fault(self) -> str:
        if self._folder.is_dir() and shutil.disk_usage(self._folder).free < _LEAST_SPACE:
            return f'less than 1 GB is free in {self._folder}: rosbag record writes nothing'
        return self._fault


def _topics_of_camera(options: argparse.Namespace) -> List[str]:
    name = options.camera or AUTO
    namespaces = options.cameras.split() or [options.ns]
    camera = find_camera(name, namespaces[0], options.dimensions if name == AUTO else 2)
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
