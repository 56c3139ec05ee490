#!/usr/bin/python3
"""Measure the fusion node live: rate, latency and processor for simulated people before several cameras.

Cameras around a room send people who walk there, with noise, as extractors would; the fusion node and its timing are
watched from outside. The simulation runs in this process and takes its part of the processor, which is told too.
"""
import argparse
import sys
import threading
import time
from pathlib import Path
from typing import List

import numpy as np
import psutil
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, Timing
from std_msgs.msg import Header

from common import Figures, Parser, Usage, new_path, run_live
from live.camera import node_process
from openpose_ros_fusion.rig import Rig, rig_camera, rig_text
from session import ResultWatch, Session, wait_for
from simulated_rig import Room, SimulatedCamera, around, walking
from skeleton_extract_3d.ros import convert

OUTPUT = 'openpose_ros/skeleton_3d/detected_poses_3d'
NODE = '/people/people_fusion_node'
TIMEOUT, SETTLING = 60.0, 5.0


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--cameras', type=int, default=4, help='(default %(default)s)')
    parser.add_argument('--people', type=int, nargs='+', default=[1, 3, 5], help='(default 1 3 5)')
    parser.add_argument('--rate', type=float, default=30.0, help='of each camera [Hz] (default %(default)s)')
    parser.add_argument('--seconds', type=float, default=20.0, help='for each number (default %(default)s)')
    parser.add_argument('--json', type=new_path, help='write the figures here')
    return parser.parse_args()


class Player(threading.Thread):
    """Sends what cameras see at a rate, all at the same time, until `stop`."""

    def __init__(self, room: Room, cameras: List[SimulatedCamera], rate: float) -> None:
        super().__init__(daemon=True)
        self._room, self._cameras, self._period = room, cameras, 1 / rate
        self._publishers = [rospy.Publisher(f'/{camera.name}/{OUTPUT}', PersonDetection_3dArray, queue_size=2)
                            for camera in cameras]
        self._ended = threading.Event()
        self.sent = 0

    def run(self) -> None:
        begin = time.monotonic()
        while not self._ended.is_set():
            now = begin + self.sent * self._period
            self._ended.wait(max(now - time.monotonic(), 0))
            header = Header(stamp=rospy.Time.now())
            for camera, publisher in zip(self._cameras, self._publishers):
                header.frame_id = camera.name
                publisher.publish(convert.people_to_array(camera.people(self._room, now - begin), header))
            self.sent += 1

    def stop(self) -> None:
        """End it."""
        self._ended.set()
        self.join()


def measure_people(session: Session, folder: Path, arguments: argparse.Namespace, people: int) -> Figures:
    """Return the figures for a number of people."""
    cameras = list(around(arguments.cameras))
    rig = folder / 'rig.yaml'
    rig.write_text(rig_text(Rig('room', tuple(rig_camera(camera.name, camera.name, camera.pose)
                                              for camera in cameras))))
    launch = session.start('fusion', ['roslaunch', '--wait', 'openpose_ros_fusion', 'people_fusion.launch',
                                      f'rig:={rig}', f"cameras:={' '.join(camera.name for camera in cameras)}",
                                      'markers:=false'])
    player = Player(walking(arguments.seconds + 2 * SETTLING + TIMEOUT, people), cameras, arguments.rate)
    player.start()
    timings: List[Timing] = []
    rospy.Subscriber(f'{NODE}/timing', Timing, timings.append)
    watch = ResultWatch(f'/people/{OUTPUT}', PersonDetection_3dArray)
    wait_for(lambda: len(watch.arrivals) > SETTLING * arguments.rate, TIMEOUT, 'fused people', launch)
    watch.stop()
    watch = ResultWatch(f'/people/{OUTPUT}', PersonDetection_3dArray)
    usage, sent = Usage({'node': node_process(NODE), 'simulation': psutil.Process()}), player.sent
    begin = time.monotonic()
    time.sleep(arguments.seconds)
    seconds, processor, sent = time.monotonic() - begin, usage.processor(), player.sent - sent
    watch.stop()
    player.stop()
    session.stop(launch)
    stages = {stage.stage: round(stage.p50, 2) for stage in timings[-1].stages}
    return {'people': people, 'frames sent [Hz]': sent / seconds, 'results [Hz]': len(watch.arrivals) / seconds,
            'people found': float(np.mean(watch.people)), 'latency, median [ms]': 1e3 * watch.latency,
            'latency, 95 % [ms]': 1e3 * float(np.percentile(watch.latencies, 95)),
            'processor [% of a core]': processor,
            'stages, median [ms]': stages}


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> Figures:
    """Measure all numbers of people."""
    rospy.init_node('live_fusion', disable_signals=True)
    rows = [measure_people(session, folder, arguments, people) for people in arguments.people]
    return {f'{arguments.cameras} cameras at {arguments.rate:g} Hz': rows}


def main() -> int:
    """Run the benchmark; return the exit status."""
    arguments = parse_arguments()
    return run_live(lambda session, folder: measure(session, folder, arguments), arguments.json)


if __name__ == '__main__':
    sys.exit(main())
