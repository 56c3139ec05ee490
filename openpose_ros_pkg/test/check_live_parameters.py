#!/usr/bin/python3
"""Thresholds of the running service node change through dynamic_reconfigure, and take effect on the next image."""
import math
import sys
import unittest

import rospy
import rostest
from dynamic_reconfigure.client import Client
from harness import image, picture
from openpose_ros_msgs.srv import GetPersons
from rosgraph_msgs.msg import Log

from session import PATIENCE, Recorder, await_true

NODE = 'openpose_ros_service_node'


class LiveParametersTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        rospy.wait_for_service('detect_poses', PATIENCE)
        cls.detect = staticmethod(rospy.ServiceProxy('detect_poses', GetPersons))
        cls.client = Client(NODE, timeout=PATIENCE)
        cls.first = cls.client.get_configuration(timeout=PATIENCE)

    def tearDown(self):
        self.client.update_configuration({name: self.first[name] for name in self.first if name != 'groups'})

    def people(self, stamp):
        return self.detect(image(picture(0), stamp)).detections

    def test_it_starts_with_what_the_node_has(self):
        self.assertEqual((self.first['render_threshold'], self.first['peak_threshold']), (0.125, 0.05))
        self.assertNotIn('net_input_width', self.first)

    def test_thresholds_of_the_detector(self):
        """A score that no person has, and back."""
        self.assertEqual(len(self.people(1.0)), 2)
        for name in ('person_min_score', 'joint_min_score'):
            self.client.update_configuration({name: 1.0})
            self.assertEqual(self.people(1.1), [], name)
            self.client.update_configuration({name: self.first[name]})
            self.assertEqual(len(self.people(1.2)), 2, name)

    def test_values_that_are_not_allowed(self):
        """Beyond a limit: the limit. Without sense: the value before stays, and a warning says why."""
        log = Recorder('/rosout', Log)
        changed = self.client.update_configuration({'peak_threshold': 7.0})
        self.assertEqual(changed['peak_threshold'], 1.0)
        changed = self.client.update_configuration({'peak_threshold': 0.05})
        changed = self.client.update_configuration({'peak_threshold': math.nan})
        self.assertEqual(changed['peak_threshold'], 0.05)
        await_true(lambda: any('parameters not changed' in m.msg and "'peak_threshold' = nan" in m.msg
                               for m in log.messages.copy()), 'the warning')
        self.assertEqual(len(self.people(30.0)), 2)


if __name__ == '__main__':
    rospy.init_node('live_parameters_test')
    rostest.rosrun('openpose_ros_pkg', 'live_parameters', LiveParametersTest, sys.argv)
