"""Check camera, topics, tf and nodes: ten checks that say what is right, what is wrong, and the line to type.

    rosrun openpose_ros_bringup doctor
    rosrun openpose_ros_bringup doctor --camera realsense --fixed-frame base_link
    rosrun openpose_ros_bringup doctor --image /cam/image_raw --depth /cam/depth/image_raw

Without options: the cameras that the running nodes read, or the one whose topics are published. It listens for a few
seconds and changes nothing. docs/nothing_in_rviz.md explains the checks.

Exit status: 0 nothing is wrong; 1 something is; 2 the command line is wrong; 130 interrupted.
"""
import argparse
import os
import sys
import time
from dataclasses import replace
from typing import Any, Dict, List, Optional, Sequence, Tuple

import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from rosgraph_msgs.msg import Clock as ClockMessage

from openpose_ros_bringup.doctor.frames import frames_needed
from openpose_ros_bringup.doctor.report import diagnose, faults, report
from openpose_ros_bringup.doctor.snapshot import ChainNode, Clock, Lookup, People, Snapshot, Tf
from openpose_ros_bringup.ros.doctor.chain import StatusListener, nodes_with_results, starting_nodes
from openpose_ros_bringup.ros.doctor.inputs import find_cameras, nodes_within
from openpose_ros_bringup.ros.doctor.network import Graph, private_parameters, read_machine, read_master, unreachable
from openpose_ros_bringup.ros.doctor.streams import CameraListener
from openpose_ros_pkg.command_line import DONE, SOME_FAILED, run_command
from openpose_ros_pkg.command_options import command_parser, number
from openpose_ros_pkg.errors import BadInputError, NoTransformError
from openpose_ros_pkg.params.camera_presets import AUTO, find_preset
from openpose_ros_pkg.params.parameters import frame_name
from skeleton_extract_3d.ros.convert import rotation_and_translation
from skeleton_extract_3d.ros.transforms import Transforms

# Variable with what comes before commands of ROS where the workspace is not sourced.
PREFIX = 'OPENPOSE_ROS_PREFIX'
_ROLES = ('image', 'points', 'depth', 'camera_info')
# Messages of images and points that are enough.
_MESSAGES = 30
# Nodes report once a second, each for all of its cameras; they are waited for so long [s].
_STATUS_PERIOD, _STATUS_PATIENCE = 1.2, 3.0
# Least time to listen [s].
_LEAST = 1.5
_PERIOD = 0.05
# Transforms for a stamp come a little later [s].
_TF_PATIENCE = 1.0


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    parser = _parser()
    options = parser.parse_args(rospy.myargv()[1:] if arguments is None else arguments)
    if (options.points or options.depth or options.camera_info) and not options.image:
        parser.error('--points, --depth and --camera-info need --image')
    return run_command('doctor', lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    if options.camera != AUTO:
        find_preset(options.camera)  # refused at once
    findings = diagnose(look(options))
    sys.stdout.write(report(findings, os.environ.get(PREFIX, '')))
    return SOME_FAILED if faults(findings) else DONE


def look(options: argparse.Namespace) -> Snapshot:
    """Return what is known after listening for a while; ParameterError: there is no such camera."""
    master, graph = read_master()
    if not master.is_online:
        return Snapshot(master)
    rospy.init_node('doctor', anonymous=True, disable_signals=True, disable_rosout=True, log_level=rospy.ERROR)
    status, ticks, frames = StatusListener(), _ClockListener(graph), Transforms(_TF_PATIENCE)
    expected = nodes_with_results(graph.published)
    begin = time.monotonic()
    _wait(lambda: set(expected) <= set(status.nodes()) and time.monotonic() - begin > _STATUS_PERIOD,
          _STATUS_PATIENCE if expected else 0.0)
    nodes = nodes_within(options.camera_ns, status.read(graph.published))
    topics = {role: rospy.resolve_name(getattr(options, role)) for role in _ROLES if getattr(options, role)}
    cameras = find_cameras(options.camera, options.camera_ns, topics, nodes, graph.published)
    listeners = [CameraListener(camera, graph.published) for camera in cameras]
    people = _PeopleListener(nodes, graph)
    begin = time.monotonic()
    _wait(lambda: time.monotonic() - begin >= _LEAST and all(each.has(_MESSAGES) for each in listeners),
          options.seconds)
    for stop in (people.stop, status.stop, *(each.stop for each in listeners)):
        stop()
    # what publishes the chain's topics, and the chain, have to be reached
    sources = {node for camera in cameras for stream in camera.streams if stream.topic in graph.published
               for node in graph.published[stream.topic].nodes}
    seen = Snapshot(
        replace(master, clock=ticks.read(), unreachable=unreachable(sorted({*expected, *sources}))),
        time.monotonic() - begin, graph.published, graph.subscribed, [each.read() for each in listeners],
        Tf(options.fixed_frame or _fixed_frame(nodes, graph)),
        nodes_within(options.camera_ns, status.read(graph.published)),
        [node for node in expected if node not in status.nodes()], starting_nodes(graph), read_machine(),
        people.read(), list(status.recorders.values()))
    tf = replace(seen.tf, lookups=_lookups(frames, seen), parents=frames.parents())
    frames.stop()
    return replace(seen, tf=tf)


def _fixed_frame(nodes: Sequence[ChainNode], graph: Graph) -> str:
    """Return the frame in which a node follows people, or that of the view; empty: none is named."""
    views = [private_parameters(node) for node in graph.nodes if node.endswith('/view')]
    named = [*(node.parameters.get('tracking_frame') for node in nodes), *(view.get('fixed_frame') for view in views),
             *('world' for view in views if view.get('floor') is True)]
    return frame_name(next((str(frame) for frame in named if frame), ''))


def _lookups(transforms: Transforms, seen: Snapshot) -> Dict[Tuple[str, str], Lookup]:
    """Return transforms by target and source frame, at a stamp, as soon as they are there or will not be."""
    deadline, found = time.monotonic() + _TF_PATIENCE, {}
    for camera in seen.cameras:
        stream = camera.points or camera.image
        if not (stream.arrivals and stream.frame_id):
            continue
        others = frames_needed(seen, camera)
        if camera.image.frame_id not in ('', stream.frame_id):
            others.append(camera.image.frame_id)
        for target in others:
            try:
                found[target, stream.frame_id] = Lookup(*rotation_and_translation(transforms.lookup(
                    target, stream.frame_id, rospy.Time(0, stream.arrivals[-1].stamp), deadline - time.monotonic())))
            except (NoTransformError, BadInputError) as error:
                found[target, stream.frame_id] = Lookup(error=str(error.__cause__ or error))
    return found


class _ClockListener:
    """Counts what comes on /clock, where it is published."""

    def __init__(self, graph: Graph) -> None:
        self._ticks, self._newest = 0, 0.0
        self._subscriber = '/clock' in graph.published and rospy.Subscriber('/clock', ClockMessage, self._count)

    def read(self) -> Clock:
        return Clock(self._ticks, self._newest)

    def _count(self, message: ClockMessage) -> None:
        newest = message.clock.to_sec()
        self._ticks += newest != self._newest
        self._newest = newest


class _PeopleListener:
    """Counts results of nodes that work; one that rests is not woken."""

    def __init__(self, nodes: Sequence[ChainNode], graph: Graph) -> None:
        kinds = {kind._type: kind for kind in (PersonDetection_3dArray, PersonDetectionArray)}
        self._people: List[int] = []
        topics = {node.results for node in nodes if not node.rests and node.results}
        self._subscribers = [
            rospy.Subscriber(topic, kinds[graph.published[topic].kind], self._count, queue_size=100)
            for topic in sorted(topics) if graph.published[topic].kind in kinds]

    def stop(self) -> None:
        for subscriber in self._subscribers:
            subscriber.unregister()

    def read(self) -> Optional[People]:
        """Return what came; None: no topic was read."""
        return People(len(self._people), max(self._people, default=0)) if self._subscribers else None

    def _count(self, message: Any) -> None:
        self._people.append(len(message.persons))


def _wait(condition: Any, seconds: float) -> None:
    """Wait until a condition holds, so long at most [s], in the time of the machine."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline and not condition():
        time.sleep(_PERIOD)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('doctor', __doc__)
    parser.add_argument('--camera', default=AUTO, metavar='NAME', help='preset of the camera (default: auto)')
    for role in ('image', 'points', 'depth', 'camera-info'):
        parser.add_argument(f'--{role}', metavar='TOPIC', help='of a camera without a preset')
    parser.add_argument('--fixed-frame', type=frame_name, default='', metavar='FRAME', help="RViz's fixed frame")
    parser.add_argument('--camera-ns', default='', metavar='NS', help='of the camera, in place of the preset\'s')
    parser.add_argument('--seconds', type=number(0.1, 3600), default=5.0, metavar='S',
                        help='listen so long at most (default: 5)')
    return parser
