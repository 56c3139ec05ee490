"""The client node: sends the newest image of a camera through the detection service."""
import cv2
import rospy
from sensor_msgs.msg import Image

from openpose_ros_pkg.networks.models import joint_set
from openpose_ros_pkg.output.draw import draw_people
from openpose_ros_pkg.params.nodes import ClientSettings
from openpose_ros_pkg.ros import convert
from openpose_ros_pkg.ros.client.service_client import DetectionClient
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import AnyImage, image_subscriber, raw_image
from openpose_ros_pkg.ros.node import check_topic_name, introduce, run_node
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker


class StreamingClient:
    """Subscribes a camera, sends its newest image to `detect_poses` and republishes that image."""

    def __init__(self, settings: ClientSettings) -> None:
        self._settings = settings
        topic = self._settings.client.camera_topic
        check_topic_name('camera_topic', topic)
        self._skeleton = joint_set(self._settings.client.pose_model)
        self._health = Health(bad_input='bad image')
        self._client = DetectionClient('detect_poses', self._settings.service)
        self._publisher = rospy.Publisher('openpose_ros/input_image', Image, queue_size=1)
        self._worker = NewestWinsWorker(self._send, self._health.frame_failed, 'requests')
        self._health.show(lambda: {'frames skipped': str(self._worker.replaced)})
        images = image_subscriber(topic, self._settings.transport.image_transport)
        images.registerCallback(self._worker.submit)
        # only the service knows whether the results have subscribers
        self._demand = Demand(lazy=False, health=self._health)
        self._demand.read(images)
        introduce(self._demand.inputs, detection=f'by {self._client.name}, joints {self._skeleton.name}')

    def _send(self, message: AnyImage) -> None:
        image = raw_image(message, self._settings.limits.max_image_megapixels)
        if self._publisher.get_num_connections() > 0:
            self._publisher.publish(image)
        detections = self._client.detect(image)
        self._health.frame_done(image.header.stamp)
        if self._settings.client.display:
            people = convert.people_from_messages(detections, self._skeleton)
            cv2.imshow(rospy.get_name(), draw_people(convert.image_to_bgr(image), people, self._settings.draw))
            cv2.waitKey(1)


def main() -> None:
    """Run the client node."""
    run_node('openpose_ros_node', ClientSettings, StreamingClient)
