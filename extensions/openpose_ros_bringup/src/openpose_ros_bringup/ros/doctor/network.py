"""The master, the nodes registered there, and this machine."""
import os
import socket
from contextlib import suppress
from pathlib import Path
from typing import Any, Dict, Mapping, NamedTuple, Sequence, Tuple
from urllib.parse import urlsplit

import rosgraph
from rosgraph.network import get_host_name, get_local_addresses, parse_http_host_and_port

from openpose_ros_bringup.doctor.snapshot import Machine, Master
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
    name, address = get_host_name(), _address_towards(uri)
    master = Master(uri, name=name, address=address, fault=_name_fault(name, uri),
                    sim_time=code == 1 and bool(sim_time))
    return master, Graph(publications(state, types), dict(state[1]))


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


def read_machine() -> Machine:
    """Return load and memory of this machine."""
    memory = float('inf')
    with suppress(OSError, ValueError, StopIteration):
        lines = Path('/proc/meminfo').read_text().splitlines()
        memory = next(int(line.split()[1]) for line in lines if line.startswith('MemAvailable:')) / 1024
    return Machine(os.getloadavg()[0], os.cpu_count() or 1, memory)


def _address_towards(uri: str) -> str:
    """Return the address of this machine on the way to the master; nothing is sent."""
    with suppress(OSError, ValueError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
        parts = urlsplit(uri)
        way.connect((parts.hostname, parts.port or 11311))
        return str(way.getsockname()[0])
    return ''


def _name_fault(name: str, uri: str) -> str:
    """Return why nodes elsewhere can not call this machine by its name; empty: they can."""
    setting = next((key for key in ('ROS_HOSTNAME', 'ROS_IP') if key in os.environ), 'the name of this machine')
    addresses, of_master = _addresses(name), _addresses(urlsplit(uri).hostname or '')
    own = {*get_local_addresses(), '::1'}
    if not addresses:
        return f"{setting} is '{name}', which has no address here: nodes can not call this machine"
    if not any(address in own or address.startswith('127.') for address in addresses):
        return f"{setting} is '{name}' ({', '.join(sorted(addresses))}), which is another machine"
    is_remote = of_master and not any(address in own or address.startswith('127.') for address in of_master)
    if is_remote and name in ('localhost', '127.0.0.1'):
        return f"{setting} is '{name}', by which the machine of {uri} can not call this one"
    return ''


def _addresses(name: str) -> Sequence[str]:
    with suppress(OSError, UnicodeError):
        return sorted({str(entry[4][0]) for entry in socket.getaddrinfo(name, None)})
    return ()
