"""Running nodes: a camera driver that plays sequences, watched results."""
import argparse
import contextlib
import io
import subprocess
import time
import xmlrpc.client
from pathlib import Path
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import psutil
import rosnode
import rospy
from openpose_ros_msgs.msg import Timing

from openpose_ros_tools.ros import images_to_bag
from session import ResultWatch, Session, wait_for

NAMESPACE = '/kinect2/qhd'
# What the driver publishes, by the points that the chain reads.
TOPICS = {'depth_image': 'image_color camera_info image_depth_rect', 'point_cloud': 'image_color points'}
PEOPLE_3D = '/openpose_ros/skeleton_3d/detected_poses_3d'
START_TIMEOUT = 240.0


def make_bag(sequence: Path, bag: Path, cloud: bool = True) -> Path:
    """Write a sequence folder into a bag for the driver; return the bag."""
    with contextlib.redirect_stdout(io.StringIO()):
        status = images_to_bag.main([str(sequence), '-o', str(bag), '--overwrite', *(['--cloud'] if cloud else [])])
    if status:
        raise OSError(f'{sequence} could not be written into {bag}')
    return bag


def start_camera(session: Session, bag: Path, rate: float, stamps: Optional[Path] = None,
                 names: Tuple[str, str] = ('camera', NAMESPACE), **parameters: object) -> 'subprocess.Popen[bytes]':
    """Start the driver; return its process. See bag_camera.cpp for the parameters.

    Args:
        stamps: file for `played_stamps`; None: beside the bag.
        names: of the node, and namespace of the topics.
    """
    node, namespace = names
    topics = {*TOPICS['depth_image'].split(), *TOPICS['point_cloud'].split()}
    return session.start(node, ['rosrun', 'openpose_ros_nodelets', 'bag_camera', f'__name:={node}', f'_bag:={bag}',
                                f'_rate:={rate}', *(f'_{key}:={value}' for key, value in parameters.items()),
                                *(f'{NAMESPACE}/{topic}:={namespace}/{topic}' for topic in topics)],
                         stamps or bag.with_suffix('.txt'))


def played_stamps(stamps: Path) -> List[int]:
    """Return the stamps of the frames that a driver has published to a subscriber until now [ns]."""
    lines = stamps.read_text().splitlines(keepends=True)
    return [int(line) for line in lines if line.endswith('\n') and line.strip().isdigit()]  # others are the log's


def node_processes() -> Dict[str, psutil.Process]:
    """Return the process of each node but for this one."""
    return {name: node_process(name) for name in rosnode.get_node_names()
            if name not in ('/rosout', rospy.get_name())}


def node_process(name: str) -> psutil.Process:
    """Return the process of a node.

    Raises:
        OSError: it does not answer.
    """
    node = xmlrpc.client.ServerProxy(rospy.get_master().lookupNode(name)[2])
    return psutil.Process(node.getPid(rospy.get_name())[2])


class Watched(NamedTuple):
    """Results of nodes in some seconds.

    Attributes:
        start: from their start to the first result [s].
        arrivals, latencies, people: time [s], delay [s] and people of each result.
        processor, memory: of each node [% of a core], [MB].
        stages: mean of each stage [ms].
    """

    start: float
    seconds: float
    arrivals: np.ndarray
    latencies: np.ndarray
    people: np.ndarray
    processor: Dict[str, float]
    memory: Dict[str, float]
    stages: Dict[str, float]


def watch_nodes(session: Session, command: List[str], watch: ResultWatch, options: argparse.Namespace,
                timing: str) -> Watched:
    """Start nodes, and watch their results for a while after they have warmed up; end them.

    Args:
        options: of `Parser.add_live`.
        timing: topic of the stages.
    """
    began = time.monotonic()
    nodes = session.start('nodes', command)
    wait_for(lambda: watch.arrivals, START_TIMEOUT, 'first results', nodes)
    start = time.monotonic() - began
    time.sleep(options.warm_up)
    processes = node_processes()
    for process in processes.values():
        process.cpu_percent()  # begins to count
    first, begin = len(watch.arrivals), time.monotonic()
    time.sleep(options.seconds)
    last, seconds = len(watch.arrivals), time.monotonic() - begin
    processor = {node: process.cpu_percent() for node, process in processes.items()}
    memory = {node: process.memory_info().rss / 1e6 for node, process in processes.items()}
    stages = rospy.wait_for_message(timing, Timing, START_TIMEOUT)
    watch.stop()
    session.stop(nodes)
    series = (np.array(getattr(watch, name)[first:last]) for name in ('arrivals', 'latencies', 'people'))
    return Watched(start, seconds, *series, processor, memory, {stage.stage: stage.mean for stage in stages.stages})


def by_node(values: Mapping[str, float]) -> str:
    """Return a figure of each node as text."""
    return ', '.join(f'{name.strip("/")} {value:.0f}' for name, value in values.items())


def median_and_95(seconds: Sequence[float]) -> str:
    """Return median and 95th percentile of times [s] in ms, as text."""
    return ' / '.join(f'{1e3 * value:.0f}' for value in np.percentile(seconds, (50, 95))) if len(seconds) else '-'
