"""Publish what is in space: people in one message and one by one, their joints as frames, their hands and faces."""
from typing import Tuple

import tf2_ros
from openpose_ros_msgs.msg import (
    FaceDetection_3dArray,
    HandDetection_3dArray,
    PersonDetection_3d,
    PersonDetection_3dArray,
)
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError, NoTransformError
from openpose_ros_pkg.landmarks.records import LandmarkParams
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.people_publisher import PERSONS_QUEUE, RESULTS_QUEUE, LandmarkPublisher
from skeleton_extract_3d.chain import PeopleChain, Result
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.frames import FrameTransforms


class PeoplePublisher3D:
    """Publishes detected_poses_3d, detected_poses_keypoints_3d and, with `publish_tf`, the joints on /tf."""

    def __init__(self, namespace: str, transforms: FrameTransforms, publish_tf: bool, demand: Demand) -> None:
        self._transforms, self._publish_tf = transforms, publish_tf
        self._persons = demand.advertise(f'{namespace}/detected_poses_keypoints_3d', PersonDetection_3d, PERSONS_QUEUE)
        self._arrays = demand.advertise(f'{namespace}/detected_poses_3d', PersonDetection_3dArray, RESULTS_QUEUE)
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


class LandmarkStage:
    """Finds hands and faces while they have subscribers, and publishes detected_hands_3d and detected_faces_3d.

    The chain has the detector of `in_image`, which publishes what is found in the image.
    """

    def __init__(self, namespace: str, chain: PeopleChain, transforms: FrameTransforms, in_image: LandmarkPublisher,
                 health: Health, demand: Demand) -> None:
        self._chain, self._transforms, self._in_image = chain, transforms, in_image
        self._health, self._demand = health, demand
        self._hands = demand.advertise(f'{namespace}/detected_hands_3d', HandDetection_3dArray, RESULTS_QUEUE)
        self._faces = demand.advertise(f'{namespace}/detected_faces_3d', FaceDetection_3dArray, RESULTS_QUEUE)

    def reconfigure(self, params: LandmarkParams) -> None:
        """Take other parameters from the next frame on."""
        self._in_image.reconfigure(params)

    def publish(self, result: Result, headers: Tuple[Header, Header], drawn: bool) -> Result:
        """Find and publish hands and faces where they are wanted; return the result with them. Errors are warnings.

        Args:
            headers: of the image and of the points.
            drawn: whether they are drawn.
        """
        try:
            wanted = self._in_image.look(drawn or self._demand.is_wanted(self._hands),
                                         drawn or self._demand.is_wanted(self._faces))
            if not (wanted.hands or wanted.face):
                return result
            result = self._chain.add_landmarks(result, self._in_image.seconds)
            self._in_image.publish(result.landmarks.in_image, headers[0])
            in_space, header = self._transforms.in_target_frame(result.landmarks.in_space, headers[1])
            if wanted.hands:
                self._hands.publish(convert.hands_to_array(in_space.hands, header))
            if wanted.face:
                self._faces.publish(convert.faces_to_array(in_space.faces, header))
        except NoTransformError:
            pass  # publishing the people says so
        except Exception as error:
            self._health.warn('no hands and faces', str(error) if isinstance(error, BadInputError) else repr(error))
        return result
