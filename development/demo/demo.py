#!/usr/bin/python3
"""Show the whole chain at work and keep what it publishes.

Plays the shipped RGB-D sequence (or a bag, a folder of images, a camera) through detection, lifting and markers, by
roslaunch, on a ROS master of its own. Leaves in the output folder: keypoints_2d.csv and keypoints_3d.csv as
`rostopic echo -p` writes them, output.bag, annotated.mp4 and pictures of RViz. With --stage, sequences of several
cameras are played, and what is left is of the people that are fused from all of them: keypoints_3d.csv and output.bag.
A sequence is played once, then black, and so on; where its gt.json holds the true people, those found are counted, and
there are two pictures: rviz.png with both people in view, rviz_hidden.png with the rear one hidden.
With --web, people are shown in browsers until Ctrl-C, and nothing is kept.
"""
import argparse
import json
import os
import socket
import subprocess
import sys
import time
import urllib.request
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Dict, List, Optional, Tuple

sys.path.append(str(Path(__file__).resolve().parents[2] / 'tests/support'))
import numpy as np
import rosbag
import rosparam
import rospy
import stage
from annotated_video import write_annotated_video
from found_people import Output, count_found
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from picture import FRAMES, Viewer, best_pass, both_in_view, choose, errors_of, recorded, transforms_of
from screen import RVIZ_SIZE, HeadlessScreen
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.command_line import INTERRUPTED, all_ends_are_interrupts
from openpose_ros_pkg.command_options import number
from openpose_ros_pkg.errors import OpenposeRosError
from session import ResultWatch, Session, SessionError, wait_for
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence
from skeleton_extract_3d.ros import convert

NAMESPACE = {'2d': '/openpose_ros', '3d': '/openpose_ros/skeleton_3d', 'stage': '/people/openpose_ros/skeleton_3d'}
RESULTS = {'2d': (NAMESPACE['2d'] + '/detected_poses', PersonDetectionArray),
           '3d': (NAMESPACE['3d'] + '/detected_poses_3d', PersonDetection_3dArray),
           'stage': (NAMESPACE['stage'] + '/detected_poses_3d', PersonDetection_3dArray)}
ROOT = Path(__file__).resolve().parents[2]
SHIPPED, OWN_FOLDER = ROOT / 'skeleton_extract_3d/demo/cross', ROOT / 'demo_output'
OUTPUTS = ('keypoints_2d.csv', 'keypoints_3d.csv', 'output.bag', 'annotated.mp4', 'rviz.png', 'rviz_hidden.png')
# Time for the network to load and the first result to come [s].
START_TIMEOUT = 90.0
# Port of the page.
WEB_PORT = 8080
# Speed of time for the cameras of a stage: two cores find people in the images of three about twice a second.
STAGE_SPEED = 0.1


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog='./run demo', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group()
    source.add_argument('--bag', type=Path, metavar='FILE', help='play this bag (with --image and --points)')
    source.add_argument('--images', type=Path, metavar='DIR',
                        help='a folder of images (2D), or an RGB-D sequence: rgb/, depth/ and camera.yaml (3D)')
    source.add_argument('--stage', type=Path, metavar='DIR',
                        help='a folder with an RGB-D sequence for each of several cameras, whose poses are known '
                             '(sequence.yaml or meta.json)')
    source.add_argument('--camera', metavar='N', help='a webcam, by its device number (2D)')
    parser.add_argument('--image', metavar='T', default='/kinect2/qhd/image_color', help='image topic of the bag')
    parser.add_argument('--points', metavar='T', default='/kinect2/qhd/points', help='organized cloud topic of the bag')
    parser.add_argument('--depth', metavar='T', help='aligned depth topic of the bag, instead of --points; '
                                                         'may end in /compressedDepth')
    parser.add_argument('--camera-info', metavar='T', default='/kinect2/qhd/camera_info', help='camera info of --depth')
    parser.add_argument('--compressed', action='store_true', help='the bag holds T/compressed instead of T')
    parser.add_argument('--signals', action='store_true',
                        help='tell what people in space do too: postures, gestures, pointing')
    parser.add_argument('--rviz', action='store_true', help='open the RViz window')
    parser.add_argument('--web', action='store_true', help='show people in browsers, until Ctrl-C (no bag)')
    parser.add_argument('--no-rviz', action='store_true', help='make no pictures of RViz')
    parser.add_argument('--screenshots', action='store_true',
                        help='of every second frame of one pass through a sequence: rviz_000.png, rviz_001.png, ...')
    parser.add_argument('--seconds', type=number(1, 3600), default=20.0, help='to record (default %(default)s)')
    parser.add_argument('--output', type=Path, default=OWN_FOLDER,
                        help='new or empty folder (default: demo_output in the checkout, which each demo fills anew)')
    parser.add_argument('--overwrite', action='store_true', help='replace the outputs in another folder')
    arguments = parser.parse_args()
    for path in (arguments.bag, arguments.images, arguments.stage):
        if path is not None and not path.exists():
            parser.error(f'{path} does not exist')
    if arguments.web and (arguments.bag or arguments.stage):
        parser.error('--web needs what plays without end: the shipped sequence, --images or --camera')
    if not (arguments.overwrite or arguments.output.resolve() == OWN_FOLDER):
        check_new(arguments.output)
    return arguments


def check_new(output: Path) -> None:
    """Refuse a folder with files that no demo may have made: outputs in it would be replaced."""
    if output.exists() and not (output.is_dir() and not any(output.iterdir())):
        raise SystemExit(f'{output} is there already, and not an empty folder; name another one, or give --overwrite')


def launch_command(arguments: argparse.Namespace) -> List[str]:
    """Return the roslaunch command that starts the chain for the chosen source."""
    if arguments.camera is not None or (arguments.images and not (arguments.images / 'depth').is_dir()):
        source = arguments.camera if arguments.camera is not None else str(arguments.images.resolve())
        return ['roslaunch', 'openpose_ros_bringup', 'people.launch', 'camera:=files', f'source:={source}']
    if arguments.stage:
        return stage.launch_command(arguments.bag, arguments.rviz, arguments.signals)
    command = ['roslaunch', 'openpose_ros_bringup', 'people.launch', f'rviz:={str(arguments.rviz).lower()}',
               f'signals:={str(arguments.signals).lower()}']
    if arguments.bag:
        command += [f'camera:={write_camera(arguments)}']
        knows_world = is_in_world(arguments.bag)
    else:
        command += ['camera:=sequence', *([f'source:={arguments.images.resolve()}'] if arguments.images else [])]
        knows_world = not arguments.images or RgbdSequence.read(arguments.images).T_world_camera is not None
    return [*command, 'fixed_frame:=world' if knows_world else 'floor:=true']


def write_camera(arguments: argparse.Namespace) -> Path:
    """Write the camera of a bag, of the form of cameras.yaml; return the file."""
    camera = {'image': arguments.image.strip('/'), 'image_transport': 'compressed' if arguments.compressed else 'raw'}
    if arguments.depth:
        depth, is_compressed, _ = arguments.depth.rpartition('/compressedDepth')
        camera.update(points_source='depth_image', depth=(depth or arguments.depth).strip('/'),
                      camera_info=arguments.camera_info.strip('/'),
                      depth_transport='compressedDepth' if is_compressed else 'raw')
    else:
        camera.update(points_source='point_cloud', points=arguments.points.strip('/'))
    path: Path = arguments.output.resolve() / 'bag_camera.yaml'
    path.write_text(json.dumps({'bag': camera}))
    return path


def is_in_world(path: Path) -> bool:
    """Return whether static transforms in a bag say where things are in the frame world."""
    with rosbag.Bag(str(path)) as bag:
        return any('world' in (one.header.frame_id, one.child_frame_id)
                   for _, message, _ in bag.read_messages(topics=['/tf_static']) for one in message.transforms)


def show_rate(results: ResultWatch, seconds: float, source: Optional[subprocess.Popen]) -> None:
    """Print the live rate until the time is over or the source has ended."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and (source is None or source.poll() is None):
        time.sleep(1.0)
        print('  ' + results.line(), flush=True)


def record(session: Session, output: Path, dimension: str) -> List[subprocess.Popen]:
    """Start the recorders: CSV by rostopic echo -p, and a bag of the outputs."""
    space = NAMESPACE[dimension]
    people, topics = {}, []
    if dimension != 'stage':
        people['keypoints_2d.csv'] = 'detected_poses_keypoints'
        topics += ['detected_poses', 'detected_poses_image']
    if dimension != '2d':
        people['keypoints_3d.csv'] = 'detected_poses_keypoints_3d'
        topics += ['detected_poses_3d', 'visualization_markers', 'visualization_skeleton', 'people_signals']
    recorders = [session.start(f'rostopic_{name}', ['rostopic', 'echo', '-p', f'{space}/{topic}'], output / name)
                 for name, topic in people.items()]
    recorders.append(session.start('rosbag', [
        'rosbag', 'record', '--lz4', '-O', str(output / 'output.bag'), '/tf', '/tf_static', FRAMES,
        *(f'{space}/{topic}' for topic in (*topics, *people.values()))]))
    return recorders


def play_bag(session: Session, arguments: argparse.Namespace, rate: float = 1.0) -> subprocess.Popen:
    """Play the bag as soon as the chain listens."""
    rospy.wait_for_service('detect_poses_3d', START_TIMEOUT)
    return session.start('rosbag_play', ['rosbag', 'play', '--clock', '--delay', '2', '--rate', str(rate),
                                         str(arguments.bag)])


def take_pictures(session: Session, arguments: argparse.Namespace, folder: Path, screen: HeadlessScreen) -> None:
    """Show recorded moments in RViz, on a screen in memory; say how far the true joints are from the drawn ones."""
    print('[demo] pictures of RViz, on a screen in memory ...', flush=True)
    os.environ.update(screen.environment())
    sequence = None if arguments.bag else RgbdSequence.read(arguments.images or SHIPPED)
    truth_file = (arguments.images or SHIPPED) / 'gt.json'
    truth = json.loads(truth_file.read_text()) if sequence is not None and truth_file.is_file() else None
    choices: Dict[str, Optional[List[int]]] = {'rviz.png': None}
    if truth is not None:
        choices = {**both_in_view(truth)}
    stamps = choose(folder / 'output.bag', choices)
    if arguments.screenshots and sequence is not None:
        stamps = {f'rviz_{frame // 2:03d}.png': stamp
                  for frame, stamp in sorted(best_pass(folder / 'output.bag').items(), reverse=True)}
    viewer = None
    for name, stamp in sorted(stamps.items(), key=lambda one: one[1]):
        moment = recorded(folder / 'output.bag', stamp, partial(cloud_of, arguments, sequence))
        viewer = viewer or Viewer(session, transforms_of(folder / 'output.bag'))
        picture = viewer.show(moment, folder / name)
        if truth is not None:
            errors = errors_of(picture, moment, viewer.pose(moment), truth)
            far = f', drawn {np.median(errors):.0f} px from the true ones (median)' if errors.size else ''
            print(f'[demo] {name}: {len(errors)} visible joints{far}')


def cloud_of(arguments: argparse.Namespace, sequence: Optional[RgbdSequence], frame: int, header: Header
             ) -> PointCloud2:
    """Return the cloud of a frame of a sequence, or that of a stamp in a bag; empty: there is none."""
    if sequence is not None:
        shown = sequence.frame(frame)
        return convert.cloud_to_message(cloud_from_depth(shown.depth * 0.001, sequence.camera, shown.bgr), header)
    with rosbag.Bag(str(arguments.bag)) as bag:
        return next((message for _, message, _ in bag.read_messages([arguments.points])
                     if message.header.stamp == header.stamp), PointCloud2(header=header))


def show_in_browsers(arguments: argparse.Namespace, folder: Path) -> None:
    """Play without end, for pages in browsers."""
    arguments.signals = True
    with Session(folder / 'log') as session:
        port, config = free_port(), folder / 'log' / 'page.yaml'
        config.write_text(f'people_web_node: {{port: {port}}}\n')
        command = [*launch_command(arguments), 'web:=true', f'config:={config}']
        print(f"[demo] {' '.join(command)}", flush=True)
        nodes = session.start('nodes', command)
        url = f'http://localhost:{port}'
        wait_for(lambda: is_served(url), START_TIMEOUT, 'page', nodes)
        print(f'[demo] people in a browser: {url}   (Ctrl-C ends)', flush=True)
        nodes.wait()


def free_port() -> int:
    """Return a port that is free: that of the page, or another one."""
    for port in (WEB_PORT, 0):
        with suppress(OSError), socket.create_server(('localhost', port)) as probe:
            return int(probe.getsockname()[1])
    raise SessionError('no port is free')


def is_served(url: str) -> bool:
    """Return whether there is a page."""
    with suppress(OSError), urllib.request.urlopen(url, timeout=5.0) as answer:  # noqa: S310 -- a page of this program
        return answer.status == 200
    return False


def run(arguments: argparse.Namespace, output: Path) -> ResultWatch:
    """Start everything, record, and stop everything again."""
    if arguments.stage:
        arguments.bag = output / 'stage.bag'
        stage.write_bag(arguments.stage, arguments.bag)
    command = launch_command(arguments)
    dimension = 'stage' if arguments.stage else '2d' if 'camera:=files' in command else '3d'
    with ExitStack() as stack:
        screen = None
        if dimension == '3d' and not (arguments.rviz or arguments.no_rviz):
            screen = stack.enter_context(HeadlessScreen(*RVIZ_SIZE))
        session = stack.enter_context(Session(output / 'log'))
        if arguments.bag:
            rosparam.set_param('/use_sim_time', 'true')
        recorders = record(session, output, dimension)
        print(f"[demo] {' '.join(command)}", flush=True)
        nodes = session.start('nodes', command)
        rospy.init_node('demo', anonymous=True, disable_signals=True)
        results = ResultWatch(*RESULTS[dimension])
        player = play_bag(session, arguments, STAGE_SPEED if arguments.stage else 1.0) if arguments.bag else None
        print('[demo] loading the network ...', flush=True)
        wait_for(lambda: len(results.arrivals) > 0, START_TIMEOUT, 'first result', player or nodes)
        show_rate(results, arguments.seconds, player)
        results.stop()
        for process in filter(None, [*recorders, player]):
            session.stop(process)
        if screen is not None:
            session.stop(nodes)
            take_pictures(session, arguments, output, screen)
        if arguments.rviz:
            with suppress(EOFError):  # no terminal: end at once
                input('[demo] RViz stays open; press Enter to end ')
    return results


def read_outputs(bag_path: Path) -> Tuple[List[Output], int]:
    """Return the people in frames of a sequence, and the number of its frames from the first of these to the last."""
    with rosbag.Bag(str(bag_path)) as bag:
        frames = {frame.stamp: frame.seq for _, frame, _ in bag.read_messages([FRAMES])}
        results = [result for _, result, _ in bag.read_messages([RESULTS['3d'][0]]) if result.header.stamp in frames]
    outputs = [Output(frames[result.header.stamp], result.header.stamp.to_sec(),
                      {one.person_ID: (one.neck.x, one.neck.y, one.neck.z) for one in result.persons})
               for result in results]
    return outputs, sum(outputs[0].stamp <= stamp.to_sec() <= outputs[-1].stamp for stamp in frames if outputs)


def show_found(bag_path: Path, truth: Path) -> None:
    """Print how many of the people in a sequence were found, and whether the machine is too slow for its rate."""
    outputs, played = read_outputs(bag_path)
    if outputs and truth.is_file():
        count = count_found(outputs, json.loads(truth.read_text()))
        print(f'[demo] found {count.found} of {count.visible} visible people; longest gap {count.longest_gap:.2f} s; '
              f'{count.no_person} reported where no person is')
        ids = '; '.join(' '.join(map(str, sorted(one))) for one in count.ids)
        print(f'[demo] ids of the people, by pass: {ids}; of two people: {sorted(count.exchanged) or "none"}')
    if len(outputs) < played / 2:
        print(f'[demo] this machine is too slow for the camera: results for {len(outputs)} of {played} frames')


def main() -> int:
    """Run the demo; return the exit status."""
    arguments = parse_arguments()
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    for name in OUTPUTS:
        (output / name).unlink(missing_ok=True)
    try:
        with all_ends_are_interrupts():
            if arguments.web:
                show_in_browsers(arguments, output)
                return 1
            results = run(arguments, output)
            write_annotated_video(output / 'output.bag', output / 'annotated.mp4')
    except (OpenposeRosError, rospy.ROSException) as error:
        print(f'[demo] failed: {error}; the logs are in {output}/log', file=sys.stderr)
        nodes_log = output / 'log' / 'nodes.log'
        if nodes_log.is_file():
            print(*nodes_log.read_text(errors='replace').splitlines()[-15:], sep='\n', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return INTERRUPTED
    show_found(output / 'output.bag', (arguments.images or SHIPPED) / 'gt.json')
    for path in (output / name for name in OUTPUTS):
        if path.is_file():
            print(f'[demo] {path}  {path.stat().st_size / 1e6:.1f} MB')
    if not any(results.people):
        print('[demo] no person was found in any frame', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
