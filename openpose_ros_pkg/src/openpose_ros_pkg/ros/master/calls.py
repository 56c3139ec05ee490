"""Calls of the ROS master that end in time, also where it hangs."""
import http.client
import socket
import xmlrpc.client
from contextlib import suppress
from typing import Any, Mapping, Sequence, Tuple

import rosgraph
import rospy
from rosgraph.network import parse_http_host_and_port
from rospy.core import parse_rosrpc_uri

from openpose_ros_pkg.stream.silent_topic import PublishedTopic

# Answers come within milliseconds; a master that needs longer hangs [s].
CALL_TIMEOUT = 2.0
# What a call raises when the master can not be reached, hangs, or answers with nonsense.
CALL_ERRORS = (OSError, http.client.HTTPException, xmlrpc.client.Error)


class _Transport(xmlrpc.client.Transport):
    """HTTP that waits for CALL_TIMEOUT at most."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = CALL_TIMEOUT
        return connection


def call_master(calls: Sequence[Tuple[Any, ...]]) -> Sequence[Tuple[int, str, Any]]:
    """Make calls of the master API in one request; CALL_ERRORS: there was no answer.

    Args:
        calls: name of the method and its arguments but for the first, the name of this node.

    Returns:
        Code (1: success), text and value of each.
    """
    with xmlrpc.client.ServerProxy(rosgraph.get_master_uri(), transport=_Transport()) as master:
        request = xmlrpc.client.MultiCall(master)
        for method, *arguments in calls:
            getattr(request, method)(rospy.get_name(), *arguments)
        answers: Any = request()
        return [tuple(answer) for answer in answers]


def published_topics() -> Mapping[str, PublishedTopic]:
    """Return all topics that are published, by their names; CALL_ERRORS: the master does not answer."""
    (_, _, state), (_, _, types) = call_master([('getSystemState',), ('getTopicTypes',)])
    return publications(state, types)


def publications(state: Sequence[Any], types: Sequence[Any]) -> Mapping[str, PublishedTopic]:
    """Return the published topics that the answers to getSystemState and getTopicTypes name."""
    kinds = dict(types)
    return {topic: PublishedTopic(kinds.get(topic, ''), nodes) for topic, nodes in state[0]}


def is_running(node: str) -> bool:
    """Tell whether a node of this name is registered and takes connections; one that was killed stays registered."""
    try:
        (code, _, uri), = call_master([('lookupNode', node)])
    except CALL_ERRORS:
        return False
    return code == 1 and takes_connections(parse_http_host_and_port(uri))


def takes_connections(address: Tuple[str, int]) -> bool:
    """Tell whether a node listens at an address."""
    with suppress(OSError), socket.create_connection(address, CALL_TIMEOUT):
        return True
    return False


def why_unavailable(service: str) -> str:
    """Return why a service can not be called, in words; empty: it is registered and takes connections."""
    try:
        (code, _, uri), = call_master([('lookupService', service)])
    except CALL_ERRORS:
        return f'the ROS master {rosgraph.get_master_uri()} does not answer'
    if code != 1:
        return 'no node has registered it'
    is_listening = takes_connections(parse_rosrpc_uri(uri))
    return '' if is_listening else f'the node that registered it, at {uri}, takes no connections'
