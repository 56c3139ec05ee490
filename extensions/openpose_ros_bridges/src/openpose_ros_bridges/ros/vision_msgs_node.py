"""People as vision_msgs/Detection2DArray and Detection3DArray, as ROS noetic defines them."""
from typing import Sequence

import genpy
import numpy as np
from geometry_msgs.msg import Point, Pose, Pose2D, PoseWithCovariance, Quaternion, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray

from openpose_ros_bridges.located import box_round, covariance, region_round, reliability_of, sigma_of
from openpose_ros_bridges.node_params import VisionParams
from openpose_ros_bridges.ros.bridge import HEADER, IN_IMAGE, IN_SPACE, PEOPLE, FieldMap, Output, run_bridge
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from skeleton_extract_3d.ros.convert import people_from_array

PACKAGE = ForeignPackage('vision_msgs', 'https://github.com/ros-perception/vision_msgs (branch noetic-devel)')
_NO_TURN = Quaternion(0.0, 0.0, 0.0, 1.0)
_NOWHERE = PoseWithCovariance(Pose(Point(), _NO_TURN), covariance(np.nan, np.nan))


def outputs(params: VisionParams) -> Sequence[Output]:
    """Return the outputs of the node; people without keypoints, or joints, are left out."""
    result = FieldMap(PACKAGE, 'ObjectHypothesisWithPose', id=('int64', lambda *_: params.class_id),
                      score=('float64', lambda confidence, _: reliability_of(confidence)),
                      pose=('geometry_msgs/PoseWithCovariance', lambda _, pose: pose))
    boxes = {'2D': FieldMap(PACKAGE, 'BoundingBox2D',
                            center=('geometry_msgs/Pose2D', lambda box: Pose2D(*box.centre, 0.0)),
                            size_x=('float64', lambda box: box.size[0]), size_y=('float64', lambda box: box.size[1])),
             '3D': FieldMap(PACKAGE, 'BoundingBox3D',
                            center=('geometry_msgs/Pose', lambda box: Pose(Point(*box.centre), _NO_TURN)),
                            size=('geometry_msgs/Vector3', lambda box: Vector3(*box.size)))}
    detections = {sort: FieldMap(
        PACKAGE, f'Detection{sort}', header=HEADER,
        results=('vision_msgs/ObjectHypothesisWithPose[]', lambda _header, _box, *of_result: [result(*of_result)]),
        bbox=(f'vision_msgs/BoundingBox{sort}', lambda _header, box, *_, to_box=to_box: to_box(box)))
        for sort, to_box in boxes.items()}
    arrays = {sort: FieldMap(PACKAGE, f'Detection{sort}Array', header=HEADER, detections=(
        f'vision_msgs/Detection{sort}[]', lambda header, found, one=one: [one(header, *each) for each in found]))
        for sort, one in detections.items()}

    def in_image(message: PersonDetectionArray) -> genpy.Message:
        people = convert_2d.people_from_array(message)
        return arrays['2D'](message.header, [
            (region_round(keypoints[:, :2], params.margin_2d), keypoints[:, 2], _NOWHERE)
            for keypoints in people.keypoints[people.present.any(axis=1)]])

    def in_space(message: PersonDetection_3dArray) -> genpy.Message:
        people = people_from_array(message)
        found = []
        for row in np.flatnonzero(np.isfinite(people.xyz[..., 0]).any(axis=1)):
            box = box_round(people.xyz[row], params.margin_3d)
            found.append((box, people.confidence[row], PoseWithCovariance(
                Pose(Point(*box.centre), _NO_TURN), covariance(sigma_of(people, row), np.nan))))
        return arrays['3D'](message.header, found)

    return (Output(f'{IN_SPACE}/detections_2d', arrays['2D'].kind, (IN_IMAGE,), in_image),
            Output(f'{IN_SPACE}/detections_3d', arrays['3D'].kind, (PEOPLE,), in_space))


def main() -> None:
    """Run the bridge to vision_msgs."""
    run_bridge('vision_msgs_node', VisionParams, outputs)
