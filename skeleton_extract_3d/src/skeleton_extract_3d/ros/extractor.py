"""The extractor node: pairs image and cloud, has people found in the image and lifts their joints into space."""
import threading
import time
from typing import Any, Optional, Tuple, Union

import message_filters
import rospy
import tf2_ros
from openpose_ros_msgs.msg import PersonDetection_3d, PersonDetection_3dArray
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.models import find_model
from openpose_ros_pkg.newest_wins import NewestWinsWorker
from openpose_ros_pkg.node_params import ImageTransportParams
from openpose_ros_pkg.pairing import PairingParams
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros.convert import people_from_messages
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import AnyImage, image_subscriber, raw_image
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_pkg.ros.parameters import read_private
from openpose_ros_pkg.ros.service_client import DetectionClient, ServiceCallError
from skeleton_extract_3d.lifting import lift
from skeleton_extract_3d.node_params import EXTRACTOR_PARAMETERS
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.report import frame_report
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.synchronizer import StampSynchronizer
from skeleton_extract_3d.transform import transform_people

# How often the node looks whether its inputs come and pair [s].
WATCH_PERIOD = 5.0
# One message per person: room for the people of several frames, so that a burst drops nobody.
_PERSONS_QUEUE = 100
_NAMESPACE = 'openpose_ros/skeleton_3d'

PointsMessage = Union[PointCloud2, Image]


class Extractor:
    """Publishes the joints of everybody in view, per person and per frame."""

    def __init__(self) -> None:
        self._params, self._lifting, pairing, service, transport = read_private(*EXTRACTOR_PARAMETERS)
        self._skeleton = find_model(self._params.pose_model).skeleton
        self._health = Health()
        self._client = DetectionClient('~skeleton_2d_detector', service)
        self._camera_info: Optional[CameraInfo] = None
        self._last_report = -float('inf')
        self._advertise()
        self._worker = NewestWinsWorker(self._process, self._failed, 'extractor')
        self._subscribe(pairing, transport)
        threading.Thread(target=self._watch_inputs, name='input watch', daemon=True).start()

    def _advertise(self) -> None:
        self._cloud_publisher = rospy.Publisher(f'{_NAMESPACE}/input_pointcloud', PointCloud2, queue_size=1)
        self._image_publisher = rospy.Publisher(f'{_NAMESPACE}/input_rgb', Image, queue_size=1)
        self._person_publisher = rospy.Publisher(f'{_NAMESPACE}/detected_poses_keypoints_3d', PersonDetection_3d,
                                                 queue_size=_PERSONS_QUEUE)
        self._array_publisher = rospy.Publisher(f'{_NAMESPACE}/detected_poses_3d', PersonDetection_3dArray,
                                                queue_size=10)

    def _subscribe(self, pairing: PairingParams, transport: ImageTransportParams) -> None:
        if self._params.target_frame:
            self._tf_buffer = tf2_ros.Buffer()
            self._tf_listener = tf2_ros.TransformListener(self._tf_buffer)
        images = image_subscriber('~image', transport)
        if self._params.points_source == 'point_cloud':
            points = message_filters.Subscriber('~point_cloud', PointCloud2, queue_size=1)
        else:
            points = message_filters.Subscriber('~depth_image', Image, queue_size=1)
            self._info_subscriber = rospy.Subscriber('~camera_info', CameraInfo, self._store_camera_info, queue_size=1)
        self._inputs = (images, points)
        self._synchronizer = StampSynchronizer(images, points, pairing, self._health)
        self._synchronizer.registerCallback(lambda image, cloud: self._worker.submit((image, cloud)))
        rospy.loginfo('waiting for %s and %s', *(source.sub.resolved_name for source in self._inputs))

    def _store_camera_info(self, message: CameraInfo) -> None:
        self._camera_info = message

    def _process(self, pair: Tuple[AnyImage, PointsMessage]) -> None:
        image, message = raw_image(pair[0]), pair[1]
        points = self._points(message)
        self._republish(image, message)
        detections = self._client.detect(image)
        people_2d = people_from_messages(detections, self._skeleton)
        people = lift(people_2d, (image.width, image.height), points, self._lifting)
        self._report(people_2d, people, points)
        self._publish(people, message.header)

    def _points(self, message: PointsMessage) -> Any:
        if self._params.points_source == 'point_cloud':
            return convert.cloud_from_message(message)
        if self._camera_info is None:
            raise BadInputError(f"no camera info yet on {rospy.resolve_name('~camera_info')}")
        return convert.depth_image_from_messages(message, self._camera_info, self._params.rectified)

    def _republish(self, image: Image, points: PointsMessage) -> None:
        if self._image_publisher.get_num_connections() > 0:
            self._image_publisher.publish(image)
        if self._params.points_source == 'point_cloud' and self._cloud_publisher.get_num_connections() > 0:
            self._cloud_publisher.publish(points)

    def _publish(self, people: People3D, cloud_header: Header) -> None:
        header = Header(stamp=cloud_header.stamp, frame_id=cloud_header.frame_id)
        target = self._params.target_frame
        if target and target != header.frame_id:
            transform = self._tf_buffer.lookup_transform(
                target, header.frame_id, header.stamp, rospy.Duration(self._params.tf_timeout))
            people = transform_people(people, *convert.rotation_and_translation(transform))
            header.frame_id = target
        messages = convert.people_to_messages(people, header)
        self._array_publisher.publish(
            PersonDetection_3dArray(header=header, pose_model=people.skeleton.name, persons=messages))
        for message in messages:
            self._person_publisher.publish(message)
        self._health.frame_done(header.stamp)

    def _report(self, people_2d: People2D, people: People3D, points: Any) -> None:
        now = time.monotonic()
        if self._params.verbose and now - self._last_report >= self._params.verbose_period:
            self._last_report = now
            rospy.loginfo('%s', frame_report(people_2d, people, points))

    def _failed(self, error: Exception) -> None:
        if isinstance(error, ServiceCallError):
            self._health.warn('service call failed', str(error))
        elif isinstance(error, BadInputError):
            self._health.warn('bad input', str(error))
        elif isinstance(error, tf2_ros.TransformException):
            self._health.warn('no transform', f'to {self._params.target_frame}, the frame is dropped: {error}')
        else:
            self._health.warn('frame failed', repr(error))

    def _watch_inputs(self) -> None:
        names = [source.sub.resolved_name for source in self._inputs]
        before, pairs_before = (0, 0), 0
        while not rospy.is_shutdown():
            time.sleep(WATCH_PERIOD)
            received, pairs = self._synchronizer.received, self._synchronizer.pairs
            came = [now > then for now, then in zip(received, before)]
            if came[0] != came[1]:
                there, absent = (names[0], names[1]) if came[0] else (names[1], names[0])
                self._health.warn('input missing', f'messages come on {there} but none on {absent}')
            elif all(came) and pairs == pairs_before:
                self._health.warn('no pairs', f'{names[0]} and {names[1]} both come, but no two stamps are within '
                                              f'{self._synchronizer.slop:.3f} s of each other')
            before, pairs_before = received, pairs


def main() -> None:
    """Run the extractor node."""
    run_node('skeleton_extract_3d_node', Extractor)
