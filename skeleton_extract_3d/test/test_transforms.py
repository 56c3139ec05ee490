"""What tf knew of a recording that is played again, without a clock of its own."""
import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Header

from skeleton_extract_3d.ros.transforms import Transforms


@pytest.fixture()
def heard(monkeypatch):
    """Return transforms, and what takes those of tf: no master is asked."""
    buffers = []
    monkeypatch.setattr(tf2_ros, 'TransformListener', buffers.append)
    return Transforms(0.0), buffers[0]


def stamped(seconds, x, frame='camera'):
    found = TransformStamped(header=Header(stamp=rospy.Time.from_sec(seconds), frame_id='map'), child_frame_id=frame)
    found.transform.translation.x, found.transform.rotation.w = x, 1.0
    return found


def test_a_recording_that_is_played_again_has_its_own_transforms(heard):
    transforms, buffer = heard
    buffer.set_transform_static(stamped(0, 7.0, 'mast'), 'test')
    for begin, speed, step in ((1000, 1.0, 30), (1000, 2.0, 5), (998, 3.0, 5)):
        for second in range(step + 1):
            buffer.set_transform(stamped(begin + second, speed * second), 'test')
            buffer.set_transform(stamped(begin + second - 0.3, speed * second, 'late'), 'test')
        for found in (transforms.lookup('map', 'camera', rospy.Time(begin + step)),
                      transforms.newest('map', 'camera'), transforms.newest('map', 'late')):
            assert found.transform.translation.x == speed * step
        assert transforms.newest('map', 'mast').transform.translation.x == 7.0
    assert transforms.parents() == {'camera': 'map', 'late': 'map', 'mast': 'map'}


def test_transforms_that_are_a_little_late_change_nothing(heard):
    transforms, buffer = heard
    for seconds in (1000, 1001, 1000.6, 1002):
        buffer.set_transform(stamped(seconds, seconds), 'test')
    assert transforms.lookup('map', 'camera', rospy.Time.from_sec(1000.5)).transform.translation.x > 1000
