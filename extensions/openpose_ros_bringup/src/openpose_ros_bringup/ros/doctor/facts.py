"""The facts that the checks look at, gathered for a few seconds."""
import argparse
import os
import re
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple, Union

import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from rosgraph_msgs.msg import Clock

from openpose_ros_bringup.doctor.frames import frames_needed
from openpose_ros_bringup.doctor.snapshot import ChainNode, Snapshot
from openpose_ros_bringup.ros.doctor.chain import NAMES, StatusListener, nodes_with_results
from openpose_ros_bringup.ros.doctor.inputs import find_cameras, nodes_within
from openpose_ros_bringup.ros.doctor.network import Graph, private_parameters, read_master, unreachable
from openpose_ros_bringup.ros.doctor.streams import CameraListener
from openpose_ros_pkg.errors import BadInputError, NoTransformError
from openpose_ros_pkg.params.parameters import frame_name
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.ros.convert import rotation_and_translation
from skeleton_extract_3d.ros.transforms import Transforms

_ROLES = ('image', 'points', 'depth', 'camera_info')
_PEOPLE = {kind._type: kind for kind in (PersonDetection_3dArray, PersonDetectionArray)}
# Messages of images and points that are enough.
_MESSAGES = 30
# Nodes report once a second, each for all of its cameras; they are waited for so long [s].
_STATUS_PERIOD, _STATUS_PATIENCE = 1.2, 3.0
# Least time to listen [s].
_LEAST = 1.5
_PERIOD = 0.05
# Transforms for a stamp come a little later [s].
_TF_PATIENCE = 1.0


def gather_facts(options: argparse.Namespace) -> Snapshot:
    """Return what is known after listening for a while; ParameterError: there is no such camera."""
    master, graph = read_master()
    if not master.is_online:
        return Snapshot(master)
    rospy.init_node('doctor', anonymous=True, disable_signals=True, disable_rosout=True, log_level=rospy.ERROR)
    status, transforms, clock = StatusListener(), Transforms(_TF_PATIENCE), {0.0}
    subscribers = [rospy.Subscriber('/clock', Clock, lambda message: clock.add(message.clock.to_sec()))] if (
        '/clock' in graph.published) else []
    expected = nodes_with_results(graph.published)
    begin = time.monotonic()
    _wait(lambda: set(expected) <= set(status.nodes()) and time.monotonic() - begin > _STATUS_PERIOD,
          _STATUS_PATIENCE if expected else 0.0)
    nodes = nodes_within(options.camera_ns, status.read(graph.published))
    topics = {role: rospy.resolve_name(getattr(options, role)) for role in _ROLES if getattr(options, role)}
    cameras = find_cameras(options.camera, options.camera_ns, topics, nodes, graph.published)
    listeners = [CameraListener(camera, graph.published) for camera in cameras]
    # results of nodes that work; one that rests is not woken
    people: List[int] = []
    results = {node.results: graph.published[node.results].kind for node in nodes if node.results and not node.rests}
    subscribers += [rospy.Subscriber(topic, _PEOPLE[kind], lambda message: people.append(len(message.persons)),
                                     queue_size=100) for topic, kind in sorted(results.items()) if kind in _PEOPLE]
    begin = time.monotonic()
    _wait(lambda: time.monotonic() - begin >= _LEAST and all(each.has(_MESSAGES) for each in listeners),
          options.seconds)
    for listener in listeners:
        listener.stop()
    for subscriber in (status.subscriber, *subscribers):
        subscriber.unregister()
    # what publishes the chain's topics, and the chain, have to be reached
    sources = {node for camera in cameras for stream in camera.streams if stream.topic in graph.published
               for node in graph.published[stream.topic].nodes}
    seen = Snapshot(
        replace(master, ticks=len(clock) - 1, clock=max(clock), unreachable=unreachable(sorted({*expected, *sources}))),
        seconds=time.monotonic() - begin, published=graph.published, subscribed=graph.subscribed,
        cameras=[each.read() for each in listeners], fixed_frame=options.fixed_frame or _fixed_frame(nodes, graph),
        nodes=nodes_within(options.camera_ns, status.read(graph.published)),
        unresponsive=[node for node in expected if node not in status.nodes()],
        starting=sorted({node for node in graph.nodes if node.rpartition('/')[2] in NAMES}.difference(expected)),
        load=os.getloadavg()[0], memory=_available_memory(),
        people=people if results else None)
    seen = replace(seen, lookups=_lookups(transforms, seen), parents=transforms.parents())
    transforms.stop()
    return seen


def _fixed_frame(nodes: Sequence[ChainNode], graph: Graph) -> str:
    """Return the frame in which a node follows people, or that of the view; empty: none is named."""
    views = [private_parameters(node) for node in graph.nodes if node.endswith('/view')]
    named = [*(node.parameters.get('tracking_frame') for node in nodes), *(view.get('fixed_frame') for view in views),
             *('world' for view in views if view.get('floor') is True)]
    return frame_name(next((str(frame) for frame in named if frame), ''))


def _lookups(transforms: Transforms, seen: Snapshot) -> Dict[Tuple[str, str], Union[Transform, str]]:
    """Return transforms by target and source frame, at a stamp, as soon as they are there or will not be."""
    deadline = time.monotonic() + _TF_PATIENCE
    found: Dict[Tuple[str, str], Union[Transform, str]] = {}
    for camera in seen.cameras:
        stream = camera.points or camera.image
        if not (stream.arrivals and stream.frame_id):
            continue
        others = frames_needed(seen, camera)
        if camera.image.frame_id not in ('', stream.frame_id):
            others.append(camera.image.frame_id)
        for target in others:
            try:
                found[target, stream.frame_id] = rotation_and_translation(transforms.lookup(
                    target, stream.frame_id, rospy.Time(0, stream.arrivals[-1].stamp), deadline - time.monotonic()))
            except (NoTransformError, BadInputError) as error:
                found[target, stream.frame_id] = str(error.__cause__ or error)
    return found


def _available_memory() -> float:
    """Return the memory of this machine that programs can have [MB]."""
    with suppress(OSError, TypeError):  # a container may lack it
        return int(re.search(r'MemAvailable: *(\d+)', Path('/proc/meminfo').read_text())[1]) / 1024  # type: ignore[index]
    return float('inf')


def _wait(condition: Any, seconds: float) -> None:
    """Wait until a condition holds, so long at most [s], in the time of the machine."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline and not condition():
        time.sleep(_PERIOD)
