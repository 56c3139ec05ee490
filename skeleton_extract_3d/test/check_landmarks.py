#!/usr/bin/python3
"""The networks of hands and faces find them at the people of a frame, and take no time without a subscriber."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from harness import OUTPUT, Camera, Output, ShippedSequence, joints_of, need_weights, now, position
from openpose_ros_msgs.msg import (
    BodypartDetection_3d,
    FaceDetection_3dArray,
    HandDetection_3d,
    HandDetection_3dArray,
    Timing,
)

from openpose_ros_pkg.networks.model_registry import FACE_LANDMARK, HAND_LANDMARK
from openpose_ros_pkg.skeletons import COCO_18
from session import Recorder, await_true

# Frames that show both people.
FRAMES = range(6)
# A measured point of a hand is at most this far from the wrist of the body [m].
HAND_REACH = 0.3
# Of hands and faces where none are computed [ms]; the networks take longer for one person.
NO_TIME = 2.0


class LandmarksTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_landmarks')
        cls.sequence, cls.people, cls.reports = ShippedSequence(), Output(), Recorder('people/timing', Timing)
        cls.camera = Camera('/image', '/points')

    def send(self, number):
        """Send a frame; return its people."""
        stamp = now()
        self.camera.send(*self.sequence.messages(number, stamp))
        return self.people.frame(stamp)

    def nothing_is_computed(self):
        """Send a frame, and tell whether a report says that hands and faces took no time.

        By the median: where other programs take the processor, a frame may take any time.
        """
        self.send(0)
        return any(stage.p50 < NO_TIME for report in self.reports.messages.copy() for stage in report.stages
                   if stage.stage == 'landmarks' and stage.count)

    def test_hands_and_faces_are_computed_for_subscribers(self):
        need_weights(HAND_LANDMARK), need_weights(FACE_LANDMARK)
        await_true(self.nothing_is_computed, 'a report of frames without hands and faces, as they have no subscriber')
        hands = Recorder(f'{OUTPUT}/detected_hands_3d', HandDetection_3dArray)
        faces = Recorder(f'{OUTPUT}/detected_faces_3d', FaceDetection_3dArray)
        found = []
        for number in FRAMES:
            array = self.send(number)
            people = {person.person_ID: person for person in array.persons}
            for hand in hands.wait(1, array.header.stamp)[0].hands:
                found.append(hand)
                self.check_hand(hand, people[hand.person_ID])
            self.assertLessEqual({face.person_ID for face in faces.wait(1, array.header.stamp)[0].faces}, set(people))
        self.assertGreaterEqual(len(found), len(FRAMES))

    def check_hand(self, hand, person):
        """Check that the measured points of a hand are where the person has that wrist."""
        side = 'left' if hand.side == HandDetection_3d.LEFT else 'right'
        wrist = joints_of(person)[COCO_18.index[f'{side}_wrist']]
        points = np.array([position(part) for part in hand.keypoints if part.status == BodypartDetection_3d.MEASURED])
        self.assertTrue(len(points) == 0 or np.median(np.linalg.norm(points - wrist, axis=1)) < HAND_REACH)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_landmarks', LandmarksTest, sys.argv)
