"""Publish the people in space of each frame: in one message, one by one, and their joints as frames."""
import tf2_ros
from openpose_ros_msgs.msg import PersonDetection_3d, PersonDetection_3dArray
from std_msgs.msg import Header

from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.people_publisher import PERSONS_QUEUE, RESULTS_QUEUE
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.frames import FrameTransforms


class PeoplePublisher3D:
    """Publishes detected_poses_3d, detected_poses_keypoints_3d and, with `publish_tf`, the joints on /tf."""

    def __init__(self, namespace: str, transforms: FrameTransforms, publish_tf: bool, demand: Demand) -> None:
        self._transforms = transforms
        self._persons = demand.advertise(f'{namespace}/detected_poses_keypoints_3d', PersonDetection_3d,
                                         queue_size=PERSONS_QUEUE)
        self._arrays = demand.advertise(f'{namespace}/detected_poses_3d', PersonDetection_3dArray,
                                        queue_size=RESULTS_QUEUE)
        self._publish_tf = publish_tf
        self._broadcaster = tf2_ros.TransformBroadcaster() if publish_tf or transforms.degrees else None

    def publish(self, people: People3D, header: Header) -> None:
        """Publish the people of points with a header, in the target frame; NoTransformError: that is not known."""
        of_camera = self._transforms.of_camera(header)
        if of_camera is not None:
            self._broadcaster.sendTransform(of_camera)
        people, header = self._transforms.in_target_frame(people, header)
        array = convert.people_to_array(people, header)
        self._arrays.publish(array)
        for person in array.persons:
            self._persons.publish(person)
        if self._publish_tf and len(people) > 0:
            self._broadcaster.sendTransform(convert.people_to_transforms(people, header))
