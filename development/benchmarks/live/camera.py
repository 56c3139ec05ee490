"""A camera driver in C++ that plays sequences, the time of a network alone, and the processes of the running nodes."""
import contextlib
import io
import statistics
import subprocess
import xmlrpc.client
from pathlib import Path
from typing import Dict, List, Mapping, Optional, Sequence

import psutil
import rosnode
import rospy

from openpose_ros_tools.ros import images_to_bag
from session import Session
from speed_2d import detector_for, image_of

NAMESPACE = '/kinect2/qhd'
# What the driver publishes, by the points that the extractor reads.
TOPICS = {'depth_image': 'image_color camera_info image_depth_rect', 'point_cloud': 'image_color points'}
_PASSES = 15


def make_bag(sequence: Path, bag: Path, cloud: bool = True) -> Path:
    """Write a sequence folder into a bag for the driver; return the bag."""
    with contextlib.redirect_stdout(io.StringIO()):
        status = images_to_bag.main([str(sequence), '-o', str(bag), '--overwrite', *(['--cloud'] if cloud else [])])
    if status:
        raise OSError(f'{sequence} could not be written into {bag}')
    return bag


def start_camera(session: Session, bag: Path, rate: float, stamps: Optional[Path] = None,
                 remap: Optional[Mapping[str, str]] = None, **parameters: object) -> 'subprocess.Popen[bytes]':
    """Start the driver; return its process. See bag_camera.cpp for the parameters.

    Args:
        stamps: file for `played_stamps`; None: beside the bag.
        remap: other names for topics, and for the node (__name).
    """
    remap = {'__name': 'camera', **(remap or {})}
    return session.start(remap['__name'], ['rosrun', 'openpose_ros_nodelets', 'bag_camera', f'_bag:={bag}',
                                           f'_rate:={rate}', *(f'{key}:={value}' for key, value in remap.items()),
                                           *(f'_{key}:={value}' for key, value in parameters.items())],
                         stamps or bag.with_suffix('.txt'))


def played_stamps(stamps: Path) -> List[int]:
    """Return the stamps of the frames that a driver has published to somebody until now [ns]."""
    lines = stamps.read_text().splitlines(keepends=True)
    return [int(line) for line in lines if line.endswith('\n') and line.strip().isdigit()]  # others are the log's


def start_cloud_to_depth(session: Session) -> None:
    """Load the nodelet into the driver."""
    session.start('cloud_to_depth', ['roslaunch', 'openpose_ros_nodelets', 'cloud_to_depth.launch', 'manager:=/camera'])


def node_processes() -> Dict[str, psutil.Process]:
    """Return the process of each node but for this one."""
    processes = {}
    for name in rosnode.get_node_names():
        if name not in ('/rosout', rospy.get_name()):
            processes[name] = node_process(name)
    return processes


def node_process(name: str) -> psutil.Process:
    """Return the process of a node.

    Raises:
        OSError: it does not answer.
    """
    node = xmlrpc.client.ServerProxy(rospy.get_master().lookupNode(name)[2])
    return psutil.Process(node.getPid(rospy.get_name())[2])


class Unit:
    """T: one pass of mobilenet_thin at 656 x 368 in f32 on two threads, to compare machines by."""

    def __init__(self) -> None:
        self._detector = detector_for('auto', '656x368', 2, 'mobilenet_thin')
        self._frame = self._detector.prepare(image_of(2))
        self.milliseconds()

    def milliseconds(self) -> float:
        """Return the median of some passes [ms]; nothing else should be at work."""
        times: Sequence[float] = [1e3 * self._detector.compute(self._frame).network_seconds for _ in range(_PASSES)]
        return statistics.median(times)
