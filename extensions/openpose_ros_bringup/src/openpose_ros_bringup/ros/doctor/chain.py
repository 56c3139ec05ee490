"""The nodes that find people, by what they report on /diagnostics."""
import re
import time
from typing import Dict, List, Mapping, NamedTuple, Sequence, Tuple

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import CompressedImage, Image

from openpose_ros_bringup.doctor.snapshot import ChainNode
from openpose_ros_bringup.ros.doctor.network import Graph, private_parameters
from openpose_ros_bringup.ros.record_camera import RECORDS
from openpose_ros_pkg.ros.demand import READS
from openpose_ros_pkg.stream.silent_topic import PublishedTopic

_RESULTS = re.compile(r'(.*/)openpose_ros/(skeleton_3d/detected_poses_3d|detected_poses|skeleton_3d/detected_poses)')
# Names that the launch files give these nodes.
_NAMES = ('skeleton_extract_3d_node', 'openpose_ros_service_node', 'openpose_ros_service_node_3d')
# Types of colour images.
IMAGES = (Image._type, CompressedImage._type)
# Entries of `READS`: topic and type of an input.
_INPUT = re.compile(r'(\S+) \((\S+)\)')


class Status(NamedTuple):
    """A status of a node in /diagnostics: when it came [s], the node, level, text and values."""

    received: float
    node: str
    level: int
    text: str
    values: Mapping[str, str]


class StatusListener:
    """Keeps the first and the newest status of each node that finds people, and level, text and folder of recorders."""

    def __init__(self) -> None:
        self._statuses: Dict[str, List[Status]] = {}
        self.recorders: Dict[str, Tuple[int, str, str]] = {}
        self._subscriber = rospy.Subscriber('/diagnostics', DiagnosticArray, self._store, queue_size=100)

    def stop(self) -> None:
        """Listen no more."""
        self._subscriber.unregister()

    def nodes(self) -> List[str]:
        """Return the nodes that sent a status."""
        return [newest.node for _, newest in list(self._statuses.values())]

    def read(self, published: Mapping[str, PublishedTopic]) -> List[ChainNode]:
        """Return the nodes by their status."""
        return [_chain_node(name, first, newest, published)
                for name, (first, newest) in sorted(self._statuses.copy().items())]

    def _store(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
            if RECORDS in values:
                self.recorders[status.name] = level, status.message, values[RECORDS]
            if any(kind in IMAGES and '/openpose_ros/' not in topic  # these are shown, as in browsers
                   for topic, kind in _INPUT.findall(values.get(READS, ''))):
                # the updater writes <node>: <name>, which is another one for each camera of a node
                node, _, name = status.name.partition(': ')
                newest = Status(time.monotonic(), f'/{node.strip("/")}', level, status.message, values)
                first = self._statuses.get(f'/{name.strip("/")}', [newest])[0]
                self._statuses[f'/{name.strip("/")}'] = [first, newest]


def inputs_of(node: ChainNode) -> Sequence[Tuple[str, str]]:
    """Return topics and types that a node reads."""
    return _INPUT.findall(node.values[READS])


def nodes_with_results(published: Mapping[str, PublishedTopic]) -> List[str]:
    """Return the nodes that publish people."""
    return sorted({node for topic, there in published.items() if _RESULTS.fullmatch(topic) for node in there.nodes})


def starting_nodes(graph: Graph) -> List[str]:
    """Return the nodes with names of nodes that publish people, which publish none yet."""
    return sorted({node for node in graph.nodes if node.rpartition('/')[2] in _NAMES}
                  - set(nodes_with_results(graph.published)))


def _chain_node(name: str, first: Status, newest: Status, published: Mapping[str, PublishedTopic]) -> ChainNode:
    skipped = [float(status.values.get('frames skipped', status.values.get('images skipped', 0)))
               for status in (first, newest)]
    seconds = newest.received - first.received
    results = sorted(topic for topic, there in published.items() if newest.node in there.nodes
                     and _RESULTS.fullmatch(topic))
    own = [topic for topic in results if topic.startswith(f"{name.rpartition('/')[0]}/openpose_ros/")] or results
    return ChainNode(name, newest.level, newest.text, newest.values,
                     (skipped[1] - skipped[0]) / seconds if seconds > 0 else 0.0, private_parameters(newest.node),
                     own[-1] if own else '')
