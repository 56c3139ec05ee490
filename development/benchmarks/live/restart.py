#!/usr/bin/python3
"""Measure how soon the chain serves again after a node was killed, or roscore was restarted.

The launch files run, with the player in place of a camera, once in one process and once with detection service and
extractor as two nodes. Each node is killed (SIGKILL) and comes again by respawn: time from the kill to the first of its
results for an image that is newer than the kill, with the second that roslaunch waits. Then roscore ends and is
started again: time from when it answers until everything is registered anew, and until a subscriber that starts then,
`rostopic echo`, has got its first result.
"""
import argparse
import subprocess
import sys
import time
from typing import Any, Callable, Dict, List

import numpy as np
import rosgraph
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray
from sensor_msgs.msg import Image
from visualization_msgs.msg import Marker

from common import Figures, Parser, new_path, run_live
from live.camera import node_process
from openpose_ros_pkg.ros.master.registration import WATCH
from session import Session, wait_for

TIMEOUT = 120.0
RESULTS = '/openpose_ros/skeleton_3d/detected_poses_3d'
MARKERS = '/openpose_ros/skeleton_3d/visualization_markers'
IMAGES = '/kinect2/qhd/image_color'
KINDS: Dict[str, Any] = {RESULTS: PersonDetection_3dArray, MARKERS: Marker, IMAGES: Image}
# Nodes of both forms, and where their results come.
COMMON = {'/kinect2/qhd/rgbd_player_node': IMAGES, '/skeleton_extract_3d_node': RESULTS,
          '/skeleton_extract_3d_visualization_node': MARKERS}
FORMS = {'true': COMMON, 'false': {**COMMON, '/openpose_ros_service_node_3d': RESULTS}}


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--rounds', type=int, default=3, help='how often each is killed (default %(default)s)')
    parser.add_argument('--json', type=new_path, help='write the figures here')
    return parser.parse_args()


class Newest:
    """The newest stamp of each topic."""

    def __init__(self) -> None:
        self.stamps = {topic: rospy.Time() for topic in KINDS}
        for topic, kind in KINDS.items():
            rospy.Subscriber(topic, kind, lambda message, topic=topic:
                             self.stamps.update({topic: message.header.stamp}))

    def seconds(self, topic: str, launch: subprocess.Popen, act: Callable[[], object]) -> float:
        """Do something and return how long it takes until there is a result of a newer image [s]."""
        act()
        began, begin = rospy.Time.from_sec(time.time()), time.monotonic()
        wait_for(lambda: self.stamps[topic] > began, TIMEOUT, f'message on {topic}', launch)
        return time.monotonic() - begin


def restart_master(session: Session, launch: subprocess.Popen) -> List[float]:
    """End roscore, start it again; return the time until all was registered, and a new subscriber served [s]."""
    def registered() -> set:
        state = rosgraph.Master('/restart').getSystemState()
        return {(kind, name) for kind, entries in enumerate(state) for name, _ in entries}
    before = registered()
    session.stop(session.master)
    session.start_master()
    begin = time.monotonic()
    wait_for(lambda: before <= registered(), TIMEOUT, 'registration anew', launch)
    again = time.monotonic() - begin
    subprocess.run(['rostopic', 'echo', '-n', '1', f'{RESULTS}/header'], check=True, stdout=subprocess.DEVNULL,
                   timeout=TIMEOUT)
    return [again, time.monotonic() - begin]


def measure(session: Session, rounds: int) -> Figures:
    """Kill each node of both forms, and roscore, a few times."""
    rospy.init_node('restart', disable_signals=True)
    WATCH.start()
    newest, figures = Newest(), {}
    for form, nodes in FORMS.items():
        launch = session.start('launch', ['roslaunch', '--wait', 'skeleton_extract_3d', 'demo.launch', 'mode:=fast',
                                          f'one_process:={form}', 'camera_height:=1.5'])
        for topic in KINDS:
            newest.seconds(topic, launch, lambda: None)
        found: Dict[str, List[float]] = {node: [] for node in nodes}
        masters = []
        for _ in range(rounds):
            for node, topic in nodes.items():
                found[node].append(newest.seconds(topic, launch, node_process(node).kill))
                newest.seconds(MARKERS, launch, lambda: None)
            masters.append(restart_master(session, launch))
        session.stop(launch)
        again, served = np.median(masters, axis=0)
        figures[f'one_process {form}'] = {
            'from kill to result [s]': {node: {'median': float(np.median(each)), 'greatest': max(each)}
                                        for node, each in found.items()},
            'from roscore to all registered, median [s]': again, 'and a new subscriber served, median [s]': served,
            'greatest [s]': float(np.max(masters))}
    return figures


def main() -> int:
    """Run the benchmark; return the exit status."""
    arguments = parse_arguments()
    return run_live(lambda session, folder: measure(session, arguments.rounds), arguments.json)


if __name__ == '__main__':
    sys.exit(main())
