#!/usr/bin/python3
"""Hands and faces of the extractor: what is published, when the networks work, and what is wrong without weights."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from dynamic_reconfigure.client import Client
from harness import FRAME_ID, OUTPUT, VISIBLE, Camera, ShippedSequence, now, person, position
from openpose_ros_msgs.msg import (
    FaceDetection_3dArray,
    FaceDetectionArray,
    HandDetection,
    HandDetection_3dArray,
    HandDetectionArray,
    PersonDetection_3dArray,
)
from openpose_ros_msgs.srv import GetPersons, GetPersonsResponse
from std_msgs.msg import Header, String

from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.skeletons import COCO_18
from session import PATIENCE, Diagnostics, Recorder, await_true
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.ros.convert import cloud_to_message

# The wrist of a hand is one of its points: where the wrist is seen, it is there, to the shape of the arm [m].
NEAR = 0.08
KINDS = {'hands': HandDetectionArray, 'faces': FaceDetectionArray, 'hands_3d': HandDetection_3dArray,
         'faces_3d': FaceDetection_3dArray}


class KnownHandsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_known_hands')
        cls.sequence, cls.number, cls.diagnostics = ShippedSequence(), 0, Diagnostics()
        cls.service = rospy.Service('known_people', GetPersons, cls.answer)
        cls.people = {name: Recorder(f'{name}/{OUTPUT}/detected_poses_3d', PersonDetection_3dArray)
                      for name in ('known', 'without')}
        cls.asked = Recorder('known/extractor/asked', String)
        cls.camera = Camera('/image', '/points', listeners=(2, 2))

    @classmethod
    def answer(cls, _):
        found = []
        for truth in cls.sequence.people[cls.number]:
            seen = {joint: tuple(truth.uv[k]) for k, joint in enumerate(COCO_18.joints) if truth.labels[k] == VISIBLE}
            found.append(person(truth.id + 1, seen))
        return GetPersonsResponse(detections=found)

    def listen(self, *topics):
        recorders = [Recorder(f'known/{OUTPUT}/detected_{topic}', KINDS[topic]) for topic in topics]
        for recorder in recorders:
            self.addCleanup(recorder.close)
        return recorders

    def send(self, number=0):
        """Send a frame until people of it came from both nodes; return its stamp."""
        type(self).number = number
        frame, header = self.sequence.frames.frame(number), Header(stamp=now(), frame_id=FRAME_ID)
        cloud = cloud_from_depth(frame.depth * 0.001, self.sequence.frames.camera, frame.bgr)
        self.camera.send(bgr_to_image(frame.bgr, header), cloud_to_message(cloud, header))
        for recorder in self.people.values():
            recorder.wait(1, header.stamp)
        return header.stamp

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
            people = self.people['known'].wait(1, stamp)[0].persons
            ids = {found.person_ID for found in people}
            self.assertEqual({hand.person_ID for hand in hands.hands} | {face.person_ID for face in faces.faces}, ids)
            self.assertGreaterEqual(len(hands_3d.hands), 2)
            self.assertEqual(len(faces_3d.faces), len(faces.faces))
            self.assertEqual(hands_3d.header.frame_id, FRAME_ID)
            by_id = {found.person_ID: found for found in people}
            for hand in hands_3d.hands:
                side = 'left' if hand.side == HandDetection.LEFT else 'right'
                wrist = getattr(by_id[hand.person_ID], f'{side}_wrist')
                self.assertLess(np.linalg.norm(position(hand.keypoints[0]) - position(wrist)), NEAR)

    def test_nothing_is_looked_for_that_nobody_wants(self):
        await_true(self.is_quiet, 'no look for what nobody listens to')
        faces, = self.listen('faces_3d')
        faces.wait(1, self.send(3))
        self.await_asked('face')
        hands, = self.listen('hands')
        hands.wait(1, self.send(4))
        self.await_asked('hands face')

    def test_parameters_change_while_it_runs(self):
        hands, faces = self.listen('hands_3d', 'faces_3d')
        client = Client('known/extractor', timeout=PATIENCE)
        self.addCleanup(client.update_configuration, {'hands': True})
        hands.wait(1, self.send())
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
