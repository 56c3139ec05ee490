"""The master and the nodes registered there."""
from contextlib import suppress
from typing import Any, Dict, Mapping, NamedTuple, Sequence, Tuple

import rosgraph
from rosgraph.network import parse_http_host_and_port

from openpose_ros_bringup.doctor.snapshot import Master
from openpose_ros_pkg.ros.master.calls import CALL_ERRORS, call_master, publications, takes_connections
from openpose_ros_pkg.stream.silent_topic import PublishedTopic


class Graph(NamedTuple):
    """What the master knows: topics with their publishers, and with the names of their subscribers."""

    published: Mapping[str, PublishedTopic]
    subscribed: Mapping[str, Sequence[str]]

    @property
    def nodes(self) -> Sequence[str]:
        """All nodes: each publishes its log."""
        return self.published['/rosout'].nodes if '/rosout' in self.published else ()


def read_master() -> Tuple[Master, Graph]:
    """Return the state of the master; of one that does not answer, that."""
    uri = rosgraph.get_master_uri()
    try:
        (_, _, state), (_, _, types), (code, _, sim_time) = call_master(
            [('getSystemState',), ('getTopicTypes',), ('getParam', '/use_sim_time')])
    except CALL_ERRORS:
        return Master(uri, is_online=False), Graph({}, {})
    return Master(uri, sim_time=code == 1 and bool(sim_time)), Graph(publications(state, types), dict(state[1]))


def private_parameters(node: str) -> Dict[str, Any]:
    """Return the private parameters of a node; none where the master does not answer."""
    with suppress(*CALL_ERRORS):
        (code, _, values), = call_master([('getParam', node)])
        return values if code == 1 and isinstance(values, dict) else {}
    return {}


def unreachable(nodes: Sequence[str]) -> Dict[str, str]:
    """Return those of the nodes that take no connections, with the URIs at which they are registered."""
    found = {}
    with suppress(*CALL_ERRORS, ValueError):
        for node in nodes:
            (code, _, uri), = call_master([('lookupNode', node)])
            if code == 1 and not takes_connections(parse_http_host_and_port(uri)):
                found[node] = uri
    return found
