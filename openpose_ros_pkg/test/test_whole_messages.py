"""A message that can not be serialised is an error, and the next ones of its topic come."""
import struct
from types import SimpleNamespace

import pytest
import rospy
from std_msgs.msg import Float32, Int32, String

from openpose_ros_pkg.ros.node import serialize_whole_messages


@pytest.mark.parametrize('wrong, right, sent', [
    (Int32(2 ** 40), Int32(7), struct.pack('<II', 4, 7)), (Float32(1e39), Float32(0.5), struct.pack('<If', 4, 0.5)),
    (String('\ud800'), String('a'), struct.pack('<II', 5, 1) + b'a')])
def test_the_next_message_comes(wrong, right, sent, monkeypatch):
    for module in (rospy.topics, rospy.impl.tcpros_base):
        monkeypatch.setattr(module, 'serialize_message', module.serialize_message)
    serialize_whole_messages()
    topic, received = rospy.topics._PublisherImpl('/topic', type(right)), []
    topic.connections = [SimpleNamespace(write_data=received.append, endpoint_id='/reader')]
    with pytest.raises((OverflowError, UnicodeError, rospy.ROSException, rospy.topics.genpy.SerializationError)):
        topic.publish(wrong)
    topic.publish(right)
    assert received == [sent]
