"""People as jsk_recognition_msgs/PeoplePoseArray and HumanSkeletonArray, as people_pose_estimation_2d.py of
jsk_perception 1.2.19 publishes them: the names of its topics, limbs and bones.
"""
from typing import Any, Dict, Iterable, Tuple

import genpy
from geometry_msgs.msg import Point, Pose, Quaternion
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from std_msgs.msg import Int32

from openpose_ros_bridges.node_params import BridgeSettings
from openpose_ros_bridges.ros.bridge import IN_IMAGE, PEOPLE, Bridge, Output
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_pkg.skeletons import openpose_name
from skeleton_extract_3d.people import MISSING
from skeleton_extract_3d.ros.convert import people_from_array

PACKAGE = ForeignPackage('jsk_recognition_msgs', 'https://github.com/jsk-ros-pkg/jsk_recognition (branch master)')
_LIMBS = {'limb_names': 'string[]', 'poses': 'geometry_msgs/Pose[]', 'scores': 'float32[]'}


class JskMessages:
    """Makes messages of jsk_recognition_msgs.

    Attributes:
        poses, skeletons: classes of the messages of a frame.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
    """

    def __init__(self) -> None:
        load, header = PACKAGE.message, {'header': 'std_msgs/Header'}
        self._pose = load('PeoplePose', _LIMBS)
        self.poses = load('PeoplePoseArray', {**header, 'poses': 'jsk_recognition_msgs/PeoplePose[]'})
        self._bone = load('Segment', dict.fromkeys(('start_point', 'end_point'), 'geometry_msgs/Point'))
        self._skeleton = load('HumanSkeleton', {**header, 'bone_names': 'string[]',
                                                'bones': 'jsk_recognition_msgs/Segment[]'})
        self.skeletons = load('HumanSkeletonArray', {**header, 'human_ids': 'std_msgs/Int32[]',
                                                     'skeletons': 'jsk_recognition_msgs/HumanSkeleton[]'})

    def convert_2d(self, message: PersonDetectionArray) -> genpy.Message:
        """Return the keypoints in an image, x and y [px] and z 0.

        Raises:
            BadInputError: the message names an unknown joint set.
        """
        people = convert_2d.people_from_array(message)
        return self.poses(header=message.header, poses=[
            self._person((joint, (*keypoint[:2], 0.0), keypoint[2]) for joint, keypoint, is_present in
                         zip(people.skeleton.joints, keypoints, present) if is_present)
            for keypoints, present in zip(people.keypoints.tolist(), people.present)])

    def convert_3d(self, message: PersonDetection_3dArray) -> genpy.Message:
        """Return the joints in space that are not MISSING; those that are not seen in this frame have the score 0."""
        people = people_from_array(message)
        return self.poses(header=message.header, poses=[
            self._person((joint, point, score) for joint, point, score, status in
                         zip(people.skeleton.joints, *of_person) if status != MISSING)
            for of_person in zip(people.xyz.tolist(), people.confidence.tolist(), people.status)])

    def convert_skeletons(self, message: PersonDetection_3dArray) -> genpy.Message:
        """Return the bones between joints that are not MISSING, named as Neck->RShoulder; `human_ids` are person_ID."""
        people = people_from_array(message)
        skeletons = []
        for xyz, status in zip(people.xyz.tolist(), people.status):
            known: Dict[str, Point] = {joint: Point(*point) for joint, point, each in
                                       zip(people.skeleton.joints, xyz, status) if each != MISSING}
            bones = [ends for ends in people.skeleton.drawn_limbs if set(ends) <= set(known)]
            skeletons.append(self._skeleton(
                header=message.header, bone_names=['->'.join(map(openpose_name, ends)) for ends in bones],
                bones=[self._bone(known[start], known[end]) for start, end in bones]))
        return self.skeletons(header=message.header, human_ids=[Int32(person) for person in people.ids.tolist()],
                              skeletons=skeletons)

    def _person(self, joints: Iterable[Tuple[str, Tuple[float, float, float], float]]) -> Any:
        """Return the message of a person's joints: names, positions and scores."""
        person = self._pose()
        for joint, position, score in joints:
            person.limb_names.append(openpose_name(joint))
            person.poses.append(Pose(Point(*position), Quaternion(w=1.0)))
            person.scores.append(score)
        return person


def _make(settings: BridgeSettings) -> Bridge:
    messages = JskMessages()
    return Bridge(settings.demand,
                  Output('~pose', messages.poses, (PEOPLE,), messages.convert_3d),
                  Output('~pose_2d', messages.poses, (IN_IMAGE,), messages.convert_2d),
                  Output('~skeleton', messages.skeletons, (PEOPLE,), messages.convert_skeletons))


def main() -> None:
    """Run the bridge to jsk_recognition_msgs."""
    run_node('jsk_node', BridgeSettings, _make)
