"""Frames of bodies on tf; and messages of another hri_msgs are refused."""
import sys
from pathlib import Path

import numpy as np
import pytest
import rospy
from std_msgs.msg import Header

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from foreign_packages import write_packages
from openpose_ros_bridges.body_model import BodyPose, Pose
from openpose_ros_bridges.node_params import HriParams
from openpose_ros_bridges.ros.hri_messages import HriMessages
from openpose_ros_bridges.ros.hri_node import transforms_of
from openpose_ros_pkg.errors import ForeignPackageError

HEADER = Header(stamp=rospy.Time(12, 5), frame_id='room')
QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
BODY = BodyPose(Pose(np.array([1.0, 2.0, 0.9]), QUARTER), {'head': Pose(np.array([0.1, 0.0, 0.7]), np.eye(3))}, {},
                np.zeros(3))


def values(message):
    return [getattr(message, name) for name in message.__slots__]


def test_links_are_below_the_root_and_all_names_end_with_the_body():
    root, head, person = transforms_of('p7', BODY, HEADER, HriParams(persons=True))
    assert (root.header, root.child_frame_id) == (HEADER, 'body_p7')
    assert values(root.transform.translation) == [1.0, 2.0, 0.9]
    np.testing.assert_allclose(values(root.transform.rotation), [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])
    assert (head.header.frame_id, head.header.stamp, head.child_frame_id) == ('body_p7', HEADER.stamp, 'head_p7')
    assert values(head.transform.translation) == [0.1, 0.0, 0.7]
    assert (person.header.frame_id, person.child_frame_id) == ('body_p7', 'person_anonymous_p7')
    assert person.transform == head.transform


def test_without_persons_there_is_no_frame_of_theirs():
    assert [one.child_frame_id for one in transforms_of('p7', BODY, HEADER, HriParams())] == ['body_p7', 'head_p7']


def test_another_hri_msgs_is_refused(tmp_path, monkeypatch):
    write_packages(tmp_path, {'hri_msgs': {'IdsList': 'std_msgs/Header header\nuint32[] ids'}})
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in [name for name in sys.modules if name.split('.')[0] == 'hri_msgs']:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(ForeignPackageError, match=r'IdsList is defined otherwise .* ids is uint32\[\], not string\[\]'):
        HriMessages()
