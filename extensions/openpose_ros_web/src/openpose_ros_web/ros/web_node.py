"""Show people and what they do in browsers, live: a page, and messages for it over a WebSocket.

Nothing is read while no page is open. Pages get the people at the rate of the chain, but for those that are too slow;
images as far as they ask for them. They can change nothing.
"""
import time
from collections import deque
from functools import partial
from pathlib import Path
from typing import Any, Callable, Deque, Dict, List, NamedTuple, Tuple, Type

import numpy as np
import rospkg
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from openpose_ros_msgs.msg import (
    FaceDetection_3dArray,
    HandDetection_3dArray,
    PersonDetection_3dArray,
    PersonSignalsArray,
)
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output.files import jpeg_of
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import RECENT, Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.node import check_topic_name, introduce, run_node
from openpose_ros_pkg.ros.threads import repeat
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker
from openpose_ros_signals.ros.convert import signals_from_array
from openpose_ros_web import protocol
from openpose_ros_web.node_params import WebParams
from openpose_ros_web.protocol import Message, Moment, Want
from openpose_ros_web.ros.room import Room
from openpose_ros_web.server import Key, PeopleServer
from openpose_ros_web.three_js import three_folder
from skeleton_extract_3d.ros import convert

SPACE, IMAGE = 'openpose_ros/skeleton_3d', 'openpose_ros'
# What is known of people: topic, type, and what makes a message for pages of it.
_KINDS: Dict[str, Tuple[str, Type[Any], Callable[[Any], Any], Callable[..., Message]]] = {
    'people': ('detected_poses_3d', PersonDetection_3dArray, convert.people_from_array, protocol.people_message),
    'signals': ('people_signals', PersonSignalsArray, signals_from_array, protocol.signals_message),
    'hands': ('detected_hands_3d', HandDetection_3dArray, convert.hands_from_array, protocol.hands_message),
    'faces': ('detected_faces_3d', FaceDetection_3dArray, convert.faces_from_array, protocol.faces_message)}
# What a node said of itself is shown for this long [s].
_REMEMBERED = 60.0
_MOST_NODES, _LONGEST_TEXT = 50, 300
# Of the JPEG images.
_QUALITY = 75
# Key that the nodes of this project have in their status.
_RATE = 'rate [Hz]'


class _Pages(NamedTuple):
    """The pages that want something, as readers of the node."""

    server: PeopleServer
    wanted: Callable[[Want], bool] = lambda want: True

    def get_num_connections(self) -> int:
        """Return 1 while there are some."""
        return int(self.server.is_wanted(self.wanted))


class WebNode:
    """Reads what pages show, while there are some.

    Raises:
        ParameterError: the pages can not be served there, or `cameras` are no namespaces.
        ModelError: three.js is missing.
    """

    def __init__(self, params: WebParams) -> None:
        self._params, self._health = params, Health()
        self._demand = Demand(True, self._health)
        self._room = Room(params.fixed_frame)
        chains = _chains(params)
        self._server = _serve(params, protocol.hello([name for name, _ in chains], params.dimensions),
                              self._demand.peer_subscribe)
        self._infos: Dict[int, CameraInfo] = {}
        self._cameras = ''
        self._ages: Deque[Tuple[float, float]] = deque(maxlen=1000)
        self._nodes: Dict[str, Tuple[float, Message]] = {}
        self._workers: List[NewestWinsWorker] = []
        self._demand.add(_Pages(self._server))
        inputs = [self._input(f'{SPACE}/{topic}', message, partial(self._people, kind), optional=kind != 'people')
                  for kind, (topic, message, _, _) in _KINDS.items() if params.dimensions == 3]
        needs: Dict[InputSubscriber, List[_Pages]] = {}
        for index, (_, chain) in enumerate(chains):
            needs[self._input(f'{chain}/detected_poses_image', Image, partial(self._image, index))] = [
                _Pages(self._server, partial(_wants_image, index))]
            inputs.append(self._input(f'{chain}/camera_info', CameraInfo, partial(self._camera_info, index)))
        inputs.append(InputSubscriber('/diagnostics', DiagnosticArray, optional=True))
        inputs[-1].registerCallback(self._diagnostics)  # each: two nodes may report at the same time
        self._health.show(lambda: {'pages': str(len(self._server.clients)),
                                   'frames skipped': str(sum(worker.replaced for worker in self._workers))})
        self._health.show_lasting(self._room.fault)
        self._demand.read(*inputs, *needs, only_for=needs)
        repeat(self._state, 'state', 1.0)
        introduce(self._demand.inputs, page=f'http://{params.host}:{self._server.port}')

    def _people(self, kind: str, message: Any) -> None:
        """Send what is known of the people of a frame."""
        header, (_, _, read, make) = message.header, _KINDS[kind]
        frame, pose = self._room.place(header)
        age = (rospy.get_rostime() - header.stamp).to_sec()
        moment = Moment(header.stamp.to_sec(), age, time.time(), frame)
        self._server.publish(Key(kind), protocol.encode(make(read(message), pose, moment)))
        if kind == 'people':
            self._ages.append((time.monotonic(), age))
            self._health.frame_done(header.stamp)
            self._send_cameras(header, frame)

    def _input(self, topic: str, kind: Type[Any], process: Callable[[Any], None], optional: bool = True
               ) -> InputSubscriber:
        worker = NewestWinsWorker(process, self._health.frame_failed, topic)
        self._workers.append(worker)
        subscriber = InputSubscriber(topic, kind, optional)
        subscriber.registerCallback(worker.submit)
        return subscriber

    def _camera_info(self, index: int, message: CameraInfo) -> None:
        self._infos[index] = message
        self._room.optical.add(message.header.frame_id)

    def _send_cameras(self, header: Header, frame: str) -> None:
        """Tell where the cameras are at the time of a frame, if that changed."""
        known = []
        for index, info in sorted(self._infos.items()):
            there, pose = self._room.place(Header(stamp=header.stamp, frame_id=info.header.frame_id))
            if there == frame and info.K[0] > 0:
                known.append((index, convert.camera_from_message(info), pose))
        message = protocol.encode(protocol.cameras_message(known, frame))
        if message != self._cameras:
            self._cameras = message
            self._server.publish(Key('cameras'), message, keep=True)

    def _image(self, index: int, message: Image) -> None:
        widths = self._server.due_widths(index)
        if not widths:
            return
        bgr = convert_2d.image_to_bgr(message)
        for width in widths:
            jpeg = jpeg_of(bgr, _QUALITY, width)
            self._server.publish(Key('image', index, width),
                                 protocol.image_message(index, message.header.stamp.to_sec(), jpeg))

    def _diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            name = status.name.rpartition(': ')[2][:_LONGEST_TEXT]  # diagnostic_updater puts the node's before its own
            is_own = any(value.key == _RATE for value in status.values)
            if is_own and (name in self._nodes or len(self._nodes) < _MOST_NODES):
                self._nodes[name] = time.monotonic(), {'name': name, 'level': int(status.level),
                                                       'text': status.message[:_LONGEST_TEXT]}

    def _state(self) -> None:
        now = time.monotonic()
        if not self._server.clients:
            self._room.rest()
            self._nodes.clear()
            return
        ages = [age for when, age in list(self._ages) if now - when <= RECENT]
        self._nodes = {name: known for name, known in list(self._nodes.items()) if now - known[0] <= _REMEMBERED}
        self._server.publish(Key('state'), protocol.encode({
            'type': 'state', 'time': round(time.time(), 3), 'rate': round(len(ages) / RECENT, 1),
            'latency': round(float(np.median(ages)), 3) if ages else None, 'clients': len(self._server.clients),
            'nodes': [{**node, 'silent': round(now - when)} for _, (when, node) in sorted(self._nodes.items())]}))


def _chains(params: WebParams) -> List[Tuple[str, str]]:
    """Return name and namespace of the topics of each camera."""
    cameras, others = params.cameras.split(), params.rgb_cameras.split()
    for camera in (*cameras, *others):
        check_topic_name('cameras' if camera in cameras else 'rgb_cameras', camera)
    return [*((camera, f"/{camera.strip('/')}/{SPACE}") for camera in cameras),
            *((camera, f"/{camera.strip('/')}/{IMAGE}") for camera in others)] or [
                ('camera', SPACE if params.dimensions == 3 else IMAGE)]


def _serve(params: WebParams, hello: Message, changed: Callable[[], None]) -> PeopleServer:
    if not params.host.strip():
        raise ParameterError("host is empty, expected the name or address of this computer: localhost, or 0.0.0.0 for "
                             'all of the network', 'host')
    folders = {'/': Path(rospkg.RosPack().get_path('openpose_ros_web')) / 'www', '/vendor/': three_folder()}
    try:
        return PeopleServer(params.host, params.port, folders, hello, changed)
    except (OSError, UnicodeError) as error:
        raise ParameterError(f"pages can not be served at '{params.host}', port {params.port}: {error}", 'port'
                             ) from error


def _wants_image(index: int, want: Want) -> bool:
    return want.camera == index and want.width > 0


def main() -> int:
    """Run the node."""
    return run_node('people_web_node', WebParams, WebNode)
