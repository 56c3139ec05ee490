"""The node of REP-155: each person's body below /humans/bodies, and on tf."""
import threading
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Type

import numpy as np
import rospy
from geometry_msgs.msg import Point, PointStamped, TransformStamped, TwistStamped, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray, PersonSignalsArray
from sensor_msgs.msg import CameraInfo, JointState
from std_msgs.msg import Bool, Float32, Header, String
from tf2_msgs.msg import TFMessage

from openpose_ros_bridges.body_model import BodyPose, Pose, body_poses
from openpose_ros_bridges.human_description import links_of
from openpose_ros_bridges.node_params import HriParams
from openpose_ros_bridges.ros.body_topics import BodyTopics, HumanDescriptions
from openpose_ros_bridges.ros.bridge import IN_SPACE, start_signals
from openpose_ros_bridges.ros.hri_messages import HriMessages
from openpose_ros_pkg.people import distinct_ids
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import RESULTS_QUEUE
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker
from openpose_ros_signals.ros.input_end import InputEnd
from skeleton_extract_3d.ros import convert

BODIES, PERSONS = '/humans/bodies', '/humans/persons'


class HriNode:
    """Publishes people as REP-155 has them."""

    def __init__(self, params: HriParams) -> None:
        self._params, self._messages, self._health = params, HriMessages(), Health()
        self._lock, self._has_ended = threading.Lock(), False
        self._size: Optional[np.ndarray] = None  # (2,) width and height of the images [px]
        self._lacks_size = False  # whether an image came before
        self._frame_id = ''  # of the people
        self._names: Sequence[str] = ()  # ids of the bodies that are tracked
        self._models = HumanDescriptions(self._health)
        rospy.on_shutdown(self._end)  # before the first body comes
        self._bodies, self._persons = BodyTopics(BODIES, self._models.forget), BodyTopics(PERSONS)
        self._demand = Demand(params.lazy and not params.publish_tf, self._health)
        self._tracked = self._demand.advertise(f'{BODIES}/tracked', self._messages.ids.kind, RESULTS_QUEUE)
        self._person_lists = [self._demand.advertise(f'{PERSONS}/{name}', self._messages.ids.kind, RESULTS_QUEUE)
                              for name in (('tracked', 'known') if params.persons else ())]
        self._tf = rospy.Publisher('/tf', TFMessage, queue_size=RESULTS_QUEUE) if params.publish_tf else None
        self._workers: List[NewestWinsWorker] = []
        self._input_end = InputEnd(self._clear)
        # what images add to the bodies is missing without them
        inputs = [self._input('detected_poses_3d', PersonDetection_3dArray, self._in_space),
                  self._input('camera_info', CameraInfo, self._camera_info, optional=True),
                  self._input('detected_poses', PersonDetectionArray, self._in_image, optional=True),
                  self._input('people_signals', PersonSignalsArray, self._signals, start=start_signals())]
        self._health.show(lambda: {'frames skipped': str(sum(worker.replaced for worker in self._workers))})
        fault = f'no regions, as there is no camera info on {inputs[1].resolved_name}'
        self._health.show_lasting(lambda: fault if self._lacks_size else '')
        self._demand.read(*inputs)
        introduce(self._demand.inputs, bodies=f'{BODIES}/pID')

    def _input(self, topic: str, kind: Type[Any], process: Callable[[Any], None], **how: Any) -> InputSubscriber:
        worker = NewestWinsWorker(process, self._health.frame_failed, topic)
        self._workers.append(worker)
        subscriber = InputSubscriber(f'{IN_SPACE}/{topic}', kind, **how)
        subscriber.registerCallback(worker.submit)
        return subscriber

    def _camera_info(self, message: CameraInfo) -> None:
        if message.width and message.height:
            self._size = np.array(convert_2d.calibration_from_message(message).image_size)
            self._lacks_size = False

    def _in_space(self, message: PersonDetection_3dArray) -> None:
        people, header = convert.people_from_array(message), message.header
        bodies = {name_of(person): body for person, body in body_poses(people).items()}
        self._input_end.heard()
        with self._lock:
            if self._has_ended:
                return  # no model stays after the node
            self._frame_id, self._names = header.frame_id, list(map(name_of, distinct_ids(people.ids).tolist()))
            self._bodies.keep(self._names)
            lengths = {name: self._models.lengths(name, body) for name, body in bodies.items()}
            self._publish_lists(header)
            for name, body in bodies.items():
                self._publish_body(name, body, header)
            if self._params.persons:
                self._publish_persons(bodies)
        if self._tf is not None and bodies:
            self._tf.publish(TFMessage([
                transform for name, body in bodies.items() for transform in transforms_of(
                    name, body, links_of(body, lengths[name]), header, self._params)]))
        self._health.frame_done(header.stamp)

    def _publish_lists(self, header: Header) -> None:
        """Tell which bodies and persons are tracked."""
        self._tracked.publish(self._messages.ids(header, self._names))
        for publisher in self._person_lists:
            publisher.publish(self._messages.ids(header, [person_of(name) for name in self._names]))

    def _clear(self) -> None:
        """Tell that no body is tracked, and end all topics: readers keep a list."""
        with self._lock:
            self._names = ()
            self._publish_lists(Header(stamp=rospy.get_rostime(), frame_id=self._frame_id))
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

    def _publish_persons(self, bodies: Dict[str, BodyPose]) -> None:
        self._persons.keep([person_of(name) for name in self._names])
        for name in self._names:
            person = person_of(name)
            self._persons.publish(person, 'anonymous', Bool(True), latch=True)
            self._persons.publish(person, 'body_id', String(name), latch=True)
            self._persons.publish(person, 'location_confidence', Float32(1.0 if name in bodies else 0.0))

    def _in_image(self, message: PersonDetectionArray) -> None:
        size, self._lacks_size = self._size, self._size is None
        if size is None:
            return
        people, header = convert_2d.people_from_array(message), message.header
        with self._lock:
            for row, person in enumerate(distinct_ids(people.ids).tolist()):
                region = self._messages.region_of(people, row, header, size)
                if region is not None:
                    self._bodies.publish(name_of(person), 'roi', region)
                    self._bodies.publish(name_of(person), 'skeleton2d', self._messages.skeleton_of(
                        people, row, header, size))

    def _signals(self, message: PersonSignalsArray) -> None:
        with self._lock:
            for person in message.persons:
                name, gesture = name_of(person.person_ID), self._messages.gesture_of(person)
                self._bodies.publish(name, 'posture', self._messages.posture_of(person))
                if gesture is not None:
                    self._bodies.publish(name, 'gesture', gesture)


def name_of(person: int) -> str:
    """Return the id of the body of a person."""
    return f'p{person}'


def person_of(body: str) -> str:
    """Return the id of the anonymous person of a body."""
    return f'anonymous_{body}'


def transforms_of(name: str, body: BodyPose, links: Mapping[str, Pose], header: Header, params: HriParams
                  ) -> List[TransformStamped]:
    """Return the frames of a body: its root in that of the people, its links in the root; and that of the person."""
    root = f'body_{name}'
    below = Header(stamp=header.stamp, frame_id=root)
    poses = [(header, root, body.root), *((below, f'{link}_{name}', pose) for link, pose in links.items())]
    if params.persons and 'head' in body.links:
        poses.append((below, f'person_{person_of(name)}', body.links['head']))
    return [convert.transform_from_matrix(np.column_stack([pose.rotation, pose.position]), frame, child)
            for frame, child, pose in poses]


def main() -> None:
    """Run the node of REP-155."""
    run_node('hri_node', HriParams, HriNode)
