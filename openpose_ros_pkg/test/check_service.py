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

from session import PATIENCE, Diagnostics, Recorder

NODE = 'openpose_ros_service_node'
# [px] The network's fields have one value for 12 x 12 pixels of the picture, and the median joint is found within less
# than one of these: measured 2.7 to 7.4 in the frames used here. The people are 150 to 400 apart.
ACCURACY = 10.0
# Network and decoder compute the same for the same picture.
EQUAL = 0.01
BLACK = np.zeros((120, 160, 3), np.uint8)


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
        cls.diagnostics = Diagnostics(NODE)

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
        self.assertEqual(array.pose_model, 'COCO_18')
        for received in (*detections, *persons, array, *array.persons):
            self.assertEqual(received.header.stamp, message.header.stamp)
            self.assertEqual(received.header.frame_id, 'camera/odd frame')
        for group in (detections, persons, array.persons):
            self.assertEqual([person.num_people_detected for person in group], [2, 2])
            self.assertEqual([person.person_ID for person in group], [person.person_ID for person in detections])

    def test_ids_stay_with_their_people(self):
        """Frame after frame, delivered twice, one left out, and while the other one is not in view."""
        def find(bgr, stamp):
            return {person.person_ID: joints(person)
                    for person in self.detect(image(bgr, stamp, 'ids')).detections}

        places = {}
        for number, stamp in ((0, 20.0), (1, 20.067), (1, 20.067), (2, 20.133), (4, 20.267)):
            truth = true_people(number)
            found = find(picture(number), stamp)
            self.assert_people_found(list(found.values()), truth)
            now = {number: min(range(2), key=lambda t: distance(truth[t], person)) for number, person in found.items()}
            self.assertEqual(now, places or now)
            places = now
        self.assertEqual(sorted(places.values()), [0, 1])
        for person_id, place in places.items():
            bgr = picture(4)
            half = slice(480, None) if truth[place]['neck'][0] < 480 else slice(480)
            bgr[:, half] = 0  # the other one is there
            self.assertEqual(list(find(bgr, 20.333)), [person_id])

    def test_a_bad_image(self):
        """It is an error for its client, a count in the diagnostics, and nothing for the next one."""
        bad, before = image(BLACK, 50.0), self.diagnostics.count(NODE, 'bad image')
        bad.encoding = 'colour'
        with self.assertRaisesRegex(rospy.ServiceException, "'colour'.*rgb8"):
            self.detect(bad)
        detections = self.detect(image(picture(0), 51.0)).detections
        self.assert_people_found(people_of(detections), true_people(0))
        self.diagnostics.await_count(NODE, 'bad image', before + 1)


if __name__ == '__main__':
    rospy.init_node('service_test')
    rostest.rosrun('openpose_ros_pkg', 'service', ServiceTest, sys.argv)
