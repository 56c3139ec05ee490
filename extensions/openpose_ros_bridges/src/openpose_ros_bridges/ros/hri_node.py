"""The node of REP-155: each person's body below /humans/bodies, and on tf."""
import threading
from dataclasses import dataclass
from functools import partial
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Type

import numpy as np
import rospy
from geometry_msgs.msg import Point, PointStamped, Quaternion, TransformStamped, TwistStamped, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray, PersonSignalsArray
from sensor_msgs.msg import CameraInfo, JointState
from std_msgs.msg import Bool, Float32, Header, String
from tf2_msgs.msg import TFMessage

from openpose_ros_bridges.body_model import BodyPose, Pose, body_poses
from openpose_ros_bridges.human_description import links_of
from openpose_ros_bridges.node_params import HriParams, HriSettings
from openpose_ros_bridges.ros.body_topics import BodyTopics, HumanDescriptions
from openpose_ros_bridges.ros.bridge import IN_SPACE, start_signals
from openpose_ros_bridges.ros.hri_messages import HriMessages
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.people import distinct_ids
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.demand import Demand, in_camera
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.node import check_topic_name, introduce, run_node
from openpose_ros_pkg.ros.people_publisher import RESULTS_QUEUE
from openpose_ros_pkg.stream.newest_wins import NewestWinsWorker
from openpose_ros_signals.ros.input_end import InputEnd
from skeleton_extract_3d.points.transform import quaternions
from skeleton_extract_3d.ros import convert

BODIES, PERSONS = '/humans/bodies', '/humans/persons'


@dataclass
class _Chain:
    """What is known of a chain."""

    prefix: str  # of the ids of its bodies
    info: str  # topic that tells the size of its images
    size: Optional[np.ndarray] = None  # (2,) width and height of its images [px]
    waits: bool = False  # an image came while its size was not known
    frame_id: str = ''  # of its people
    names: Sequence[str] = ()  # ids of the bodies that are tracked

    def name(self, person: int) -> str:
        """Return the id of the body of a person."""
        return f'{self.prefix}{person}'


class HriNode:
    """Publishes people as REP-155 has them, of one chain or several.

    Raises:
        ParameterError: `cameras` are no namespaces.
    """

    def __init__(self, settings: HriSettings) -> None:
        self._params = params = settings.hri
        prefixes = id_prefixes(params.cameras)
        self._messages, self._health = HriMessages(), Health()
        self._lock, self._has_ended = threading.Lock(), False
        self._models = HumanDescriptions(rf"({'|'.join(prefixes.values())})\d+", self._health)
        rospy.on_shutdown(self._end)  # before the first body comes
        self._bodies, self._persons = BodyTopics(BODIES, self._models.forget), BodyTopics(PERSONS)
        self._demand = Demand(settings.demand.lazy and not params.publish_tf, self._health)
        self._tracked = self._demand.advertise(f'{BODIES}/tracked', self._messages.ids.kind, RESULTS_QUEUE)
        self._person_lists = [self._demand.advertise(f'{PERSONS}/{name}', self._messages.ids.kind, RESULTS_QUEUE)
                              for name in (('tracked', 'known') if params.persons else ())]
        self._tf = rospy.Publisher('/tf', TFMessage, queue_size=RESULTS_QUEUE) if params.publish_tf else None
        self._workers: List[NewestWinsWorker] = []
        self._chains: List[_Chain] = []
        inputs = [source for camera, prefix in prefixes.items() for source in self._read(camera, prefix)]
        self._health.show(lambda: {'frames skipped': str(sum(worker.replaced for worker in self._workers))})
        self._health.show_lasting(self._fault)
        self._demand.read(*inputs)
        introduce(self._demand.inputs, bodies=', '.join(f'{BODIES}/{prefix}ID' for prefix in prefixes.values()))

    def _read(self, camera: str, prefix: str) -> List[InputSubscriber]:
        """Return the inputs of a chain."""
        def source(topic: str, kind: Type[Any], process: Callable[..., None], **how: Any) -> InputSubscriber:
            worker = NewestWinsWorker(partial(process, chain), self._health.frame_failed, topic)
            self._workers.append(worker)
            subscriber = InputSubscriber(in_camera(camera, f'{IN_SPACE}/{topic}'), kind, **how)
            subscriber.registerCallback(worker.submit)
            return subscriber

        chain = _Chain(prefix, in_camera(camera, f'{IN_SPACE}/camera_info'))
        self._chains.append(chain)
        end = InputEnd(partial(self._clear, chain))
        # what images add to the bodies is missing without them
        return [source('detected_poses_3d', PersonDetection_3dArray, partial(self._in_space, end)),
                source('camera_info', CameraInfo, self._camera_info, optional=True),
                source('detected_poses', PersonDetectionArray, self._in_image, optional=True),
                source('people_signals', PersonSignalsArray, self._signals, start=start_signals(camera))]

    def _fault(self) -> str:
        """Return where the size of images is not known; empty: all are."""
        topics = [chain.info for chain in self._chains if chain.waits]
        return f"no regions, as there is no camera info on {', '.join(topics)}" if topics else ''

    def _camera_info(self, chain: _Chain, message: CameraInfo) -> None:
        if message.width and message.height:
            chain.size, chain.waits = np.array(convert_2d.calibration_from_message(message).image_size), False

    def _in_space(self, end: InputEnd, chain: _Chain, message: PersonDetection_3dArray) -> None:
        people, header = convert.people_from_array(message), message.header
        bodies = {chain.name(person): body for person, body in body_poses(people).items()}
        end.heard()
        with self._lock:
            if self._has_ended:
                return  # no model stays after the node
            chain.frame_id, chain.names = header.frame_id, list(map(chain.name, distinct_ids(people.ids).tolist()))
            self._bodies.keep(self._names)
            lengths = {name: self._models.lengths(name, body) for name, body in bodies.items()}
            self._publish_lists(header)
            for name, body in bodies.items():
                self._publish_body(name, body, header)
            if self._params.persons:
                self._publish_persons(chain.names, bodies)
        if self._tf is not None and bodies:
            self._tf.publish(TFMessage([
                transform for name, body in bodies.items() for transform in transforms_of(
                    name, body, links_of(body, lengths[name]), header, self._params)]))
        self._health.frame_done(header.stamp)

    @property
    def _names(self) -> List[str]:
        """Ids of the bodies of all chains."""
        return [name for chain in self._chains for name in chain.names]

    def _publish_lists(self, header: Header) -> None:
        """Tell which bodies and persons are tracked."""
        self._tracked.publish(self._messages.ids(header, self._names))
        for publisher in self._person_lists:
            publisher.publish(self._messages.ids(header, [person_of(name) for name in self._names]))

    def _clear(self, chain: _Chain) -> None:
        """Tell that no body of a chain is tracked; with the last one end all topics: readers keep a list."""
        with self._lock:
            chain.names = ()
            self._publish_lists(Header(stamp=rospy.get_rostime(), frame_id=chain.frame_id))
            if not self._names:
                self._bodies.clear()
                self._persons.clear()

    def _end(self) -> None:
        with self._lock:
            self._has_ended = True
            self._models.clear()

    def _publish_body(self, name: str, body: BodyPose, header: Header) -> None:
        self._bodies.publish(name, 'position', PointStamped(header, Point(*body.root.position)))
        if np.isfinite(body.velocity).all():
            velocity = TwistStamped(header=header)
            velocity.twist.linear = Vector3(*body.velocity)
            self._bodies.publish(name, 'velocity', velocity)
        self._bodies.publish(name, 'joint_states', JointState(
            header=header, name=[f'{joint}_{name}' for joint in body.joints], position=list(body.joints.values())))

    def _publish_persons(self, names: Sequence[str], bodies: Dict[str, BodyPose]) -> None:
        self._persons.keep([person_of(name) for name in self._names])
        for name in names:
            person = person_of(name)
            self._persons.publish(person, 'anonymous', Bool(True), latch=True)
            self._persons.publish(person, 'body_id', String(name), latch=True)
            self._persons.publish(person, 'location_confidence', Float32(1.0 if name in bodies else 0.0))

    def _in_image(self, chain: _Chain, message: PersonDetectionArray) -> None:
        if chain.size is None:
            chain.waits = True
            return
        people, header = convert_2d.people_from_array(message), message.header
        with self._lock:
            for row, person in enumerate(distinct_ids(people.ids).tolist()):
                region = self._messages.region_of(people, row, header, chain.size)
                if region is not None:
                    self._bodies.publish(chain.name(person), 'roi', region)
                    self._bodies.publish(chain.name(person), 'skeleton2d', self._messages.skeleton_of(
                        people, row, header, chain.size))

    def _signals(self, chain: _Chain, message: PersonSignalsArray) -> None:
        with self._lock:
            for person in message.persons:
                name, gesture = chain.name(person.person_ID), self._messages.gesture_of(person)
                self._bodies.publish(name, 'posture', self._messages.posture_of(person))
                if gesture is not None:
                    self._bodies.publish(name, 'gesture', gesture)


def id_prefixes(text: str) -> Dict[str, str]:
    """Return how the ids of the bodies of each chain begin, by its namespace; '' is the node's own."""
    cameras = text.split()
    for camera in cameras:
        check_topic_name('cameras', camera)
    prefixes = {camera: f"{camera.strip('/~').replace('/', '_')}_p" for camera in cameras}
    if len(set(prefixes.values())) < len(cameras):
        raise ParameterError(f"parameter 'cameras' names one twice: {text}", 'cameras')
    return prefixes or {'': 'p'}


def person_of(body: str) -> str:
    """Return the id of the anonymous person of a body."""
    return f'anonymous_{body}'


def transforms_of(name: str, body: BodyPose, links: Mapping[str, Pose], header: Header, params: HriParams
                  ) -> List[TransformStamped]:
    """Return the frames of a body: its root in that of the people, its links in the root; and that of the person."""
    root = f'body_{name}'
    below = Header(stamp=header.stamp, frame_id=root)
    transforms = [_transform(header, root, body.root)]
    transforms += [_transform(below, f'{link}_{name}', pose) for link, pose in links.items()]
    head: Optional[Pose] = body.links.get('head')
    if params.persons and head is not None:
        transforms.append(_transform(below, f'person_{person_of(name)}', head))
    return transforms


def _transform(header: Header, child: str, pose: Pose) -> TransformStamped:
    transform = TransformStamped(header=header, child_frame_id=child)
    transform.transform.translation = Vector3(*pose.position.tolist())
    transform.transform.rotation = Quaternion(*quaternions(pose.rotation[np.newaxis])[0].tolist())
    return transform


def main() -> None:
    """Run the node of REP-155."""
    run_node('hri_node', HriSettings, HriNode)
