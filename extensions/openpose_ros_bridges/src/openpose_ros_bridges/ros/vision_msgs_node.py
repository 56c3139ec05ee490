"""People as vision_msgs/Detection2DArray and Detection3DArray."""
from typing import Any

import genpy
import numpy as np
from geometry_msgs.msg import Point, Pose, Pose2D, PoseWithCovariance, Quaternion, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray

from openpose_ros_bridges.located import box_round, covariance, region_round, reliability_of, sigma_of
from openpose_ros_bridges.node_params import VisionParams, VisionSettings
from openpose_ros_bridges.ros.bridge import IN_IMAGE, IN_SPACE, PEOPLE, Bridge, Output
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_pkg.ros.node import run_node
from skeleton_extract_3d.ros.convert import people_from_array

PACKAGE = ForeignPackage('vision_msgs', 'https://github.com/ros-perception/vision_msgs (branch noetic-devel)')
_NO_TURN = Quaternion(0.0, 0.0, 0.0, 1.0)
_NOWHERE = PoseWithCovariance(Pose(Point(), _NO_TURN), covariance(np.nan, np.nan))


class VisionMessages:
    """Makes messages of detections, as ROS noetic defines them.

    Attributes:
        array_2d, array_3d: classes of the messages of a frame.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
    """

    def __init__(self, params: VisionParams) -> None:
        self._params = params
        load = PACKAGE.message
        self._hypothesis = load('ObjectHypothesisWithPose', {
            'id': 'int64', 'score': 'float64', 'pose': 'geometry_msgs/PoseWithCovariance'})
        self._box_2d = load('BoundingBox2D', {'center': 'geometry_msgs/Pose2D', 'size_x': 'float64',
                                              'size_y': 'float64'})
        self._box_3d = load('BoundingBox3D', {'center': 'geometry_msgs/Pose', 'size': 'geometry_msgs/Vector3'})
        results = {'header': 'std_msgs/Header', 'results': 'vision_msgs/ObjectHypothesisWithPose[]'}
        self._detection_2d = load('Detection2D', {**results, 'bbox': 'vision_msgs/BoundingBox2D'})
        self._detection_3d = load('Detection3D', {**results, 'bbox': 'vision_msgs/BoundingBox3D'})
        self.array_2d, self.array_3d = (load(f'Detection{sort}Array', {
            'header': 'std_msgs/Header', 'detections': f'vision_msgs/Detection{sort}[]'}) for sort in ('2D', '3D'))

    def convert_2d(self, message: PersonDetectionArray) -> genpy.Message:
        """Return the detections in an image; people without keypoints are left out.

        Raises:
            BadInputError: the message names an unknown joint set.
        """
        people = convert_2d.people_from_array(message)
        detections = []
        for keypoints in people.keypoints[people.present.any(axis=1)]:
            centre, size = region_round(keypoints[:, :2], self._params.margin_2d)
            detections.append(self._detection_2d(
                header=message.header, results=[self._result(keypoints[:, 2], _NOWHERE)],
                bbox=self._box_2d(center=Pose2D(*centre, 0.0), size_x=size[0], size_y=size[1])))
        return self.array_2d(header=message.header, detections=detections)

    def convert_3d(self, message: PersonDetection_3dArray) -> genpy.Message:
        """Return the detections in space; people without joints are left out."""
        people = people_from_array(message)
        detections = []
        for row in np.flatnonzero(np.isfinite(people.xyz[..., 0]).any(axis=1)):
            centre, size = box_round(people.xyz[row], self._params.margin_3d)
            pose = Pose(Point(*centre), _NO_TURN)
            detections.append(self._detection_3d(
                header=message.header, bbox=self._box_3d(center=pose, size=Vector3(*size)),
                results=[self._result(people.confidence[row], PoseWithCovariance(
                    pose, covariance(sigma_of(people, row), np.nan)))]))
        return self.array_3d(header=message.header, detections=detections)

    def _result(self, confidence: np.ndarray, pose: PoseWithCovariance) -> Any:
        return self._hypothesis(id=self._params.class_id, score=reliability_of(confidence), pose=pose)


def _make(settings: VisionSettings) -> Bridge:
    messages = VisionMessages(settings.vision)
    return Bridge(settings.demand,
                   Output(f'{IN_SPACE}/detections_2d', messages.array_2d, (IN_IMAGE,), messages.convert_2d),
                   Output(f'{IN_SPACE}/detections_3d', messages.array_3d, (PEOPLE,), messages.convert_3d))


def main() -> None:
    """Run the bridge to vision_msgs."""
    run_node('vision_msgs_node', VisionSettings, _make)
