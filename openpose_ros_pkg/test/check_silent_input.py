#!/usr/bin/python3
"""A node names the input that is silent, why it is, and what is published instead; when messages come, all is well."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from harness import image, publisher
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image, PointCloud2

from session import Diagnostics, Recorder, await_true

NODE, TOPIC = 'openpose_ros_node', '/camera/image_raw'


class SilentInputTest(unittest.TestCase):
    def test_a_silent_camera(self):
        diagnostics = Diagnostics(NODE)
        log = Recorder('/rosout', Log, connect=False)
        other = rospy.Publisher('/camera/rgb/image_raw', Image, queue_size=1)
        silent = f'no message on {TOPIC}: '
        diagnostics.await_text(NODE, f'{silent}no node publishes it; other topics of type sensor_msgs/Image: '
                                     '/camera/rgb/image_raw')
        self.assertEqual(diagnostics.reports(NODE)[-1].level, 'WARN')
        wrong = rospy.Publisher(TOPIC, PointCloud2, queue_size=1)
        diagnostics.await_text(NODE, f'{silent}published as sensor_msgs/PointCloud2 by {rospy.get_name()}, but read as '
                                     'sensor_msgs/Image')
        wrong.unregister()
        camera = publisher(TOPIC, Image)
        diagnostics.await_text(NODE, f'{silent}published by {rospy.get_name()}, which sends nothing')
        grey = image(np.full((24, 32, 3), 128, np.uint8))

        def is_well():
            camera.publish(grey)
            rospy.sleep(0.05)
            return 'no message' not in diagnostics.texts(NODE)[-1]

        await_true(is_well, 'messages come, and nothing is missed')
        await_true(lambda: diagnostics.texts(NODE)[-1].startswith(silent), 'the camera fell silent again')
        self.assertEqual(diagnostics.count(NODE, silent[:-2]), 2)
        # told in the log at once, and again within a minute only once
        told = [message.msg for message in log.messages if message.msg.startswith(silent)]
        self.assertEqual(len(told), 1, told)
        other.unregister()


if __name__ == '__main__':
    rospy.init_node('check_silent_input')
    rostest.rosrun('openpose_ros_pkg', 'silent_input', SilentInputTest, sys.argv)
