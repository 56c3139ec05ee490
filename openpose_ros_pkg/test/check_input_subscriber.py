#!/usr/bin/python3
"""The subscriber of the nodes is a message filter that rests, keeps its callbacks, and hands on the newest message."""
import sys
import threading
import unittest

import message_filters
import rospy
import rostest
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from openpose_ros_pkg.ros.images import image_subscriber
from session import await_true


def numbered(number: int, kind: type = Image) -> Image:
    return kind(header=Header(stamp=rospy.Time(number)))


class InputSubscriberTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_input_subscriber')

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
        cache, stamps = message_filters.Cache(subscriber, 10), []
        cache.registerCallback(lambda image: stamps.append(image.header.stamp.secs))
        publisher.publish(numbered(1))
        await_true(lambda: stamps == [1], 'the first image')
        for number in (2, 3):
            subscriber.unsubscribe()
            await_true(lambda: publisher.get_num_connections() == 0, 'nobody listens')
            publisher.publish(numbered(90))
            subscriber.subscribe()
            await_true(lambda: publisher.get_num_connections() == 1, 'a connection again')
            publisher.publish(numbered(number))
            await_true(lambda: stamps[-1] == number, 'an image after the pause')  # noqa: B023 - called at once
        self.assertEqual((stamps, subscriber.lost), ([1, 2, 3], 0))
        self.assertEqual(subscriber.resolved_name, '/paused')

    def test_the_newest_waits_for_a_slow_callback(self):
        publisher, subscriber = self.open('slow')
        stamps, begun, go_on = [], threading.Event(), threading.Event()

        def wait(image):
            stamps.append(image.header.stamp.secs)
            begun.set()
            go_on.wait(60)

        subscriber.registerCallback(wait)
        publisher.publish(numbered(1))
        self.assertTrue(begun.wait(60))
        for number in range(2, 51):
            publisher.publish(numbered(number))
        go_on.set()
        await_true(lambda: stamps[-1] == 50, 'the newest')
        self.assertLess(len(stamps), 50)
        self.assertEqual(subscriber.lost, 50 - len(stamps), 'what did not come is counted')

    def test_compressed_images(self):
        publisher, subscriber = self.open('image', 'compressed', CompressedImage)
        images = []
        subscriber.registerCallback(images.append)
        publisher.publish(numbered(1, CompressedImage))
        await_true(lambda: images, 'the image')
        self.assertEqual(images[0]._type, 'sensor_msgs/CompressedImage')
        self.assertEqual(subscriber.resolved_name, '/image/compressed')


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_pkg', 'check_input_subscriber', InputSubscriberTest, sys.argv)
