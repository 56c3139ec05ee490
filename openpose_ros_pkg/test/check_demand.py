#!/usr/bin/python3
"""Without a subscriber the service node reads nothing, and the first one gets results at once; disabled nodes rest."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from harness import image
from openpose_ros_msgs.msg import PersonDetectionArray
from openpose_ros_msgs.srv import GetPersons
from sensor_msgs.msg import Image

from demand import FIRST_RESULT, enable, seconds_to_first_result, subscribe
from openpose_ros_pkg.ros.threads import repeat
from session import PATIENCE, Diagnostics, await_true

NODE = 'openpose_ros_service_node'
PEOPLE = 'openpose_ros/detected_poses', PersonDetectionArray
GREY = np.full((96, 128, 3), 128, np.uint8)
RATE = 30.0  # [Hz] of the camera


class DemandTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.camera = rospy.Publisher('camera/image_raw', Image, queue_size=1)
        cls.diagnostics = Diagnostics(NODE)
        rospy.wait_for_service('detect_poses', PATIENCE)
        cls.detect = rospy.ServiceProxy('detect_poses', GetPersons)
        repeat(lambda: cls.camera.publish(image(GREY, rospy.get_time())), 'camera', period=1 / RATE)

    def results(self):
        recorder = subscribe(*PEOPLE)
        self.addCleanup(recorder.close)
        return recorder

    def await_unread(self):
        await_true(lambda: self.camera.get_num_connections() == 0, 'the node leaves the camera')

    def assert_idle(self):
        self.await_unread()
        self.diagnostics.await_state(NODE, 'idle: no subscriber')

    def test_the_first_subscriber_gets_a_result_at_once_and_the_last_one_ends_the_work(self):
        self.assertLess(seconds_to_first_result(*PEOPLE, self.assert_idle), FIRST_RESULT)

    def test_disabled_it_reads_nothing_and_says_so(self):
        self.addCleanup(enable, NODE, True)
        results = self.results()
        results.wait(1)
        self.assertTrue(enable(NODE, False))
        self.await_unread()
        with self.assertRaisesRegex(rospy.ServiceException, f'{NODE} is disabled'):
            self.detect(image(GREY))
        self.diagnostics.await_state(NODE, 'disabled')
        self.assertEqual(self.diagnostics.value(NODE, 'enabled'), 'false')
        self.assertTrue(enable(NODE, True))
        results.wait(len(results.messages) + 3)
        self.assertEqual(self.detect(image(GREY)).detections, [])


if __name__ == '__main__':
    rospy.init_node('demand_test')
    rostest.rosrun('openpose_ros_pkg', 'demand', DemandTest, sys.argv)
