"""Why no message comes on a topic, and which other topics could be meant, in words."""
from difflib import SequenceMatcher
from typing import Mapping, NamedTuple, Sequence

# Maximum number of topics, the most similar ones, and of nodes that are named; the others are counted.
_NAMED_TOPICS, _NAMED_NODES = 8, 3
# Part of the names of this project's results, which are no camera's.
_RESULTS = '/openpose_ros/'


class PublishedTopic(NamedTuple):
    """What the ROS master knows of a topic that is published: its type, and the nodes that publish it."""

    kind: str
    nodes: Sequence[str]


def why_silent(topic: str, kind: str, published: Mapping[str, PublishedTopic], is_connected: bool, node: str) -> str:
    """Return why a node may get no message on a topic, and what is published instead.

    Args:
        topic, kind: resolved name, and type that the node expects.
        published: all published topics by name.
        is_connected: whether the node is connected to a publisher of the topic.
        node: name of the node; topics that it alone publishes are not named.
    """
    there = published.get(topic)
    nodes = '' if there is None else _listed(sorted(there.nodes), _NAMED_NODES)
    if there is None:
        parts = ['no node publishes it']
    elif there.kind != kind:
        parts = [f'published as {there.kind} by {nodes}, but read as {kind}']
    elif not is_connected:
        parts = [f'published by {nodes}, but there is no connection: does the node still run, and do ROS_IP or '
                 'ROS_HOSTNAME name its machine?']
    else:
        parts = [f'published by {nodes}, which sends nothing']
    below = [f'{name} ({other.kind})' for name, other in sorted(published.items()) if name.startswith(f'{topic}/')]
    if below:
        parts.append(f'below it there is {_listed(below, _NAMED_TOPICS)}')
    others = [name for name, other in published.items() if other.kind == kind and name != topic
              and list(other.nodes) != [node] and (_RESULTS in topic or _RESULTS not in name)]
    others.sort(key=lambda name: (-SequenceMatcher(None, name, topic).ratio(), name))
    parts.append(f'other topics of type {kind}: {_listed(others, _NAMED_TOPICS)}' if others else
                 f'no other topic of type {kind} is published')
    # other programs choose the names: no characters that control a terminal
    return ''.join(each if each.isprintable() else '?' for each in '; '.join(parts))


def why_clock_stands(seconds: float) -> str:
    """Return why simulated time may stand still at this value [s]; 0: none has come."""
    if seconds == 0:
        return ('use_sim_time is true, but nothing comes on /clock: play with rosbag play --clock, or rosparam set '
                'use_sim_time false and start the nodes again')
    return f'simulated time stands still at {seconds:.3f} s: what publishes /clock is paused or has ended'


def _listed(names: Sequence[str], most: int) -> str:
    more = len(names) - most
    return ', '.join(names[:most]) + (f' and {more} more' if more > 0 else '')
