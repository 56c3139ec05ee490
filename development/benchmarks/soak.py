#!/usr/bin/python3
"""Run the whole chain for long, with all that goes on around it: is anything lost, does it leak or slow down?

Two chains at once: `people_3d_node` with visualization, a camera of 960 x 540 at 30 Hz and the floor nodelet; and
detection service and extractor as two nodes, with a camera of their own at 5 Hz. In the images people come and go, 0 to
5 of them. All results are recorded by record.launch. In each cycle (5 min of 60)

  - the detection service of the second chain is killed (SIGKILL) and has to come again by respawn;
  - the cameras end and start again, by Ctrl-C and by SIGKILL in turn;
  - parameters are changed by dynamic_reconfigure, and back;
  - subscribers of everything, as RViz is, come, hang (SIGSTOP), and are killed; one is slow.

The last fifth of a cycle is quiet. That of the first is compared with that of the last: memory of each node at most
101 %, no more threads or files than before. Runs of less than half an hour compare the middle with the end, and allow
256 MB and 4 threads and files: buffers and pools still grow to the size that the first busy minutes need, and the quiet
seconds are few. The age of the results does not grow: the slope of its medians, with 95 %
confidence. Frames that came = frames that were answered + frames that are counted as dropped, in each chain; no result
is missing in the bags that the node has published. The exit status is 1 if one of these fails.

    ./run bench soak --minutes 60 --json soak.json --picture soak.png
"""
import argparse
import itertools
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Tuple

import rospy
from dynamic_reconfigure.client import Client
from live.camera import NAMESPACE, TOPICS, make_bag, node_process, played_stamps, start_camera
from sensor_msgs.msg import Image

from common import Figures, Parser, markdown, new_path, run_live
from live.crowd import make_crowd
from live.soak_figures import (
    Account,
    Age,
    Result,
    Sampler,
    account,
    age,
    draw,
    growth,
    lost_on_the_way,
    recorded,
)
from session import Diagnostics, Session, await_true, wait_for
from skeleton_extract_3d.ros.extractor import NAMESPACE as RESULTS

START_TIMEOUT = 180.0
CYCLES, LEAST_CYCLE = 12, 30.0  # a cycle is the twelfth of a run, but takes at least this long [s]
SAMPLES = 600  # looks at the processes in a run
CAMERA_PAUSE = 3.0  # [s]
# Greatest memory at the end, as a share of that after the first cycle; in runs shorter than LONG [min] the other.
# That allows [MB] what allocator.py lets a process keep of freed memory: a short run can not tell it from what is lost,
# but 100 KB of each frame show nevertheless.
MEMORY, MEMORY_SHORT, LONG = 1.01, 256.0, 30.0
MORE_SHORT = 4  # threads or files more in those
# People in the parts of the sequence, and the frames of each part.
PEOPLE, PART = (2, 1, 0, 1, 5, 2), 20
PARAMETERS = ({'person_min_score': 0.4, 'tracking': False}, {'smoothing': False, 'jpeg_quality': 50},
              {'occlusion': False})
EVERYTHING = [f'/{RESULTS}/{topic}' for topic in (
    'detected_poses_image', 'detected_poses_image/compressed', 'input_rgb', 'input_pointcloud', 'camera_info',
    'visualization_markers', 'visualization_skeleton')] + ['/floor/plane']


class Chain(NamedTuple):
    """One of the two chains.

    Attributes:
        namespace: of its nodes; empty: the root.
        camera: name of its camera node.
        topics: namespace of the camera's topics.
        rate: of the camera [Hz].
        nodes: whose memory is watched, without the one that is killed.
    """

    namespace: str
    camera: str
    topics: str
    rate: float
    nodes: Tuple[str, ...]

    @property
    def extractor(self) -> str:
        """The node that takes the frames, without the first slash."""
        return f'{self.namespace}/skeleton_extract_3d_node'.lstrip('/')

    def results(self, topic: str) -> str:
        """Return the name of a topic of results."""
        return f'{self.namespace}/{RESULTS}/{topic}' if self.namespace else f'/{RESULTS}/{topic}'


ONE = Chain('', 'camera', NAMESPACE, 30.0,
            ('/skeleton_extract_3d_node', '/skeleton_extract_3d_visualization_node', '/floor'))
TWO = Chain('/two', 'camera_of_two', '/two/camera', 5.0, ('/two/skeleton_extract_3d_node',))
KILLED = '/two/openpose_ros_service_node_3d'
RECORDED = ('detected_poses', 'detected_poses_3d', 'detected_poses_keypoints_3d')
MARKERS = ('visualization_markers', 'visualization_skeleton')


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--minutes', type=float, default=60.0, help='of the run (default %(default)s)')
    parser.add_argument('--json', type=new_path, help='write the figures here')
    parser.add_argument('--picture', type=new_path, help='draw memory, threads, files and age here (PNG)')
    return parser.parse_args()


def make_sequence(folder: Path) -> Path:
    """Write a sequence in which people come and go."""
    sequence = folder / 'sequence'
    for name in ('rgb', 'depth'):
        (sequence / name).mkdir(parents=True)
    numbers = itertools.count()
    for people in PEOPLE:
        crowd = folder / f'crowd_{people}'
        crowd = crowd if crowd.is_dir() else make_crowd(people, crowd)
        for name in ('camera.yaml', 'sequence.yaml'):
            shutil.copy(str(crowd / name), str(sequence / name))
        for rgb, depth in list(zip(*(sorted((crowd / name).iterdir()) for name in ('rgb', 'depth'))))[:PART]:
            number = next(numbers)
            shutil.copy(str(rgb), str(sequence / 'rgb' / f'{number:05d}.jpg'))
            shutil.copy(str(depth), str(sequence / 'depth' / f'{number:05d}.png'))
    return sequence


class Soak:
    """The chains, and what goes on around them.

    Args:
        folder: for logs and bags.
    """

    def __init__(self, session: Session, folder: Path, minutes: float) -> None:
        self._session, self._folder = session, folder
        self._bag = make_bag(make_sequence(folder), folder / 'camera.bag', cloud=False)
        self._seconds = 60 * minutes
        self._cycles = max(int(min(CYCLES, self._seconds / LEAST_CYCLE)), 2)
        self._runs: Dict[Chain, List[Path]] = {ONE: [], TWO: []}
        self._cameras: Dict[Chain, subprocess.Popen] = {}
        self._kills: List[int] = []
        rospy.init_node('soak', disable_signals=True)
        self._diagnostics = Diagnostics()
        (folder / 'bags').mkdir()

    def run(self) -> None:
        """Start everything, and let it run."""
        self._nodes = self._start_nodes()
        for chain in self._runs:
            self._start_camera(chain)
        for chain in self._runs:
            wait_for(lambda chain=chain: self._diagnostics.count(chain.extractor, 'frames') > 0, START_TIMEOUT,
                     f'first result of {chain.extractor}', self._nodes[0])
        self._clients = [Client(f'/{chain.extractor}', timeout=START_TIMEOUT) for chain in self._runs]
        self._sampler = Sampler([*ONE.nodes, *TWO.nodes, KILLED], node_process, self._seconds / SAMPLES)
        self._began = rospy.get_rostime().to_nsec()
        for cycle in range(self._cycles):
            begin = cycle * self._seconds / self._cycles
            for share, event in self._events():
                self._sleep_until(begin + share * self._seconds / self._cycles)
                event(cycle)
        self._sleep_until(self._seconds)
        self._sampler.stop()
        self._ended = rospy.get_rostime().to_nsec()
        for camera in self._cameras.values():
            self._session.stop(camera)
        await_true(self._all_is_counted, 'the counters rest', START_TIMEOUT)
        for child in reversed(self._nodes):
            self._session.stop(child)

    def _events(self) -> Tuple[Tuple[float, Callable[[int], None]], ...]:
        """Return what happens in a cycle, and after which share of it."""
        return ((0.05, self._kill_service), (0.20, self._restart_cameras), (0.35, self._change_parameters),
                (0.45, self._visitors_come), (0.60, self._visitors_hang), (0.65, self._visitors_go))

    def _start_nodes(self) -> List[subprocess.Popen]:
        start = self._session.start
        arguments = ['mode:=fast', 'points_source:=depth_image']
        recorded_topics = [chain.results(topic) for chain in self._runs for topic in RECORDED]
        recorded_topics += [ONE.results(topic) for topic in MARKERS]
        return [
            start('one', ['roslaunch', 'skeleton_extract_3d', 'demo.launch', 'play:=false', 'world_tf:=false',
                          f'target_rate:={ONE.rate}', *arguments]),
            start('two', ['env', 'ROS_NAMESPACE=/two', 'roslaunch', 'skeleton_extract_3d',
                          'openpose_skeleton_extract.launch', f'image:={TWO.topics}/image_color',
                          f'depth:={TWO.topics}/image_depth_rect', f'camera_info:={TWO.topics}/camera_info',
                          'one_process:=false', f'target_rate:={TWO.rate}', *arguments]),
            start('floor', ['roslaunch', 'openpose_ros_nodelets', 'floor.launch',
                            f'points:={ONE.results("input_pointcloud")}']),
            start('record', ['roslaunch', 'skeleton_extract_3d', 'record.launch', f'folder:={self._folder / "bags"}',
                             f'topics:={" ".join(recorded_topics)}'])]

    def _start_camera(self, chain: Chain) -> None:
        stamps = self._folder / f'{chain.camera}_{len(self._runs[chain])}.txt'
        self._runs[chain].append(stamps)
        names = {f'{NAMESPACE}/{topic}': f'{chain.topics}/{topic}' for topic in TOPICS['depth_image'].split()}
        self._cameras[chain] = start_camera(self._session, self._bag, chain.rate, stamps,
                                            {'__name': chain.camera, **names}, topics=TOPICS['depth_image'])

    def _sleep_until(self, seconds: float) -> None:
        """Wait for a time since the begin [s]; events that took longer than planned are late."""
        time.sleep(max(seconds - self._sampler.seconds, 0.0))

    def _kill_service(self, _: int) -> None:
        with suppress(OSError):  # not there again since it was killed: told by the account
            node_process(KILLED).kill()
            self._kills.append(rospy.get_rostime().to_nsec())

    def _restart_cameras(self, cycle: int) -> None:
        for camera in self._cameras.values():
            if cycle % 2:
                os.killpg(camera.pid, signal.SIGKILL)
            self._session.stop(camera)
        time.sleep(CAMERA_PAUSE)
        for chain in self._cameras:
            self._start_camera(chain)

    def _change_parameters(self, cycle: int) -> None:
        for client in self._clients:
            before, changed = client.get_configuration(), PARAMETERS[cycle % len(PARAMETERS)]
            changed = {name: value for name, value in changed.items() if name in before}
            client.update_configuration(changed)
            time.sleep(1.0)
            client.update_configuration({name: before[name] for name in changed})

    def _visitors_come(self, cycle: int) -> None:
        self._visitors = self._session.start(f'visitors_{cycle}', ['rostopic', 'hz', *EVERYTHING])
        self._slow = rospy.Subscriber(ONE.results('detected_poses_image'), Image, lambda _: time.sleep(0.5))

    def _visitors_hang(self, _: int) -> None:
        os.killpg(self._visitors.pid, signal.SIGSTOP)

    def _visitors_go(self, _: int) -> None:
        self._slow.unregister()
        os.killpg(self._visitors.pid, signal.SIGKILL)
        self._session.stop(self._visitors)

    def _all_is_counted(self) -> bool:
        before = self._counts()
        time.sleep(3.0)
        return before == self._counts()

    def _counts(self) -> List[int]:
        return [self._diagnostics.count(chain.extractor, key) for chain in self._runs
                for key in ('frames', 'images received')]

    def figures(self, minutes: float, picture: Path) -> Figures:
        """Return what was measured, with `faults`, what is not as it has to be."""
        results = recorded(self._folder / 'bags')
        accounts, ages = {}, {}
        for chain, runs in self._runs.items():
            own = results.get(chain.results('detected_poses_3d'), [])
            accounts[chain] = account(self._diagnostics, chain.extractor, f'{chain.topics}/image_color',
                                      [played_stamps(run) for run in runs], own)
            ages[chain] = age(own, self._began, self._ended)
        cycle, quiet = self._seconds / self._cycles, 0.2 * self._seconds / self._cycles
        is_long = minutes >= LONG
        windows = [(end - quiet, end) for end in (cycle * (1 if is_long else self._cycles // 2), self._seconds)]
        grown = {node: growth(self._sampler.samples[node], windows) for node in (*ONE.nodes, *TWO.nodes)}
        not_recorded = {topic: lost_on_the_way(each) for topic, each in sorted(results.items())}
        faults = [f'{chain.extractor}: {fault}' for chain in accounts
                  for fault in (*accounts[chain].faults(), *ages[chain].faults())]
        for node, each in grown.items():
            limits = (MEMORY, 0.0, 0) if is_long else (1.0, MEMORY_SHORT, MORE_SHORT)
            faults += each.faults(node, *limits) if each else [f'{node}: no samples']
        faults += [f'{topic}: {lost} messages are not in the bag' for topic, lost in not_recorded.items() if lost]
        faults += [f'{node}: ended {lives - 1} times' for node, lives in self._sampler.lives.items()
                   if node != KILLED and lives != 1]
        print_accounts(accounts, ages)
        if picture:
            draw(picture, self._sampler.samples, ages[ONE])
        return {'minutes': minutes, 'cycles': self._cycles, 'faults': faults,
                'frames': {chain.extractor: each._asdict() for chain, each in accounts.items()},
                'age_s': {chain.extractor: each._asdict() for chain, each in ages.items()},
                'growth': {node: each and each._asdict() for node, each in grown.items()},
                'recorded': {topic: len(each) for topic, each in sorted(results.items())}, 'not_recorded': not_recorded,
                'service_after_kill_s': self._seconds_to_answer(results), 'lives': self._sampler.lives,
                'samples': {node: each[::len(each) // 60 + 1] for node, each in self._sampler.samples.items()}}

    def _seconds_to_answer(self, results: Dict[str, List[Result]]) -> List[float]:
        """Return how long the second chain was without results after each kill of its service [s]."""
        times = [result.received for result in results.get(TWO.results('detected_poses_3d'), [])]
        # results of requests that the service had answered before come within a moment
        return [next(((after - kill) / 1e9 for before, after in zip(times, times[1:])
                      if after > kill and after - before > 1e9), float('nan')) for kill in self._kills]


def print_accounts(accounts: Dict[Chain, Account], ages: Dict[Chain, Age]) -> None:
    """Print what came of the frames of each chain."""
    print(markdown([('chain', 'frames sent', 'came', 'answered', 'dropped, counted', 'age median / 95 % / worst [ms]'),
                    *((chain.extractor, each.played, each.received, each.answered,
                       ', '.join(f'{reason}: {number}' for reason, number in each.dropped.items()) or '0',
                       ' / '.join(f'{1000 * value:.0f}' for value in ages[chain][:3]))
                      for chain, each in accounts.items())]))


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> Figures:
    """Run the soak; return its figures."""
    soak = Soak(session, folder, arguments.minutes)
    soak.run()
    return soak.figures(arguments.minutes, arguments.picture)


def main() -> int:
    """Run the benchmark; return the exit status."""
    arguments, faults = parse_arguments(), []

    def run(session: Session, folder: Path) -> Figures:
        figures = measure(session, folder, arguments)
        faults.extend(figures['faults'])
        return figures

    status = run_live(run, arguments.json)
    print('\n'.join(['FAILED:', *faults] if faults else ['nothing lost, nothing grown']) if status == 0 else 'NOT RUN')
    return status or bool(faults)


if __name__ == '__main__':
    sys.exit(main())
