#!/usr/bin/python3
"""Hands and faces of the extractor: what is published, when the networks work, and what is wrong without weights."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from dynamic_reconfigure.client import Client
from harness import FRAME_ID, OUTPUT, VISIBLE, Camera, FakeDetector, ShippedSequence, now, person, position
from openpose_ros_msgs.msg import (
    FaceDetection_3dArray,
    FaceDetectionArray,
    HandDetection,
    HandDetection_3dArray,
    HandDetectionArray,
    PersonDetection_3dArray,
)
from std_msgs.msg import String

from openpose_ros_pkg.skeletons import COCO_18
from session import PATIENCE, Diagnostics, Recorder, await_true

# The wrist of a hand is one of its points: it is at the wrist of its person, to the shape of the arm [m].
NEAR = 0.08
NECK = COCO_18.index['neck']
KINDS = {'hands': HandDetectionArray, 'faces': FaceDetectionArray, 'hands_3d': HandDetection_3dArray,
         'faces_3d': FaceDetection_3dArray}


class KnownHandsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_known_hands')
        cls.sequence, cls.diagnostics = ShippedSequence(), Diagnostics()
        cls.detector = FakeDetector('known_people')
        cls.detector.answer = lambda number: [person(truth.id + 1, truth.pixels(truth.labels == VISIBLE))
                                              for truth in cls.sequence.people[number]]
        cls.people = {name: Recorder(f'{name}/{OUTPUT}/detected_poses_3d', PersonDetection_3dArray)
                      for name in ('known', 'without')}
        cls.asked = Recorder('known/extractor/asked', String)
        cls.camera = Camera('/image', '/points', listeners=(2, 2))

    def listen(self, *topics):
        recorders = [Recorder(f'known/{OUTPUT}/detected_{topic}', KINDS[topic]) for topic in topics]
        for recorder in recorders:
            self.addCleanup(recorder.close)
        return recorders

    def send(self, number=0):
        """Send a frame until people of it came from both nodes; return its stamp."""
        stamp = now()
        self.camera.send(*self.sequence.messages(number, stamp))
        for recorder in self.people.values():
            recorder.wait(1, stamp)
        return stamp

    def await_asked(self, words):
        """Wait until these were looked for in the newest frame."""
        await_true(lambda: [asked.data for asked in self.asked.messages[-1:]] == [words],
                   lambda: f'looking for {words}; it was {self.asked.messages[-1:]}')

    def is_quiet(self):
        """Return whether nothing was looked for in some frames; people come before their hands are looked for."""
        before = len(self.asked.messages)
        for _ in range(3):
            self.send()
        return len(self.asked.messages) == before

    def test_hands_and_faces_are_those_of_the_people(self):
        recorders = self.listen(*KINDS)
        for number in range(3):
            stamp = self.send(number)
            hands, faces, hands_3d, faces_3d = (recorder.wait(1, stamp)[0] for recorder in recorders)
            people = {found.person_ID: found for found in self.people['known'].wait(1, stamp)[0].persons}
            self.assertEqual({hand.person_ID for hand in hands.hands} | {face.person_ID for face in faces.faces},
                             set(people))
            self.assertGreaterEqual(len(hands_3d.hands), 2)
            self.assertEqual(len(faces_3d.faces), len(faces.faces))
            self.assertEqual(hands_3d.header.frame_id, FRAME_ID)
            for hand in hands_3d.hands:
                side = 'left' if hand.side == HandDetection.LEFT else 'right'
                neck = position(people[hand.person_ID].neck)
                true = min(self.sequence.people[number], key=lambda one: np.linalg.norm(one.xyz[NECK] - neck))
                wrist = true.xyz[COCO_18.index[f'{side}_wrist']]
                self.assertLess(np.linalg.norm(position(hand.keypoints[0]) - wrist), NEAR)

    def test_only_what_has_a_subscriber_is_looked_for_and_parameters_change_that(self):
        await_true(self.is_quiet, 'no look for hands and faces without a subscriber')
        faces, = self.listen('faces_3d')
        faces.wait(1, self.send(3))
        self.await_asked('face')
        hands, = self.listen('hands')
        hands.wait(1, self.send(4))
        self.await_asked('hands face')

        client = Client('known/extractor', timeout=PATIENCE)
        self.addCleanup(client.update_configuration, {'hands': True})
        client.update_configuration({'hands': False})
        stamp = self.send(1)
        faces.wait(1, stamp)
        self.await_asked('face')
        self.assertFalse([message for message in hands.messages if message.header.stamp == stamp])
        client.update_configuration({'hands': True})
        hands.wait(1, self.send(2))

    def test_without_weights_there_are_people_all_the_same(self):
        hands = Recorder(f'without/{OUTPUT}/detected_hands_3d', HandDetection_3dArray)
        self.addCleanup(hands.close)
        stamp = self.send()
        self.assertEqual(hands.wait(1, stamp)[0].hands, [])
        self.assertEqual(len(self.people['without'].wait(1, stamp)[0].persons), 2)
        self.diagnostics.await_text('without/extractor', 'hand_landmark is missing')


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_known_hands', KnownHandsTest, sys.argv)
