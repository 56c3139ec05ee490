#!/usr/bin/python3
"""Parts of the nodes that need a ROS master: diagnostics and threads outlive errors, subscribers rest and resume."""
import sys
import unittest
from pathlib import Path

import message_filters
import rospy
import rostest
from sensor_msgs.msg import Image
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[2] / 'tests/support'))
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import image_subscriber
from session import Diagnostics, await_true

NODE = 'parts'  # as the test is called
FAILED = 'report failed'


def fails(text):
    """Return a function that raises."""
    def fail():
        raise RuntimeError(text)
    return fail


class HealthTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.health = Health()
        cls.diagnostics = Diagnostics(NODE)

    def test_what_a_part_raises_is_counted_and_the_other_parts_are_shown(self):
        self.health.show(fails('deque mutated during iteration'))
        self.health.show_lasting(fails('no fault is known'))
        self.health.explain_rest(fails('no reason is known'))
        self.health.show(lambda: {'after it': 'is shown'})
        self.diagnostics.await_count(NODE, FAILED, 6)  # three in each report
        self.assertEqual(self.diagnostics.value(NODE, 'after it'), 'is shown')
        self.assertEqual(self.diagnostics.reports(NODE)[-1].level, 'WARN')

    def test_an_unexpected_exception_is_named_with_its_function(self):
        try:
            fails('no frame')()
        except RuntimeError as error:
            self.health.frame_failed(error)
        self.diagnostics.await_event(NODE, 'frame failed', 1, ['check_parts.py', 'in fail', "RuntimeError('no frame')"])


def numbered(number: int, kind: type = Image) -> Image:
    return kind(header=Header(stamp=rospy.Time(number), frame_id='/camera'))


class InputSubscriberTest(unittest.TestCase):
    def open(self, topic: str, transport: str = 'raw', kind: type = Image):
        """Return a publisher and the subscriber that hears it."""
        suffix = '' if transport == 'raw' else f'/{transport}'
        # None: publish() returns when the message is sent
        publisher = rospy.Publisher(topic + suffix, kind, queue_size=None)
        subscriber = image_subscriber(topic, transport)
        subscriber.subscribe()
        self.addCleanup(subscriber.unsubscribe)
        self.addCleanup(publisher.unregister)
        await_true(lambda: publisher.get_num_connections() == 1, 'a connection')
        return publisher, subscriber

    def test_a_pause_reaches_the_publisher_and_callbacks_stay(self):
        publisher, subscriber = self.open('paused')
        cache, stamps, frames = message_filters.Cache(subscriber, 10), [], set()
        cache.registerCallback(lambda image: stamps.append(image.header.stamp.secs))
        cache.registerCallback(lambda image: frames.add(image.header.frame_id))
        publisher.publish(numbered(1))
        await_true(lambda: stamps == [1], 'the first image')
        for number in (2, 3):
            subscriber.unsubscribe()
            await_true(lambda: publisher.get_num_connections() == 0, 'no subscriber')
            publisher.publish(numbered(90))
            subscriber.subscribe()
            await_true(lambda: publisher.get_num_connections() == 1, 'a connection again')
            publisher.publish(numbered(number))
            await_true(lambda: stamps[-1] == number, 'an image after the pause')  # noqa: B023 - called at once
        self.assertEqual((stamps, subscriber.lost), ([1, 2, 3], 0))
        self.assertEqual((subscriber.resolved_name, frames), ('/paused', {'camera'}))  # tf2 refuses leading slashes


if __name__ == '__main__':
    rospy.init_node(NODE)
    rostest.rosrun('openpose_ros_pkg', 'parts', 'check_parts', sys.argv)
