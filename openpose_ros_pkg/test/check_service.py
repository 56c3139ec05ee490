#!/usr/bin/python3
"""The service node with the real network on pictures whose people are known."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from harness import distance, image, joints, picture, true_people
from openpose_ros_msgs.msg import PersonDetection, PersonDetectionArray
from openpose_ros_msgs.srv import GetPersons

from session import PATIENCE, Recorder

# [px] The network's fields have one value for 12 x 12 pixels of the picture, and the median joint is found within less
# than one of these: measured 2.7 to 7.4 in the frames used here. The people are 150 to 400 apart.
ACCURACY = 10.0
# Network and decoder compute the same for the same picture.
EQUAL = 0.01


def people_of(detections):
    return [joints(person) for person in detections]


def same_people(detections, others, tolerance=EQUAL):
    """Whether two answers hold the same people in the same order, with the same joints at the same places."""
    pairs = list(zip(people_of(detections), people_of(others)))
    return len(detections) == len(others) and all(
        a.keys() == b.keys() and all(np.abs(a[j] - b[j]).max() <= tolerance for j in a) for a, b in pairs)


class ServiceTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        rospy.wait_for_service('detect_poses', PATIENCE)
        cls.detect = staticmethod(rospy.ServiceProxy('detect_poses', GetPersons))
        cls.persons = Recorder('openpose_ros/detected_poses_keypoints', PersonDetection)
        cls.arrays = Recorder('openpose_ros/detected_poses', PersonDetectionArray)

    def assert_people_found(self, found, truth):
        """Each true person is the nearest to one found, with at least half of the visible joints in place."""
        self.assertEqual(len(found), len(truth))
        for person in truth:
            nearest = min(found, key=lambda other: distance(person, other))
            self.assertLess(distance(person, nearest), ACCURACY)
            self.assertGreater(len(person.keys() & nearest.keys()), len(person) / 2)

    def test_two_people(self):
        message = image(picture(0), 1234.567890123, 'camera/odd frame')
        detections = self.detect(message).detections
        self.assert_people_found(people_of(detections), true_people(0))
        array, = self.arrays.wait(1, message.header.stamp)
        persons = self.persons.wait(2, message.header.stamp)
        self.assertEqual(len(persons), 2)
        self.assertTrue(same_people(array.persons, detections))
        self.assertTrue(same_people(persons, detections))
        self.assertEqual(array.pose_model, 'BODY_25')
        for received in (*detections, *persons, array, *array.persons):
            self.assertEqual(received.header.stamp, message.header.stamp)
            self.assertEqual(received.header.frame_id, 'camera/odd frame')
        for group in (detections, persons, array.persons):
            self.assertEqual([person.num_people_detected for person in group], [2, 2])
            self.assertEqual([person.person_ID for person in group], [person.person_ID for person in detections])


if __name__ == '__main__':
    rospy.init_node('service_test')
    rostest.rosrun('openpose_ros_pkg', 'service', ServiceTest, sys.argv)
