#!/usr/bin/python3
"""Run the whole chain for long under disturbances: is anything lost, does it leak or slow down?

Two chains at once: `people_3d_node` with visualization, a camera of 960 x 540 at 30 Hz and the floor node; and
detection service and extractor as two nodes, with a camera at 5 Hz. In the images people come and go, 0 to 5 of them.
record.launch records all results. In each cycle (5 min of 60) the detection service of the second chain is killed and
has to respawn; the cameras end and start again, by Ctrl-C and by SIGKILL in turn; parameters change by
dynamic_reconfigure, and back; subscribers of everything come, hang (SIGSTOP), and are killed; one is slow.

The exit status is 1 if memory, threads or files of a node or the age of the results grow, if frames that came are
neither answered nor counted as dropped, if a frame failed by an unexpected exception, or if a published result is
missing in the bags. Growth is that of the least value in each cycle: subscribers come and go, and nodes give the memory
that these needed back once in a minute.

    ./run bench soak --minutes 60
"""
import os
import signal
import struct
import subprocess
import sys
import time
import xmlrpc.client
from argparse import Namespace
from contextlib import suppress
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Sequence, Set, Tuple

import pandas as pd
import psutil
import rosbag
import rospy
from dynamic_reconfigure.client import Client
from sensor_msgs.msg import Image

from camera_driver import NAMESPACE, make_bag, played_stamps, start_camera
from common import Parser, markdown, run_live
from crowd import make_crowd
from openpose_ros_pkg.errors import OpenposeRosError
from scoring.growth import growth, least_growth
from session import Diagnostics, Session, await_true, wait_for
from skeleton_extract_3d.ros.extractor import NAMESPACE as RESULTS

START_TIMEOUT = 180.0
CYCLES, LEAST_CYCLE = 12, 30.0  # a cycle is the twelfth of a run, but takes at least this long [s]
SAMPLES = 600  # of the processes in a run
CAMERA_PAUSE = 3.0  # [s]
# Growth over the run that counts as none: memory by a share and by [MB]; threads or files. The second row is of runs
# shorter than LONG [min], where freed memory that allocator.py lets a process keep can not be told from a leak.
LIMITS, LIMITS_SHORT, LONG = (0.01, 0.0, 0), (0.0, 256.0, 4), 30.0
# Number of medians of the age that make a line; growth that is none, as a share of the median age over the run.
AGE_PARTS, AGE_GROWTH = 60, 0.1
COLUMNS = ('seq', 'stamp', 'received')  # of recorded messages
WAITING = 2  # images that may wait for their points when the camera ends
# People in the parts of the sequence, and the frames of each part.
PEOPLE, PART = (2, 1, 0, 1, 5, 2), 20
PARAMETERS = ({'person_min_score': 0.4, 'tracking': False}, {'smoothing': False, 'jpeg_quality': 50},
              {'occlusion': False})
EVERYTHING = [f'/{RESULTS}/{topic}' for topic in (
    'detected_poses_image', 'detected_poses_image/compressed', 'input_rgb', 'input_pointcloud', 'camera_info',
    'visualization_markers', 'visualization_skeleton')] + ['/floor/plane']


class Chain(NamedTuple):
    """One of the two chains: namespace, camera node and topics, rate [Hz], nodes whose memory is watched."""

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
        return f'{self.namespace}/{RESULTS}/{topic}'


ONE = Chain('', 'camera', NAMESPACE, 30.0,
            ('/skeleton_extract_3d_node', '/skeleton_extract_3d_visualization_node', '/floor'))
TWO = Chain('/two', 'camera_of_two', '/two/camera', 5.0, ('/two/skeleton_extract_3d_node',))
CHAINS = (ONE, TWO)
KILLED = '/two/openpose_ros_service_node_3d'
RECORDED = [chain.results(topic) for chain in CHAINS
            for topic in ('detected_poses', 'detected_poses_3d', 'detected_poses_keypoints_3d')]
RECORDED += [ONE.results(topic) for topic in ('visualization_markers', 'visualization_skeleton')]


class Sampler:
    """Samples the processes of nodes every `period` [s] while the run waits.

    Attributes:
        samples: of each node: time since the begin [s], memory of its own [MB], threads, files.
        lives: number of processes of each node so far.
    """

    def __init__(self, nodes: Sequence[str], period: float) -> None:
        self._period, self._began, self._processes = period, time.monotonic(), {}
        self.samples: Dict[str, List[Tuple[float, ...]]] = {node: [] for node in nodes}
        self.lives = dict.fromkeys(nodes, 0)

    def wait_until(self, seconds: float) -> None:
        """Sample until a time since the begin [s]."""
        while (now := time.monotonic() - self._began) < seconds:
            for node in self.samples:
                try:
                    if node not in self._processes:
                        self._processes[node] = node_process(node)
                        self.lives[node] += 1
                    process = self._processes[node]
                    self.samples[node].append((now, process.memory_full_info().uss / 1e6, process.num_threads(),
                                               process.num_fds()))
                except (OSError, psutil.Error):  # it was killed and is not there again
                    self._processes.pop(node, None)
            time.sleep(max(min(self._period, self._began + seconds - time.monotonic()), 0.0))


def node_process(name: str) -> psutil.Process:
    """Return the process of a node; OSError: it does not answer."""
    node = xmlrpc.client.ServerProxy(rospy.get_master().lookupNode(name)[2])
    return psutil.Process(node.getPid(rospy.get_name())[2])


def recorded(folder: Path) -> Dict[str, pd.DataFrame]:
    """Return seq, stamp and arrival [ns] of the messages of each topic in the bags of a folder, as they arrived."""
    results: Dict[str, List[Tuple[int, int, int]]] = {}
    for path in sorted(folder.glob('*.bag')):
        with rosbag.Bag(str(path)) as bag:
            for topic, raw, received in bag.read_messages(raw=True):
                seq, seconds, nanoseconds = struct.unpack_from('<III', raw[1])
                results.setdefault(topic, []).append((seq, seconds * 10**9 + nanoseconds, received.to_nsec()))
    return {topic: pd.DataFrame(rows, columns=COLUMNS) for topic, rows in results.items()}


def frame_faults(kind: type = OpenposeRosError) -> List[str]:
    """Return the counters of faults that cost a frame."""
    own = [kind.event] if kind.event else []
    return own + [event for each in kind.__subclasses__() for event in frame_faults(each)]


def account(diagnostics: Diagnostics, chain: Chain, runs: Sequence[Path], answered_stamps: Set[int]
            ) -> Tuple[List[object], List[str]]:
    """Return the numbers of frames sent, received, answered and dropped, and the faults in them.

    Args:
        runs: file of the stamps of each run of the camera.
        answered_stamps: of the recorded results [ns].
    """
    def count(key: str) -> int:
        return diagnostics.count(chain.extractor, key)

    lost = f'lost before this node, {chain.topics}/image_color'
    reasons = (lost, 'frames skipped', 'images without a partner', 'stamp not newer', *sorted({*frame_faults()}),
               'frame failed')
    dropped = {reason: count(reason) for reason in reasons if count(reason)}
    received, answered, gone = count('images received') + dropped.get(lost, 0), count('frames'), sum(dropped.values())
    unanswered, played = 0, [played_stamps(run) for run in runs]
    for stamps in played:  # from the first to the last answered one
        places = [number for number, stamp in enumerate(stamps) if stamp in answered_stamps]
        unanswered += places[-1] - places[0] + 1 - len(places) if places else 0
    invented = len(answered_stamps.difference(*played))
    faults = {f'{received} frames came, but {answered} were answered and {gone} dropped':
              not 0 <= received - answered - gone <= WAITING,
              f'{unanswered} frames have no result, but {gone} are counted as dropped': unanswered > gone,
              f'{invented} results have stamps of no frame': invented > 0}
    return [sum(map(len, played)), received, answered, dropped], [text for text, is_true in faults.items() if is_true]


def age(results: pd.DataFrame, begin: int, end: int) -> Tuple[List[str], List[str]]:
    """Return median, 95 % and maximum of the age of results at the recorder [s], and if it grows; times in [ns]."""
    ages, parts = (results.received - results.stamp) / 1e9, (results.received - begin) * AGE_PARTS // (end - begin)
    grown = least_growth(ages.groupby(parts).median())
    return ([f'{value:.3f}' for value in (ages.median(), ages.quantile(0.95), ages.max())],
            [f'the age grew by at least {1000 * grown:.0f} ms'] if grown > AGE_GROWTH * ages.median() else [])


class Soak:
    """The chains, and the disturbances around them.

    Args:
        folder: for logs and bags.
    """

    def __init__(self, session: Session, folder: Path, minutes: float) -> None:
        self._session, self._folder, self._seconds = session, folder, 60 * minutes
        self._bag = make_bag(make_crowd(folder / 'crowd', PEOPLE, PART), folder / 'camera.bag')
        self._cycles = max(int(min(CYCLES, self._seconds / LEAST_CYCLE)), 2)
        self._runs: Dict[Chain, List[Path]] = {chain: [] for chain in CHAINS}
        self._cameras: Dict[Chain, subprocess.Popen] = {}
        rospy.init_node('soak', disable_signals=True)
        self._diagnostics = Diagnostics()
        (folder / 'bags').mkdir()

    def run(self) -> List[str]:
        """Start everything, let it run and print what was measured; return the faults."""
        nodes = self._start_nodes()
        for chain in CHAINS:
            self._start_camera(chain)
        for chain in CHAINS:
            wait_for(lambda chain=chain: self._diagnostics.count(chain.extractor, 'frames') > 0, START_TIMEOUT,
                     f'first result of {chain.extractor}', nodes[0])
        self._clients = [Client(f'/{chain.extractor}', timeout=START_TIMEOUT) for chain in CHAINS]
        self._sampler = Sampler([*ONE.nodes, *TWO.nodes, KILLED], self._seconds / SAMPLES)
        self._began, cycle_seconds = rospy.get_rostime().to_nsec(), self._seconds / self._cycles
        for cycle in range(self._cycles):
            for share in self._disturb(cycle):  # disturbances that took longer than planned are late
                self._sampler.wait_until((cycle + share) * cycle_seconds)
        self._sampler.wait_until(self._seconds)
        self._ended = rospy.get_rostime().to_nsec()
        for camera in self._cameras.values():
            self._session.stop(camera)
        await_true(self._all_is_counted, 'the counters rest', START_TIMEOUT)
        for child in reversed(nodes):
            self._session.stop(child)
        return self._report()

    def _start_nodes(self) -> List[subprocess.Popen]:
        return [self._session.start(name, command) for name, command in {
            'one': ['roslaunch', 'openpose_ros_bringup', 'people.launch', 'signals:=false',
                    f'target_rate:={ONE.rate}', 'mode:=fast', f'depth:={ONE.topics}/image_depth_rect'],
            'two': ['env', 'ROS_NAMESPACE=/two', 'roslaunch', 'skeleton_extract_3d', 'openpose_skeleton_extract.launch',
                    f'image:={TWO.topics}/image_color', f'depth:={TWO.topics}/image_depth_rect',
                    f'camera_info:={TWO.topics}/camera_info', 'one_process:=false', f'target_rate:={TWO.rate}',
                    'mode:=fast', 'points_source:=depth_image'],
            'floor': ['roslaunch', 'openpose_ros_bringup', 'nodelets.launch', 'floor:=true',
                      f'points:={ONE.results("input_pointcloud")}'],
            'record': ['roslaunch', 'openpose_ros_bringup', 'record.launch', f'folder:={self._folder / "bags"}',
                       f'topics:={" ".join(RECORDED)}']}.items()]

    def _start_camera(self, chain: Chain) -> None:
        stamps = self._folder / f'{chain.camera}_{len(self._runs[chain])}.txt'
        self._runs[chain].append(stamps)
        self._cameras[chain] = start_camera(self._session, self._bag, chain.rate, stamps, (chain.camera, chain.topics))

    def _disturb(self, cycle: int) -> Iterator[float]:
        """Disturb the chains; yield the share of the cycle at which the next disturbance is due."""
        yield 0.05
        with suppress(OSError):  # it is not there again since it was killed: the account tells
            node_process(KILLED).kill()
        yield 0.20
        for camera in self._cameras.values():
            if cycle % 2:
                os.killpg(camera.pid, signal.SIGKILL)
            self._session.stop(camera)
        time.sleep(CAMERA_PAUSE)
        for chain in CHAINS:
            self._start_camera(chain)
        yield 0.35
        for client in self._clients:
            before = client.get_configuration()
            changed = {name: value for name, value in PARAMETERS[cycle % len(PARAMETERS)].items() if name in before}
            client.update_configuration(changed)
            time.sleep(1.0)
            client.update_configuration({name: before[name] for name in changed})
        yield 0.45
        visitors = self._session.start(f'visitors_{cycle}', ['rostopic', 'hz', *EVERYTHING])
        slow = rospy.Subscriber(ONE.results('detected_poses_image'), Image, lambda _: time.sleep(0.5))
        yield 0.60
        os.killpg(visitors.pid, signal.SIGSTOP)
        yield 0.65
        slow.unregister()
        os.killpg(visitors.pid, signal.SIGKILL)
        self._session.stop(visitors)

    def _all_is_counted(self) -> bool:
        def counts() -> List[int]:
            return [self._diagnostics.count(chain.extractor, key) for chain in CHAINS
                    for key in ('frames', 'images received')]
        before = counts()
        time.sleep(3.0)
        return before == counts()

    def _report(self) -> List[str]:
        results, faults = recorded(self._folder / 'bags'), []
        frames = [['chain', 'sent', 'came', 'answered', 'dropped, counted', 'age: median', '95 %', 'worst [s]']]
        for chain in CHAINS:
            own = results.get(chain.results('detected_poses_3d'), pd.DataFrame(columns=COLUMNS))
            numbers, wrong = account(self._diagnostics, chain, self._runs[chain], set(own.stamp.tolist()))
            ages, older = age(own, self._began, self._ended)
            frames.append([chain.extractor, *numbers, *ages])
            faults += [f'{chain.extractor}: {fault}' for fault in (*wrong, *older)]
        cycle, is_long = self._seconds / self._cycles, self._seconds >= 60 * LONG
        nodes = [['node', 'memory [MB] in each cycle', 'threads', 'files']]
        for node in (*ONE.nodes, *TWO.nodes):
            least, wrong = growth(self._sampler.samples[node], cycle, LIMITS if is_long else LIMITS_SHORT)
            nodes.append([node, *least])
            faults += [f'{node}: {fault}' for fault in wrong]
        for topic, each in results.items():  # of publishers that never restart
            missing = each.seq.iloc[-1] - each.seq.iloc[0] + 1 - len(each)
            if missing > 0:
                faults.append(f'{topic}: {missing} messages are not in the bag')
        for log in self._folder.glob('*.log'):
            faults += [line for line in log.read_text(errors='replace').splitlines() if 'frame failed' in line]
        faults += [f'{node}: ended {lives - 1} times' for node, lives in self._sampler.lives.items()
                   if node != KILLED and lives != 1]
        print(markdown(frames), markdown(nodes), sep='\n')
        return faults


def measure(session: Session, folder: Path, arguments: Namespace) -> List[str]:
    """Run the chains; return what has failed."""
    return Soak(session, folder, arguments.minutes).run()


if __name__ == '__main__':
    parser = Parser(__doc__)
    parser.add_argument('--minutes', type=float, default=60.0, help='of the run (default %(default)s)')
    sys.exit(run_live(measure, parser.parse_args()))
