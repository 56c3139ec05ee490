"""People as jsk_recognition_msgs/PeoplePoseArray and HumanSkeletonArray, as people_pose_estimation_2d.py of
jsk_perception 1.2.19 publishes them: the names of its topics, limbs and bones.
"""
from typing import Optional, Sequence

import genpy
from geometry_msgs.msg import Point, Pose, Quaternion
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from std_msgs.msg import Int32

from openpose_ros_bridges.ros.bridge import HEADER, IN_IMAGE, PEOPLE, FieldMap, Output, run_bridge
from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_pkg.skeletons import openpose_name
from skeleton_extract_3d.people import MISSING
from skeleton_extract_3d.ros.convert import people_from_array

PACKAGE = ForeignPackage('jsk_recognition_msgs', 'https://github.com/jsk-ros-pkg/jsk_recognition (branch master)')


def outputs(_settings: Optional[DemandParams] = None) -> Sequence[Output]:
    """Return the outputs of the node."""
    # of a person's joints: names, positions (3,) and scores
    person = FieldMap(PACKAGE, 'PeoplePose',
                      limb_names=('string[]', lambda joints: [openpose_name(name) for name, *_ in joints]),
                      poses=('geometry_msgs/Pose[]', lambda joints: [
                          Pose(Point(*place), Quaternion(w=1.0)) for _, place, _ in joints]),
                      scores=('float32[]', lambda joints: [score for *_, score in joints]))
    poses = FieldMap(PACKAGE, 'PeoplePoseArray', header=HEADER,
                     poses=('jsk_recognition_msgs/PeoplePose[]', lambda _, people: [person(one) for one in people]))
    # of the ends of a bone
    bone = FieldMap(PACKAGE, 'Segment', start_point=('geometry_msgs/Point', lambda start, _: start),
                    end_point=('geometry_msgs/Point', lambda _, end: end))
    # of the header, the points of joints by their names, and the names of joints at the ends of bones
    skeleton = FieldMap(PACKAGE, 'HumanSkeleton', header=HEADER,
                        bone_names=('string[]', lambda _header, _points, bones: [
                            '->'.join(map(openpose_name, ends)) for ends in bones]),
                        bones=('jsk_recognition_msgs/Segment[]', lambda _, points, bones: [
                            bone(points[start], points[end]) for start, end in bones]))
    skeletons = FieldMap(PACKAGE, 'HumanSkeletonArray', header=HEADER,
                         human_ids=('std_msgs/Int32[]', lambda _header, ids, _people: [Int32(one) for one in ids]),
                         skeletons=('jsk_recognition_msgs/HumanSkeleton[]', lambda header, _, people: [
                             skeleton(header, *one) for one in people]))

    def in_image(message: PersonDetectionArray) -> genpy.Message:
        """Return the keypoints in an image, x and y [px] and z 0."""
        people = convert_2d.people_from_array(message)
        return poses(message.header, [
            [(joint, (*keypoint[:2], 0.0), keypoint[2]) for joint, keypoint, is_present in
             zip(people.skeleton.joints, keypoints, present) if is_present]
            for keypoints, present in zip(people.keypoints.tolist(), people.present)])

    def in_space(message: PersonDetection_3dArray) -> genpy.Message:
        """Return the joints in space that are not MISSING; those that are not seen in this frame have the score 0."""
        people = people_from_array(message)
        return poses(message.header, [
            [(joint, point, score) for joint, point, score, status in zip(people.skeleton.joints, *one)
             if status != MISSING] for one in zip(people.xyz.tolist(), people.confidence.tolist(), people.status)])

    def bones(message: PersonDetection_3dArray) -> genpy.Message:
        """Return the bones between joints that are not MISSING, named as Neck->RShoulder; `human_ids` are person_ID."""
        people, found = people_from_array(message), []
        for xyz, status in zip(people.xyz.tolist(), people.status):
            points = {joint: Point(*point) for joint, point, each in zip(people.skeleton.joints, xyz, status)
                      if each != MISSING}
            found.append((points, [ends for ends in people.skeleton.drawn_limbs if set(ends) <= set(points)]))
        return skeletons(message.header, people.ids.tolist(), found)

    return (Output('~pose', poses.kind, (PEOPLE,), in_space), Output('~pose_2d', poses.kind, (IN_IMAGE,), in_image),
            Output('~skeleton', skeletons.kind, (PEOPLE,), bones))


def main() -> None:
    """Run the bridge to jsk_recognition_msgs."""
    run_bridge('jsk_node', DemandParams, outputs)
