#!/usr/bin/python3
"""Measure the running 2D system: rate of results against the rate of the bare network, and where the time goes.

Starts the service node in stream mode and a camera stand-in that publishes images from memory, on a ROS master of its
own. The bare network is the same detector in a process of its own that computes prepared images one after the other
while the service node is stopped (SIGSTOP) and the camera goes on, its images received by that process as by the
service node. Both are measured in turn, A-B-A-B, so that a machine that is faster or slower for a while does so for
both.

Memory and processor of each node are noted in each round: --frames 10000 is the soak test. --clients N adds N processes
that call the service at --client-rate each; then their answers are measured instead. T: one f32 pass of mobilenet_thin
at 656 x 368 on two threads, before and after the run, while nothing else of it is at work.

    ./run bench live_2d --people 1 2 5 8 target_rate:=30      # the table of docs/accuracy_and_speed.md
    ./run bench live_2d --frames 10000 --rounds 1 target_rate:=30
"""
import argparse
import itertools
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

import cv2
import numpy as np
import pandas as pd
import psutil
import rospy
import yaml
from openpose_ros_msgs.msg import PersonDetectionArray, Timing
from openpose_ros_msgs.srv import GetPersons
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from common import DEMO, ROOT, Figures, Parser, Usage, markdown, new_path, run_live
from live.camera import Unit
from live.crowd import make_crowd
from live.figures import by_stage
from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.ros.session import ResultWatch, Session, wait_for
from openpose_ros_pkg.ros.timing_report import WINDOW

NODE = 'openpose_ros_service_node'
TOPIC = '/camera/image_raw'
RESULTS = '/openpose_ros/detected_poses'
START_TIMEOUT = 90.0
SETTLING = 1.0  # [s] after the processes change turns
MEMORY_SAMPLES = 8
STAGES = ('decode_message', 'preprocess', 'wait_for_network', 'network', 'decode', 'publish')
COLUMNS = ('camera [Hz]', 'people', 'T [ms]', 'results [Hz]', 'bare networks [Hz]', 'ratio', 'latency, median [ms]',
           'stages, medians [ms]', 'service node [% of a core]', 'memory [MB]', 'start to first answer [s]')


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--rounds', type=int, default=4, help='of service and bare network (default %(default)s)')
    parser.add_argument('--seconds', type=float, default=10.0, help='of each in a round (default %(default)s)')
    parser.add_argument('--frames', type=int, default=0,
                        help='soak: then go on in stream mode until this many results came (default: not)')
    parser.add_argument('--rates', type=float, nargs='+', default=[30.0], help='of the camera [Hz] (default: 30)')
    parser.add_argument('--rate', type=float, help=argparse.SUPPRESS)
    parser.add_argument('--people', type=int, nargs='+', default=[2], choices=range(1, 9), metavar='1..8',
                        help='in its images, each a row of the table (default: 2)')
    parser.add_argument('--folder', type=Path, default=DEMO, help=argparse.SUPPRESS)
    parser.add_argument('--clients', type=int, default=0, help='processes that call the service (default %(default)s)')
    parser.add_argument('--client-rate', type=float, default=10.0, help='of each [Hz] (default %(default)s)')
    parser.add_argument('--no-stream', action='store_true', help='only the clients, no stream and no camera')
    parser.add_argument('--draw', action='store_true', help='subscribe to the annotated image as well')
    parser.add_argument('--json', type=new_path, help='write the figures here')
    parser.add_argument('--role', choices=('camera', 'bare', 'client'), help=argparse.SUPPRESS)
    parser.add_argument('--name', default='', help=argparse.SUPPRESS)
    parser.add_argument('parameters', nargs='*', metavar='NAME:=VALUE', help='parameters of the service node')
    arguments = parser.parse_named('parameters')
    if arguments.no_stream and not arguments.clients:
        parser.error('--no-stream needs --clients')
    return arguments


# -------------------------------------------------------------------------------------------- child processes

def images(folder: Path) -> List[np.ndarray]:
    """Return the images that the camera shows, forth and back, (H, W, 3) uint8 BGR."""
    forth = [cv2.imread(str(path)) for path in sorted((folder / 'rgb').glob('*.jpg'))]
    return forth + forth[-2:0:-1]


def run_camera(arguments: argparse.Namespace) -> None:
    """Publish images from memory, as a camera driver does."""
    rospy.init_node('camera')
    publisher = rospy.Publisher(TOPIC, Image, queue_size=1)
    messages = [bgr_to_image(bgr, Header(frame_id='camera')) for bgr in images(arguments.folder)]
    begin, number = time.monotonic(), 0
    while not rospy.is_shutdown():
        message = messages[number % len(messages)]
        message.header.stamp = rospy.Time.now()
        publisher.publish(message)
        number += 1
        time.sleep(max(0.0, begin + number / arguments.rate - time.monotonic()))


def run_bare(arguments: argparse.Namespace) -> None:
    """Compute prepared images one after the other; print when each computation ended [s], time.monotonic()."""
    rospy.init_node('bare_network')
    settings = build(ServiceSettings, given_parameters(arguments))
    stream = NetworkDetection(create_detector(settings.detector), settings.tracking, settings.following)
    subscriber = rospy.Subscriber(TOPIC, rospy.AnyMsg, queue_size=1)
    prepared = [stream.prepare(ImageFrame('camera', time.time(), bgr)) for bgr in images(arguments.folder)]
    for one in itertools.cycle(prepared):
        if rospy.is_shutdown():
            break
        stream.compute(replace(one, frame=replace(one.frame, stamp=time.time())))
        print(time.monotonic(), flush=True)
    subscriber.unregister()


def run_client(arguments: argparse.Namespace) -> None:
    """Call the service at a rate, or as fast as it answers; print the end and the duration of each call [s]."""
    rospy.init_node(arguments.name)
    detect = rospy.ServiceProxy('detect_poses', GetPersons)
    messages = [bgr_to_image(bgr, Header(frame_id=arguments.name)) for bgr in images(arguments.folder)]
    next_call = time.monotonic()
    while not rospy.is_shutdown():
        message = messages[0]
        message.header.stamp = rospy.Time.now()
        begin = time.monotonic()
        detect(message)
        end = time.monotonic()
        print(end, end - begin, flush=True)
        next_call = max(next_call + 1 / arguments.client_rate, end)
        time.sleep(next_call - end)


def given_parameters(arguments: argparse.Namespace) -> Dict[str, Any]:
    """Return the parameters of the command line, with values as ROS reads them."""
    return {key: yaml.safe_load(value) for key, value in (text.split(':=', 1) for text in arguments.parameters)}


# ------------------------------------------------------------------------------------------------ measurement

class Bench:
    """The nodes of one run."""

    def __init__(self, session: Session, folder: Path, arguments: argparse.Namespace) -> None:
        self._session, self._folder, self._arguments = session, folder, arguments
        self._timing: Optional[Timing] = None

    def child(self, role: str, name: str) -> subprocess.Popen:
        """Start this program in another role; what it prints goes to <name>.txt."""
        arguments = self._arguments
        command = [sys.executable, __file__, f'--role={role}', f'--name={name}', f'--rate={arguments.rate}',
                   f'--folder={arguments.folder}', f'--client-rate={arguments.client_rate}', *arguments.parameters]
        return self._session.start(name, command, self._folder / f'{name}.txt')

    def printed(self, name: str, begin: float, end: float) -> np.ndarray:
        """Return what a child printed within a time, one row per line whose first number is the time."""
        rows = [[float(value) for value in line.split()] for line
                in (self._folder / f'{name}.txt').read_text().splitlines(True) if line.endswith('\n')]
        return np.array([row for row in rows if begin <= row[0] <= end])

    def run(self) -> Figures:
        """Run everything and return the figures."""
        arguments = self._arguments
        figures: Figures = {'arguments': {key: str(value) for key, value in vars(arguments).items()}}
        processes = {}
        if not arguments.no_stream:
            self._camera = processes['camera'] = self.child('camera', 'camera')
        begin = time.monotonic()
        results = ResultWatch(RESULTS, PersonDetectionArray)
        service = self._start_service()
        processes[NODE] = service
        if arguments.no_stream:
            rospy.wait_for_service('detect_poses', START_TIMEOUT)
            rospy.ServiceProxy('detect_poses', GetPersons)(bgr_to_image(images(arguments.folder)[0], Header()))
        else:
            wait_for(lambda: results.arrivals, START_TIMEOUT, 'first result', service)
        figures['first_answer_s'] = time.monotonic() - begin
        listeners = [rospy.Subscriber(f'/{NODE}/timing', Timing, self._keep_timing, queue_size=1)]
        if arguments.draw:
            listeners.append(rospy.Subscriber('/openpose_ros/detected_poses_image', rospy.AnyMsg, queue_size=1))
        watched = {name: psutil.Process(process.pid) for name, process in processes.items()}
        clients = [f'client_{number}' for number in range(arguments.clients)]
        for name in clients:
            watched[name] = psutil.Process(self.child('client', name).pid)
        if clients:
            figures['clients'] = self._measure_clients(clients, service)
        else:
            figures['rounds'] = self._measure_rounds(service, results)
            figures['medians'] = pd.DataFrame(figures['rounds']).median().to_dict()
        watch = Usage(watched)
        # what the timing report still holds of before has to leave its window
        time.sleep(max(arguments.seconds, WINDOW + 3 * SETTLING))
        figures['processor_percent_of_a_core'] = watch.processor()
        figures['memory_mb'] = watch.memory()
        figures['stages_ms'] = {stage.stage: {'p50': stage.p50, 'p95': stage.p95, 'count': stage.count}
                                for stage in self._timing.stages if stage.count} if self._timing else {}
        if arguments.frames:
            figures['soak'] = self._soak(results, watch, service)
        for subscriber in listeners:
            subscriber.unregister()
        results.stop()
        for process in (service, *([] if arguments.no_stream else [self._camera])):
            self._session.stop(process)
        return figures

    def _start_service(self) -> subprocess.Popen:
        stream = [] if self._arguments.no_stream else [f'_image_topic:={TOPIC}']
        parameters = [f'_{text}' for text in self._arguments.parameters]
        # the script itself, not rosrun, so that the process can be stopped and measured
        script = ROOT / 'openpose_ros_pkg' / 'scripts' / 'openpose_ros_node'
        return self._session.start(NODE, [sys.executable, str(script), f'__name:={NODE}', *stream, *parameters])

    def _keep_timing(self, message: Timing) -> None:
        self._timing = message

    def _measure_rounds(self, service: subprocess.Popen, results: ResultWatch) -> List[Dict[str, float]]:
        """Measure service and bare network in turn."""
        bare = self.child('bare', 'bare')
        wait_for(lambda: (self._folder / 'bare.txt').stat().st_size > 0, START_TIMEOUT, 'bare network', bare)
        rounds = []
        for _ in range(self._arguments.rounds):
            os.kill(bare.pid, signal.SIGSTOP)
            os.kill(service.pid, signal.SIGCONT)
            begin, end = self._wait()
            arrivals = np.array([t for t in results.arrivals if begin <= t <= end])
            latencies = [latency for t, latency in zip(results.arrivals, results.latencies) if begin <= t <= end]
            os.kill(service.pid, signal.SIGSTOP)
            os.kill(bare.pid, signal.SIGCONT)
            begin, end = self._wait()
            computed = self.printed('bare', begin, end)[:, 0]
            rounds.append({'results_hz': rate(arrivals), 'bare_network_hz': rate(computed),
                           'ratio': rate(arrivals) / rate(computed),
                           'age_median_ms': 1000 * float(np.median(latencies))})
            print('service {results_hz:5.2f} Hz   bare network {bare_network_hz:5.2f} Hz   ratio {ratio:.3f}   '
                  'latency {age_median_ms:.0f} ms'.format(**rounds[-1]), flush=True)
        self._session.stop(bare)
        os.kill(service.pid, signal.SIGCONT)
        return rounds

    def _measure_clients(self, names: Sequence[str], service: subprocess.Popen) -> Dict[str, Dict[str, float]]:
        """Measure the clients for a round each."""
        wait_for(lambda: all((self._folder / f'{name}.txt').stat().st_size for name in names), START_TIMEOUT,
                 'answers to all clients', service)
        begin, end = self._wait()
        clients = {}
        for name in names:
            rows = self.printed(name, begin, end)
            clients[name] = {'answers': len(rows), 'rate_hz': rate(rows[:, 0]),
                             'duration_median_ms': 1000 * float(np.median(rows[:, 1])),
                             'duration_p95_ms': 1000 * float(np.percentile(rows[:, 1], 95))}
            print('{name}: {answers} answers, {rate_hz:.2f} Hz, duration median {duration_median_ms:.0f} ms, '
                  'p95 {duration_p95_ms:.0f} ms'.format(name=name, **clients[name]), flush=True)
        return clients

    def _wait(self) -> Sequence[float]:
        """Return begin and end of the time to measure in, which starts when the processes have settled."""
        time.sleep(SETTLING)
        begin = time.monotonic()
        time.sleep(self._arguments.seconds)
        return begin, time.monotonic()

    def _soak(self, results: ResultWatch, watch: Usage, service: subprocess.Popen) -> List[Dict[str, Any]]:
        """Let the stream go on for the given number of results; note memory and processor as it goes."""
        first, samples = len(results.arrivals), []
        for share in range(MEMORY_SAMPLES + 1):
            frames = self._arguments.frames * share // MEMORY_SAMPLES
            wait_for(lambda frames=frames: len(results.arrivals) - first >= frames, 3600.0, 'next results', service)
            samples.append({'frames': frames, 'memory_mb': watch.memory(), 'processor': watch.processor()})
            print(f'{frames:6d} results: ' + '  '.join(f'{name} {memory:.0f} MB' for name, memory
                                                       in samples[-1]['memory_mb'].items()), flush=True)
        return samples


def rate(times: np.ndarray) -> float:
    """Return events per second, NaN with less than two."""
    return (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else float('nan')


def table_row(figures: Figures) -> List[object]:
    """Return the cells of COLUMNS."""
    medians, stages = figures['medians'], {name: each['p50'] for name, each in figures['stages_ms'].items()}
    processor, memory = (figures[key][NODE] for key in ('processor_percent_of_a_core', 'memory_mb'))
    return [figures['camera_hz'], figures['people'], ' - '.join(f'{each:.0f}' for each in figures['T_ms']),
            f"{medians['results_hz']:.1f}", f"{medians['bare_network_hz']:.1f}", f"{medians['ratio']:.2f}",
            f"{medians['age_median_ms']:.0f}", by_stage(stages, STAGES)[0],
            f'{processor:.0f}', f'{memory:.0f}', f"{figures['first_answer_s']:.1f}"]


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> Figures:
    """Measure each rate and number of people; print the table where a camera plays."""
    rospy.init_node('live_2d', disable_signals=True)
    rows, unit = [], Unit()
    for people, rate in itertools.product(arguments.people, arguments.rates):
        arguments.rate = rate
        arguments.folder = folder / f'crowd_{people}'
        if not arguments.folder.is_dir():
            arguments.folder = make_crowd(people, arguments.folder)
        before = unit.milliseconds()
        row = Bench(session, folder, arguments).run()
        rows.append({'people': people, 'camera_hz': rate, 'T_ms': [before, unit.milliseconds()], **row})
    if not arguments.clients:
        print('\n' + markdown([COLUMNS, *map(table_row, rows)]), flush=True)
    return {'rows': rows}


def main() -> int:
    """Run the benchmark or one of its child processes; return the exit status."""
    arguments = parse_arguments()
    roles = {'camera': run_camera, 'bare': run_bare, 'client': run_client}
    if arguments.role:
        try:
            roles[arguments.role](arguments)
        except (rospy.ROSException, rospy.ServiceException) as error:
            print(error, file=sys.stderr)
        return 0
    return run_live(lambda session, folder: measure(session, folder, arguments), arguments.json)


if __name__ == '__main__':
    sys.exit(main())
