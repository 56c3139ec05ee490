#!/usr/bin/python3
"""Show the whole chain at work and keep what it publishes.

Plays the shipped RGB-D sequence (or a bag, a folder of pictures, a camera) through detection, lifting and markers, by
roslaunch, on a ROS master of its own. Leaves in the output folder: keypoints_2d.csv and keypoints_3d.csv as
`rostopic echo -p` writes them, output.bag, annotated.mp4 and rviz.png.
"""
import argparse
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Dict, List, Optional

import rosgraph
import rospy
from annotated_video import write_annotated_video
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from screen import RVIZ_SIZE, HeadlessScreen, take_picture

NAMESPACE = {'2d': '/openpose_ros', '3d': '/openpose_ros/skeleton_3d'}
OUTPUTS = ('keypoints_2d.csv', 'keypoints_3d.csv', 'output.bag', 'annotated.mp4', 'rviz.png')
START_TIMEOUT = 90.0
"""Time for the network to load and the first result to come [s]."""
RVIZ_SECONDS = 15.0
"""Time that RViz gets to open and draw before its picture is taken [s]."""


class DemoError(Exception):
    """The demo can not go on; the text says why."""


class Processes:
    """The demo's child processes; all are ended, in reverse order, on leaving."""

    def __init__(self, log_folder: Path) -> None:
        self._log_folder = log_folder
        self._children: List[subprocess.Popen] = []

    def __enter__(self) -> 'Processes':
        return self

    def __exit__(self, *_: object) -> None:
        for child in reversed(self._children):
            self.stop(child)

    def start(self, name: str, command: List[str], stdout: Optional[Path] = None) -> subprocess.Popen:
        """Start a command in a process group of its own; what it says goes to <name>.log, its output to `stdout`."""
        with ExitStack() as files:
            log = files.enter_context((self._log_folder / f'{name}.log').open('w'))
            out = files.enter_context(stdout.open('w')) if stdout else log
            child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=log, start_new_session=True)
        self._children.append(child)
        return child

    def stop(self, child: subprocess.Popen) -> None:
        """Interrupt a child as Ctrl-C would and wait for it; kill what does not listen."""
        for sign, patience in ((signal.SIGINT, 20.0), (signal.SIGTERM, 5.0), (signal.SIGKILL, 5.0)):
            if child.poll() is not None:
                break
            os.killpg(child.pid, sign)
            try:
                child.wait(patience)
            except subprocess.TimeoutExpired:
                continue
        if child in self._children:
            self._children.remove(child)


class LiveRate:
    """Counts the results as they come."""

    def __init__(self, dimension: str) -> None:
        kind = PersonDetection_3dArray if dimension == '3d' else PersonDetectionArray
        topic = NAMESPACE[dimension] + ('/detected_poses_3d' if dimension == '3d' else '/detected_poses')
        self.frames = 0
        self.with_people = 0
        self.persons = 0
        self.first = self.last = 0.0
        self._ages: List[float] = []
        rospy.Subscriber(topic, kind, self._count, queue_size=10)

    def _count(self, message: object) -> None:
        self.last = time.monotonic()
        self.first = self.first or self.last
        self.frames += 1
        self.with_people += bool(message.persons)
        self.persons = len(message.persons)
        self._ages.append((rospy.get_rostime() - message.header.stamp).to_sec())

    @property
    def rate(self) -> float:
        """Results per second since the first one."""
        return (self.frames - 1) / (self.last - self.first) if self.frames > 1 else 0.0

    @property
    def age(self) -> float:
        """Median time from the camera's stamp to the result [s]."""
        return sorted(self._ages)[len(self._ages) // 2] if self._ages else float('nan')

    def line(self) -> str:
        """Return what is known in one line."""
        return (f'{self.frames:5d} frames  {self.rate:5.1f} Hz  {self.persons} people  '
                f'median age {1000 * self.age:4.0f} ms')


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog='./run demo', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group()
    source.add_argument('--bag', type=Path, metavar='FILE', help='play this bag (with --image and --points)')
    source.add_argument('--images', type=Path, metavar='DIR',
                        help='a folder of pictures (2D), or an RGB-D sequence: rgb/, depth/ and camera.yaml (3D)')
    source.add_argument('--camera', metavar='N', help='a webcam, by its device number (2D)')
    parser.add_argument('--image', metavar='T', default='/kinect2/qhd/image_color', help='image topic of the bag')
    parser.add_argument('--points', metavar='T', default='/kinect2/qhd/points', help='organized cloud topic of the bag')
    parser.add_argument('--depth', metavar='T', help='aligned depth topic of the bag, instead of --points')
    parser.add_argument('--camera-info', metavar='T', default='/kinect2/qhd/camera_info',
                        help='camera info topic of the bag, with --depth')
    parser.add_argument('--compressed', action='store_true', help='the bag holds T/compressed instead of T')
    parser.add_argument('--rviz', action='store_true', help='open the RViz window')
    parser.add_argument('--no-rviz', action='store_true', help='make no picture of RViz')
    parser.add_argument('--seconds', type=float, default=20.0, help='how long to record (default %(default)s)')
    parser.add_argument('--output', type=Path, default=Path('demo_output'), help='output folder (default %(default)s)')
    arguments = parser.parse_args()
    for path in (arguments.bag, arguments.images):
        if path is not None and not path.exists():
            parser.error(f'{path} does not exist')
    return arguments


def is_rgbd_folder(folder: Path) -> bool:
    """Say whether a folder holds depth beside colour."""
    return (folder / 'depth').is_dir()


def launch_command(arguments: argparse.Namespace) -> List[str]:
    """Return the roslaunch command that starts the chain for the chosen source."""
    if arguments.camera is not None or (arguments.images and not is_rgbd_folder(arguments.images)):
        source = arguments.camera if arguments.camera is not None else str(arguments.images.resolve())
        return ['roslaunch', 'openpose_ros_pkg', 'demo_2d.launch', f'source:={source}']
    command = ['roslaunch', 'skeleton_extract_3d', 'demo.launch', f'rviz:={str(arguments.rviz).lower()}']
    if arguments.bag:
        command += ['play:=false', f'image:={arguments.image}', f'points:={arguments.points}']
        if arguments.depth:
            command += ['points_source:=depth_image', f'depth:={arguments.depth}',
                        f'camera_info:={arguments.camera_info}']
        if arguments.compressed:
            command += ['image_transport:=compressed']
        command += [f'camera_frame:={bag_frame(arguments)}']
    elif arguments.images:
        command += [f'folder:={arguments.images.resolve()}']
    return command


def bag_frame(arguments: argparse.Namespace) -> str:
    """Return the frame_id of the points in the bag."""
    import rosbag
    topic = arguments.depth or arguments.points
    with rosbag.Bag(str(arguments.bag)) as bag:
        for _, message, _ in bag.read_messages(topics=[topic]):
            return message.header.frame_id
        topics = ', '.join(sorted(bag.get_type_and_topic_info().topics))
    raise DemoError(f'{arguments.bag} has no messages on {topic}; its topics: {topics}')


def private_master_environment(ros_home: Path) -> Dict[str, str]:
    """Return variables for a ROS master of the demo's own, on a free port."""
    with socket.socket() as probe:
        probe.bind(('localhost', 0))
        port = probe.getsockname()[1]
    return {'ROS_MASTER_URI': f'http://localhost:{port}', 'ROS_HOSTNAME': 'localhost', 'ROS_HOME': str(ros_home),
            'ROS_LOG_DIR': str(ros_home / 'log')}


def wait_for(condition, timeout: float, what: str, watched: subprocess.Popen) -> None:
    """Wait until condition() holds.

    Raises:
        DemoError: it did not within the timeout [s], or the watched process ended.
    """
    deadline = time.monotonic() + timeout
    while not condition():
        if watched.poll() is not None:
            raise DemoError(f'the nodes ended before {what}')
        if time.monotonic() > deadline:
            raise DemoError(f'no {what} within {timeout:.0f} s')
        time.sleep(0.05)


def show_rate(rate: LiveRate, seconds: float, source: Optional[subprocess.Popen]) -> None:
    """Print the live rate until the time is over or the source has ended."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and (source is None or source.poll() is None):
        time.sleep(1.0)
        print('  ' + rate.line(), flush=True)


def record(arguments: argparse.Namespace, processes: Processes, output: Path, dimension: str) -> List[subprocess.Popen]:
    """Start the recorders: CSV by rostopic echo -p, and a bag of the outputs."""
    space = NAMESPACE[dimension]
    recorders = [processes.start('rostopic_2d', ['rostopic', 'echo', '-p', f'{space}/detected_poses_keypoints'],
                                 output / 'keypoints_2d.csv')]
    topics = ['detected_poses', 'detected_poses_keypoints', 'detected_poses_image']
    if dimension == '3d':
        recorders.append(processes.start(
            'rostopic_3d', ['rostopic', 'echo', '-p', f'{space}/detected_poses_keypoints_3d'],
            output / 'keypoints_3d.csv'))
        topics += ['detected_poses_3d', 'detected_poses_keypoints_3d', 'visualization_markers',
                   'visualization_skeleton']
    recorders.append(processes.start('rosbag', [
        'rosbag', 'record', '--lz4', '-O', str(output / 'output.bag'), *(f'{space}/{topic}' for topic in topics),
        '/tf', '/tf_static']))
    return recorders


def picture_of_rviz(processes: Processes, picture: Path, screen: HeadlessScreen) -> None:
    """Open RViz on a screen of its own while the chain runs, and take its picture."""
    print('[demo] picture of RViz, on a screen in memory ...', flush=True)
    import rospkg
    config = Path(rospkg.RosPack().get_path('skeleton_extract_3d')) / 'rviz' / 'skeleton_extract_3d.rviz'
    os.environ.update(screen.environment())
    rviz = processes.start('rviz', ['rosrun', 'rviz', 'rviz', '-d', str(config), '-f', 'world'])
    time.sleep(RVIZ_SECONDS)
    take_picture(picture)
    processes.stop(rviz)


def run(arguments: argparse.Namespace, output: Path) -> LiveRate:
    """Start everything, record, and stop everything again."""
    command = launch_command(arguments)
    dimension = '2d' if 'demo_2d.launch' in command else '3d'
    ros_home = Path(tempfile.mkdtemp(prefix='openpose_ros_demo_'))
    log_folder = output / 'log'
    log_folder.mkdir(exist_ok=True)
    os.environ.update(private_master_environment(ros_home))
    with ExitStack() as stack:
        stack.callback(shutil.rmtree, ros_home, ignore_errors=True)
        screen = None
        if dimension == '3d' and not (arguments.rviz or arguments.no_rviz):
            screen = stack.enter_context(HeadlessScreen(*RVIZ_SIZE))
        processes = stack.enter_context(Processes(log_folder))
        port = os.environ['ROS_MASTER_URI'].rsplit(':', 1)[1]
        master = processes.start('roscore', ['roscore', '-p', port])
        wait_for(rosgraph.is_master_online, START_TIMEOUT, 'ROS master', master)
        if arguments.bag:
            subprocess.run(['rosparam', 'set', '/use_sim_time', 'true'], check=True)
        recorders = record(arguments, processes, output, dimension)
        print(f"[demo] {' '.join(command)}", flush=True)
        nodes = processes.start('nodes', command)
        rospy.init_node('demo', anonymous=True, disable_signals=True)
        rate = LiveRate(dimension)
        player = None
        if arguments.bag:
            rospy.wait_for_service('detect_poses_3d', START_TIMEOUT)
            player = processes.start('rosbag_play', ['rosbag', 'play', '--clock', '-d', '2', str(arguments.bag)])
        print('[demo] loading the network ...', flush=True)
        wait_for(lambda: rate.frames > 0, START_TIMEOUT, 'first result', nodes)
        show_rate(rate, arguments.seconds, player)
        for recorder in recorders:
            processes.stop(recorder)
        if screen is not None:
            if player is not None:
                player = processes.start('rosbag_play_again', ['rosbag', 'play', '--clock', '-l', str(arguments.bag)])
            picture_of_rviz(processes, output / 'rviz.png', screen)
        if arguments.rviz:
            input('[demo] RViz stays open; press Enter to end ')
    return rate


def main() -> int:
    """Run the demo; return the exit status."""
    arguments = parse_arguments()
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    for name in OUTPUTS:
        with suppress(FileNotFoundError):
            (output / name).unlink()
    try:
        rate = run(arguments, output)
        write_annotated_video(output / 'output.bag', output / 'annotated.mp4')
    except (DemoError, rospy.ROSException) as error:
        print(f'[demo] failed: {error}; see {output}/log/nodes.log', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    print(f'[demo] {rate.line().strip()}; people in {rate.with_people} of {rate.frames} frames')
    for path in (output / name for name in OUTPUTS):
        if path.is_file():
            print(f'[demo] {path}  {path.stat().st_size / 1e3:.0f} kB')
    if rate.with_people == 0:
        print('[demo] nobody was found in any frame', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
