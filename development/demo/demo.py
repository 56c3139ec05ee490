#!/usr/bin/python3
"""Show the whole chain at work and keep what it publishes.

Plays the shipped RGB-D sequence (or a folder of images, a camera) through detection, lifting and markers, by
roslaunch, on a ROS master of its own. Leaves in the output folder: keypoints_2d.csv and keypoints_3d.csv as
`rostopic echo -p` writes them, output.bag, annotated.mp4 and rviz.png.
A sequence is played once, then black, and so on; where its gt.json holds the true people, those found are counted.
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
from pathlib import Path
from typing import List, Tuple

sys.path.append(str(Path(__file__).resolve().parents[2] / 'tests/support'))
import rosbag
import rosgraph
import rosparam
import rospy
from annotated_video import write_annotated_video
from found_people import Output, count_found
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from screen import RVIZ_SIZE, HeadlessScreen, publish_slow_clock, take_screenshot

from openpose_ros_pkg.command_line import INTERRUPTED, all_ends_are_interrupts
from openpose_ros_pkg.command_options import number, whole_number
from openpose_ros_pkg.errors import OpenposeRosError
from session import ResultWatch, Session, SessionError, wait_for
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

NAMESPACE = {'2d': '/openpose_ros', '3d': '/openpose_ros/skeleton_3d'}
RESULTS = {'2d': (NAMESPACE['2d'] + '/detected_poses', PersonDetectionArray),
           '3d': (NAMESPACE['3d'] + '/detected_poses_3d', PersonDetection_3dArray)}
ROOT = Path(__file__).resolve().parents[2]
SHIPPED, OWN_FOLDER = ROOT / 'skeleton_extract_3d/demo/cross', ROOT / 'demo_output'
# Stamp and index (seq) of each frame of a sequence, from the player.
FRAMES = '/rgbd_player_node/frame'
OUTPUTS = ('keypoints_2d.csv', 'keypoints_3d.csv', 'output.bag', 'annotated.mp4', 'rviz.png')
# Time for the network to load and the first result to come [s].
START_TIMEOUT = 90.0
# Port of the page.
WEB_PORT = 8080
# Speed of time while RViz is drawn: without a graphics card it draws one to four times a second.
SLOW_MOTION = 0.05
# Frames per second of a sequence, before that [Hz].
SEQUENCE_RATE = 15.0
# Time that RViz gets to draw before its first screenshot [s].
RVIZ_SECONDS = 12.0
# Time from the people of a frame to the screenshot in which RViz shows them [s].
DRAW_SECONDS = 0.9


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog='./run demo', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group()
    source.add_argument('--images', type=Path, metavar='DIR',
                        help='a folder of images (2D), or an RGB-D sequence: rgb/, depth/ and camera.yaml (3D)')
    source.add_argument('--camera', metavar='N', help='a webcam, by its device number (2D)')
    parser.add_argument('--signals', action='store_true',
                        help='tell what people in space do too: postures, gestures, pointing')
    parser.add_argument('--rviz', action='store_true', help='open the RViz window')
    parser.add_argument('--web', action='store_true', help='show people in browsers, until Ctrl-C')
    parser.add_argument('--no-rviz', action='store_true', help='make no screenshot of RViz')
    parser.add_argument('--screenshots', type=whole_number(0), default=1, metavar='N',
                        help='screenshots of RViz, of every second frame; more than one: rviz_00.png, rviz_01.png, ...')
    parser.add_argument('--seconds', type=number(1, 3600), default=20.0, help='to record (default %(default)s)')
    parser.add_argument('--output', type=Path, default=OWN_FOLDER,
                        help='new or empty folder (default: demo_output in the checkout, which each demo fills anew)')
    parser.add_argument('--overwrite', action='store_true', help='replace the outputs in another folder')
    arguments = parser.parse_args()
    if arguments.images is not None and not arguments.images.exists():
        parser.error(f'{arguments.images} does not exist')
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
    command = ['roslaunch', 'openpose_ros_bringup', 'people.launch', f'rviz:={str(arguments.rviz).lower()}',
               f'signals:={str(arguments.signals).lower()}', 'camera:=sequence',
               *([f'source:={arguments.images.resolve()}'] if arguments.images else [])]
    knows_world = not arguments.images or RgbdSequence.read(arguments.images).T_world_camera is not None
    return [*command, 'fixed_frame:=world' if knows_world else 'floor:=true']


def show_rate(results: ResultWatch, seconds: float) -> None:
    """Print the live rate until the time is over."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(1.0)
        print('  ' + results.line(), flush=True)


def record(session: Session, output: Path, dimension: str) -> List[subprocess.Popen]:
    """Start the recorders: CSV by rostopic echo -p, and a bag of the outputs."""
    space = NAMESPACE[dimension]
    people, topics = {'keypoints_2d.csv': 'detected_poses_keypoints'}, ['detected_poses', 'detected_poses_image']
    if dimension != '2d':
        people['keypoints_3d.csv'] = 'detected_poses_keypoints_3d'
        topics += ['detected_poses_3d', 'visualization_markers', 'visualization_skeleton', 'people_signals']
    recorders = [session.start(f'rostopic_{name}', ['rostopic', 'echo', '-p', f'{space}/{topic}'], output / name)
                 for name, topic in people.items()]
    recorders.append(session.start('rosbag', [
        'rosbag', 'record', '--lz4', '-O', str(output / 'output.bag'), '/tf', '/tf_static', FRAMES,
        *(f'{space}/{topic}' for topic in (*topics, *people.values()))]))
    return recorders


def take_screenshots(session: Session, arguments: argparse.Namespace, command: List[str], folder: Path,
                          screen: HeadlessScreen) -> None:
    """Run the chain once more, in slow motion, with RViz on a screen in memory, and take screenshots."""
    print('[demo] screenshot of RViz, on a screen in memory ...', flush=True)
    os.environ.update(screen.environment())
    rosparam.set_param('/use_sim_time', 'true')
    publish_slow_clock(SLOW_MOTION)
    rate = folder / 'log' / 'rate.yaml'
    rate.write_text(f'rgbd_player_node: {{rate: {SEQUENCE_RATE * SLOW_MOTION}, playback: forth_and_back}}\n')
    # frames come seldom: there is time for all
    nodes = session.start('nodes_with_rviz', [*command, 'target_rate:=0', f'config:={rate}', 'rviz:=true'])
    results = ResultWatch(*RESULTS['3d'])
    wait_for(lambda: len(results.arrivals) > 0, START_TIMEOUT, 'first result', nodes)
    wait_for(is_drawing, START_TIMEOUT, 'RViz', nodes)
    time.sleep(RVIZ_SECONDS)
    for shot in range(arguments.screenshots):
        seen = len(results.arrivals)
        wait_for(lambda seen=seen: len(results.arrivals) >= seen + 2, RVIZ_SECONDS, 'next but one frame', nodes)
        time.sleep(DRAW_SECONDS)
        take_screenshot(folder / ('rviz.png' if arguments.screenshots == 1 else f'rviz_{shot:02d}.png'))


def is_drawing() -> bool:
    """Return whether RViz is open: it subscribes to the skeletons."""
    return any('rviz' in node for topic, nodes in rosgraph.Master('/demo').getSystemState()[1]
               if topic.endswith('/visualization_skeleton') for node in nodes)


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
    command = launch_command(arguments)
    dimension = '2d' if 'camera:=files' in command else '3d'
    with ExitStack() as stack:
        screen = None
        if dimension != '2d' and not (arguments.rviz or arguments.no_rviz):
            screen = stack.enter_context(HeadlessScreen(*RVIZ_SIZE))
        session = stack.enter_context(Session(output / 'log'))
        recorders = record(session, output, dimension)
        print(f"[demo] {' '.join(command)}", flush=True)
        nodes = session.start('nodes', command)
        rospy.init_node('demo', anonymous=True, disable_signals=True)
        results = ResultWatch(*RESULTS[dimension])
        print('[demo] loading the network ...', flush=True)
        wait_for(lambda: len(results.arrivals) > 0, START_TIMEOUT, 'first result', nodes)
        show_rate(results, arguments.seconds)
        results.stop()
        for process in recorders:
            session.stop(process)
        if screen is not None:
            session.stop(nodes)
            take_screenshots(session, arguments, command, output, screen)
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
        print('[demo] ids in each pass:', *map(sorted, count.ids), 'exchanged:', sorted(count.exchanged))
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
    print(f'[demo] {results.line().strip()}')
    show_found(output / 'output.bag', (arguments.images or SHIPPED) / 'gt.json')
    for path in (output / name for name in OUTPUTS):
        if path.is_file():
            print(f'[demo] {path}  {path.stat().st_size / 1e3:.0f} kB')
    if not any(results.people):
        print('[demo] no person was found in any frame', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
