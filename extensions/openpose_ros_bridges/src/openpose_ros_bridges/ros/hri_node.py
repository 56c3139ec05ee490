"""The node of REP-155: each person's body below /humans/bodies, and on tf."""
import re
import threading
import time
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Type

import genpy
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
from openpose_ros_bridges.ros.hri_messages import HriMessages
from openpose_ros_bridges.ros.human_descriptions import HumanDescriptions
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import RESULTS_QUEUE
from openpose_ros_pkg.stream.newest_wins import NewestWinsWorker
from openpose_ros_signals.ros.input_end import InputEnd
from skeleton_extract_3d.points.transform import quaternions
from skeleton_extract_3d.ros import convert

_NAMESPACE = 'openpose_ros/skeleton_3d'
BODIES, PERSONS = '/humans/bodies', '/humans/persons'
# Images may come for so long before the camera info that tells their size [s].
_BEFORE_INFO = 2.0


class _Topics:
    """The topics of bodies, or of persons, which come and go with them; `ended` is called with names that go."""

    def __init__(self, root: str, forget: float, ended: Callable[..., None] = lambda *names: None) -> None:
        self._root, self._forget, self._ended = root, forget, ended
        self._publishers: Dict[str, Dict[str, rospy.Publisher]] = {}
        self._seen: Dict[str, float] = {}

    def publish(self, name: str, topic: str, message: genpy.Message, latch: bool = False) -> None:
        """Publish a message on a topic of one that is tracked; of others, nothing."""
        if name not in self._seen:
            return
        own = self._publishers.setdefault(name, {})
        new = topic not in own
        if new:
            own[topic] = rospy.Publisher(f'{self._root}/{name}/{topic}', type(message), queue_size=10, latch=latch)
        if new or not latch:
            own[topic].publish(message)

    def keep(self, names: Sequence[str]) -> None:
        """Take the names that are tracked now, and end the topics of names that were not for a while."""
        now = time.monotonic()
        self._seen.update(dict.fromkeys(names, now))
        self._end([name for name, seen in self._seen.items() if now - seen > self._forget])

    def clear(self) -> None:
        """End the topics of all."""
        self._end(list(self._seen))

    def _end(self, names: Sequence[str]) -> None:
        for name in names:
            del self._seen[name]
            for publisher in self._publishers.pop(name, {}).values():
                publisher.unregister()
        self._ended(*names)


class HriNode:
    """Publishes people as REP-155 has them."""

    def __init__(self, settings: HriSettings) -> None:
        self._params = params = settings.hri
        if not re.fullmatch('[A-Za-z][A-Za-z0-9_]*', params.id_prefix):
            raise ParameterError(f'id_prefix: {params.id_prefix!r} is no beginning of a name, expected letters, digits '
                                 'and underscores, a letter first')
        self._messages, self._health = HriMessages(), Health()
        self._size, self._first_image = np.array([params.image_width, params.image_height]), float('inf')
        self._lock = threading.Lock()
        self._models = HumanDescriptions(rf'{params.id_prefix}\d+', self._health)
        self._bodies = _Topics(BODIES, params.forget, self._models.forget)
        self._persons = _Topics(PERSONS, params.forget)
        self._demand = Demand(settings.demand.lazy and not params.publish_tf, self._health)
        self._tracked = self._demand.advertise(f'{BODIES}/tracked', self._messages.ids, RESULTS_QUEUE)
        lists = ('tracked', 'known') if params.persons else ()
        self._person_lists = [self._demand.advertise(f'{PERSONS}/{name}', self._messages.ids, RESULTS_QUEUE)
                              for name in lists]
        self._frame_id, self._people = '', InputEnd(self._clear)
        self._tf = rospy.Publisher('/tf', TFMessage, queue_size=RESULTS_QUEUE) if params.publish_tf else None
        self._workers: List[NewestWinsWorker] = []
        people = self._input('detected_poses_3d', PersonDetection_3dArray, self._in_space)
        # what these add to the bodies is missing without them
        self._info = self._input('camera_info', CameraInfo, self._camera_info, optional=True)
        in_image = self._input('detected_poses', PersonDetectionArray, self._in_image, optional=True)
        signals = self._input('people_signals', PersonSignalsArray, self._signals, optional=True)
        self._health.show(lambda: {'frames skipped': str(sum(worker.replaced for worker in self._workers))})
        self._demand.read(people, in_image, signals, self._info)
        introduce(self._demand.inputs, bodies=f'{BODIES}/{params.id_prefix}ID')
        rospy.on_shutdown(self._end)

    def _input(self, topic: str, kind: Type[Any], process: Any, optional: bool = False) -> InputSubscriber:
        worker = NewestWinsWorker(process, self._health.frame_failed, topic)
        self._workers.append(worker)
        subscriber = InputSubscriber(f'{_NAMESPACE}/{topic}', kind, optional)
        subscriber.registerCallback(worker.submit)
        return subscriber

    def _name(self, person: int) -> str:
        return f'{self._params.id_prefix}{person}'

    def _camera_info(self, message: CameraInfo) -> None:
        if message.width and message.height and not self._params.image_width:
            self._size = np.array(convert_2d.calibration_from_message(message).image_size)

    def _in_space(self, message: PersonDetection_3dArray) -> None:
        people, header = convert.people_from_array(message), message.header
        names = [self._name(person) for person in people.ids.tolist()]
        bodies = {self._name(person): body for person, body in body_poses(people).items()}
        self._people.heard()
        with self._lock:
            if rospy.is_shutdown():
                return  # no model stays after the node
            self._frame_id = header.frame_id
            self._bodies.keep(names)
            lengths = {name: self._models.lengths(name, body) for name, body in bodies.items()}
            self._tracked.publish(self._messages.ids(header=header, ids=names))
            for name, body in bodies.items():
                self._publish_body(name, body, header)
            if self._params.persons:
                self._publish_persons(names, bodies, header)
        if self._tf is not None and bodies:
            self._tf.publish(TFMessage([
                transform for name, body in bodies.items() for transform in transforms_of(
                    name, body, links_of(body, lengths[name]), header, self._params)]))
        self._health.frame_done(header.stamp)

    def _clear(self) -> None:
        """Tell that no body is tracked, and end all topics: readers keep a list until the next one."""
        with self._lock:
            none = self._messages.ids(header=Header(stamp=rospy.get_rostime(), frame_id=self._frame_id))
            for publisher in (self._tracked, *self._person_lists):
                publisher.publish(none)
            self._bodies.clear()
            self._persons.clear()

    def _end(self) -> None:
        with self._lock:
            self._models.clear()

    def _publish_body(self, name: str, body: BodyPose, header: Header) -> None:
        self._bodies.publish(name, 'position', PointStamped(header, Point(*body.root.position)))
        if np.isfinite(body.velocity).all():
            velocity = TwistStamped(header=header)
            velocity.twist.linear = Vector3(*body.velocity)
            self._bodies.publish(name, 'velocity', velocity)
        self._bodies.publish(name, 'joint_states', JointState(
            header=header, name=[f'{joint}_{name}' for joint in body.joints], position=list(body.joints.values())))

    def _publish_persons(self, names: Sequence[str], bodies: Dict[str, BodyPose], header: Header) -> None:
        persons = [person_of(name) for name in names]
        self._persons.keep(persons)
        for publisher in self._person_lists:
            publisher.publish(self._messages.ids(header=header, ids=persons))
        for name, person in zip(names, persons):
            self._persons.publish(person, 'anonymous', Bool(True), latch=True)
            self._persons.publish(person, 'body_id', String(name), latch=True)
            self._persons.publish(person, 'location_confidence', Float32(1.0 if name in bodies else 0.0))

    def _in_image(self, message: PersonDetectionArray) -> None:
        if not self._size.all():
            self._first_image = min(self._first_image, time.monotonic())
            if time.monotonic() - self._first_image < _BEFORE_INFO:
                return
            raise BadInputError('the size of the images is not known: there is no camera info on '
                                f'{self._info.resolved_name}, and image_width and image_height are not set')
        people = convert_2d.people_from_array(message)
        with self._lock:
            for row, person in enumerate(people.ids.tolist()):
                region = self._messages.region_of(people, row, message.header, self._params.roi_margin, self._size)
                if region is not None:
                    self._bodies.publish(self._name(person), 'roi', region)
                    self._bodies.publish(self._name(person), 'skeleton2d', self._messages.skeleton_of(
                        people, row, message.header, self._size))

    def _signals(self, message: PersonSignalsArray) -> None:
        with self._lock:
            for person in message.persons:
                name, gesture = self._name(person.person_ID), self._messages.gesture_of(person)
                self._bodies.publish(name, 'posture', self._messages.posture_of(person))
                if gesture is not None:
                    self._bodies.publish(name, 'gesture', gesture)


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
