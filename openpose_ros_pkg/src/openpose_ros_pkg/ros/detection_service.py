"""The service node: finds the people in the images it is sent, publishes keypoints and the annotated image."""
import threading
from typing import Dict, Tuple

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection, PersonDetectionArray
from openpose_ros_msgs.srv import GetPersons, GetPersonsRequest, GetPersonsResponse
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from openpose_ros_pkg.detector import create_detector
from openpose_ros_pkg.draw import draw_people
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.keypoint_scale import scale_keypoints
from openpose_ros_pkg.newest_wins import NewestWinsWorker
from openpose_ros_pkg.node_params import SERVICE_PARAMETERS
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_pkg.ros.parameters import read_private
from openpose_ros_pkg.tracking import KeypointTracker

# One message per person: room for the people of several frames, so that a burst drops nobody.
_PERSONS_QUEUE = 100


class DetectionService:
    """Serves openpose_ros_msgs/GetPersons.

    Requests of several clients are answered in their own threads; the detector takes one picture at a time, while
    messages of the others are decoded and encoded. People keep their ids per camera, told apart by frame_id.

    Args:
        service: name of the service.
        namespace: prefix of the published topics.
    """

    def __init__(self, service: str, namespace: str) -> None:
        detector, backend, decode, self._tracking, self._draw_params, self._scale = read_private(*SERVICE_PARAMETERS)
        self._detector = create_detector(detector, backend, decode)
        self._health = Health()
        self._tracker_lock = threading.Lock()
        self._trackers: Dict[str, KeypointTracker] = {}
        self._image_publisher = rospy.Publisher(f'{namespace}/detected_poses_image', Image, queue_size=1)
        self._person_publisher = rospy.Publisher(f'{namespace}/detected_poses_keypoints', PersonDetection,
                                                 queue_size=_PERSONS_QUEUE)
        self._array_publisher = rospy.Publisher(f'{namespace}/detected_poses', PersonDetectionArray, queue_size=10)
        self._painter = NewestWinsWorker(self._publish_drawing, self._drawing_failed, 'painter')
        self._service = rospy.Service(service, GetPersons, self._serve)
        rospy.loginfo('Initialization Successful!')

    def _serve(self, request: GetPersonsRequest) -> GetPersonsResponse:
        header = request.image.header
        try:
            bgr = convert.image_to_bgr(request.image)
            people = self._detector.detect(bgr)
        except BadInputError as error:
            self._health.warn('bad image', str(error))
            raise rospy.ServiceException(str(error)) from error
        people = self._track(people, header)
        messages = convert.people_to_messages(people, header)
        self._publish(messages, people, header, bgr)
        self._health.frame_done(header.stamp)
        return GetPersonsResponse(detections=messages)

    def _track(self, people: People2D, header: Header) -> People2D:
        with self._tracker_lock:
            tracker = self._trackers.setdefault(header.frame_id, KeypointTracker(self._tracking))
            return tracker.update(people, header.stamp.to_sec())

    def _publish(self, messages: list, people: People2D, header: Header, bgr: np.ndarray) -> None:
        self._array_publisher.publish(convert.people_to_array(messages, header, people.skeleton))
        if self._scale.keypoint_scale != 0:
            size = (bgr.shape[1], bgr.shape[0])
            messages = convert.people_to_messages(people, header, scale_keypoints(people.keypoints, size, self._scale))
        for message in messages:
            self._person_publisher.publish(message)
        if self._image_publisher.get_num_connections() > 0:
            self._painter.submit((header, bgr, people))

    def _publish_drawing(self, frame: Tuple[Header, np.ndarray, People2D]) -> None:
        header, bgr, people = frame
        drawn = draw_people(bgr, people, self._draw_params)
        self._image_publisher.publish(convert.bgr_to_image(drawn, header))

    def _drawing_failed(self, error: Exception) -> None:
        self._health.warn('drawing failed', str(error))


def main_2d() -> None:
    """Run the service node under its 2D names."""
    run_node('openpose_ros_service_node', lambda: DetectionService('detect_poses', 'openpose_ros'))


def main_3d() -> None:
    """Run the service node under its 3D names."""
    run_node('openpose_ros_service_node_3d', lambda: DetectionService('detect_poses_3d', 'openpose_ros/skeleton_3d'))
