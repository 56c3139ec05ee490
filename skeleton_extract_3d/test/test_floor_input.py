"""A plane counts in its own frame, while it is young, and with a normal of unit length."""
import numpy as np
import pytest
import rospy
from pcl_msgs.msg import ModelCoefficients
from std_msgs.msg import Header

from skeleton_extract_3d.ros.floor_input import GREATEST_AGE, FloorInput


def header(seconds=100.0, frame_id='camera'):
    return Header(stamp=rospy.Time.from_sec(seconds), frame_id=frame_id)


def floor_input(*values):
    floor = FloorInput()
    floor.input.signalMessage(ModelCoefficients(header=header(), values=values))
    return floor


def test_none_before_the_first_plane():
    assert FloorInput().at(header()) is None


def test_plane_of_the_frame():
    np.testing.assert_allclose(floor_input(0, -2, 0, 2.6).at(header()), [0, -1, 0, 1.3])


@pytest.mark.parametrize('other', [header(frame_id='other'), header(100.1 + GREATEST_AGE), header(99.9 - GREATEST_AGE)])
def test_not_of_another_frame_or_time(other):
    assert floor_input(0, -1, 0, 1.3).at(other) is None


@pytest.mark.parametrize('values', [(), (0, -1, 0), (0, 0, 0, 1.3), (0, -1, 0, np.nan), (0, -np.inf, 0, 1.3)])
def test_no_plane(values):
    assert floor_input(*values).at(header()) is None
