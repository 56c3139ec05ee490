"""Names of bodies, and their frames on tf."""
import numpy as np
import rospy
from std_msgs.msg import Header

from openpose_ros_bridges.body_model import BodyPose, Pose
from openpose_ros_bridges.node_params import HriParams
from openpose_ros_bridges.ros.hri_node import transforms_of

HEADER = Header(stamp=rospy.Time(12, 5), frame_id='room')
QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
LINKS = {'head': Pose(np.array([0.1, 0.0, 0.7]), np.eye(3))}
BODY = BodyPose(Pose(np.array([1.0, 2.0, 0.9]), QUARTER), LINKS, {}, np.zeros(3))


def values(message):
    return [getattr(message, name) for name in message.__slots__]


def test_links_are_below_the_root_and_all_names_end_with_the_body():
    root, head, person = transforms_of('p7', BODY, LINKS, HEADER, HriParams(persons=True))
    assert (root.header, root.child_frame_id) == (HEADER, 'body_p7')
    assert values(root.transform.translation) == [1.0, 2.0, 0.9]
    np.testing.assert_allclose(values(root.transform.rotation), [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])
    assert (head.header.frame_id, head.header.stamp, head.child_frame_id) == ('body_p7', HEADER.stamp, 'head_p7')
    assert values(head.transform.translation) == [0.1, 0.0, 0.7]
    assert (person.header.frame_id, person.child_frame_id) == ('body_p7', 'person_anonymous_p7')
    assert person.transform == head.transform
    assert len(transforms_of('p7', BODY, LINKS, HEADER, HriParams())) == 2
    unseen = BodyPose(BODY.root, {}, {}, BODY.velocity)  # where the model has the head says nothing of a person
    assert len(transforms_of('p7', unseen, LINKS, HEADER, HriParams(persons=True))) == 2
