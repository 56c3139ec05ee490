"""The nodes that find people, by what they report on /diagnostics."""
import re
from dataclasses import replace
from typing import Dict, List, Mapping, Sequence, Tuple

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import CompressedImage, Image

from openpose_ros_bringup.doctor.snapshot import ChainNode
from openpose_ros_bringup.ros.doctor.network import private_parameters
from openpose_ros_pkg.ros.demand import READS
from openpose_ros_pkg.stream.silent_topic import PublishedTopic

_RESULTS = re.compile(r'(.*/)openpose_ros/(skeleton_3d/detected_poses_3d|detected_poses|skeleton_3d/detected_poses)')
# Names that the launch files give these nodes.
NAMES = ('skeleton_extract_3d_node', 'openpose_ros_service_node', 'openpose_ros_service_node_3d')
# Types of colour images.
IMAGES = (Image._type, CompressedImage._type)
# Entries of `READS`: topic and type of an input.
_INPUT = re.compile(r'(\S+) \((\S+)\)')


class StatusListener:
    """Keeps the newest status of each node that finds people."""

    def __init__(self) -> None:
        self._statuses: Dict[str, Tuple[str, ChainNode]] = {}  # the node, and its status, by the name of the status
        self.subscriber = rospy.Subscriber('/diagnostics', DiagnosticArray, self._store, queue_size=100)

    def nodes(self) -> List[str]:
        """Return the nodes that sent a status."""
        return [node for node, _ in list(self._statuses.values())]

    def read(self, published: Mapping[str, PublishedTopic]) -> List[ChainNode]:
        """Return the nodes with their status, parameters and the topic of their people."""
        found = []
        for name, (node, status) in sorted(self._statuses.copy().items()):
            results = sorted(topic for topic, there in published.items() if node in there.nodes
                             and _RESULTS.fullmatch(topic))
            own = [topic for topic in results if topic.startswith(f"{name.rpartition('/')[0]}/openpose_ros/")]
            found.append(replace(status, parameters=private_parameters(node), results=(own or results or [''])[-1]))
        return found

    def _store(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
            if any(kind in IMAGES and '/openpose_ros/' not in topic  # these are shown, as in browsers
                   for topic, kind in _INPUT.findall(values.get(READS, ''))):
                # the updater writes <node>: <name>, which is another one for each camera of a node
                node, name = (f'/{each.strip("/")}' for each in status.name.partition(': ')[::2])
                self._statuses[name] = node, ChainNode(name, level, status.message, values)


def inputs_of(node: ChainNode) -> Sequence[Tuple[str, str]]:
    """Return topics and types that a node reads."""
    return _INPUT.findall(node.values[READS])


def nodes_with_results(published: Mapping[str, PublishedTopic]) -> List[str]:
    """Return the nodes that publish people."""
    return sorted({node for topic, there in published.items() if _RESULTS.fullmatch(topic) for node in there.nodes})
