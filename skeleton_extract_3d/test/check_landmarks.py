#!/usr/bin/python3
"""Hands and faces come with the people of a frame, while somebody listens to them."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from harness import FRAME_ID, OUTPUT, Camera, Output, ShippedSequence, joints_of, need_weights, now
from openpose_ros_msgs.msg import (
    BodypartDetection_3d,
    FaceDetection_3dArray,
    FaceDetectionArray,
    HandDetection_3d,
    HandDetection_3dArray,
    HandDetectionArray,
    Timing,
)
from std_msgs.msg import Header

from openpose_ros_pkg.networks.model_registry import FACE_LANDMARK, HAND_LANDMARK
from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.skeletons import COCO_18
from session import await_true, is_heard
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.ros.convert import cloud_to_message

# Frames that show both people.
FRAMES = range(6)
TOPICS = {'detected_hands': HandDetectionArray, 'detected_faces': FaceDetectionArray,
          'detected_hands_3d': HandDetection_3dArray, 'detected_faces_3d': FaceDetection_3dArray}
# A measured point of a hand is at most this far from the wrist of the body [m].
HAND_REACH = 0.3
# Of hands and faces where none are computed [ms]; the networks take longer for one person.
NO_TIME = 2.0


class LandmarksTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_landmarks')
        cls.sequence, cls.people, cls.stages = ShippedSequence().frames, Output(), []
        rospy.Subscriber('people/timing', Timing, cls.stages.append)
        cls.camera = Camera('/image', '/points')

    def send(self, number):
        """Send a frame; return its stamp and people."""
        frame, header = self.sequence.frame(number), Header(stamp=now(), frame_id=FRAME_ID)
        cloud = cloud_from_depth(frame.depth * 0.001, self.sequence.camera, frame.bgr)
        self.camera.send(bgr_to_image(frame.bgr, header), cloud_to_message(cloud, header))
        return header.stamp, self.people.frame(header.stamp)

    def nothing_is_computed(self):
        """Send a frame, and tell whether a report says that hands and faces took no time.

        By the median: where other programs take the processor, a frame may take any time.
        """
        self.send(0)
        return any(stage.p50 < NO_TIME for timing in list(self.stages) for stage in timing.stages
                   if stage.stage == 'landmarks' and stage.count)

    def test_hands_and_faces_are_computed_for_who_listens(self):
        need_weights(HAND_LANDMARK), need_weights(FACE_LANDMARK)
        await_true(self.nothing_is_computed, 'a report of frames without hands and faces, as nobody listens')
        arrays = {topic: [] for topic in TOPICS}
        subscribers = [rospy.Subscriber(f'{OUTPUT}/{topic}', kind, arrays[topic].append)
                       for topic, kind in TOPICS.items()]
        for subscriber in subscribers:
            self.addCleanup(subscriber.unregister)
            await_true(lambda topic=subscriber.name: is_heard(topic), 'the topics are there')
        found = dict.fromkeys(TOPICS, 0)
        for number in FRAMES:
            stamp, people = self.send(number)
            ids = {person.person_ID: person for person in people.persons}
            for topic in TOPICS:
                array = await_true(lambda topic=topic, stamp=stamp: next(
                    (array for array in list(arrays[topic]) if array.header.stamp == stamp), None), topic)
                self.assertEqual(array.header.frame_id, FRAME_ID)
                parts = array.hands if 'hands' in topic else array.faces
                self.assertLessEqual({part.person_ID for part in parts}, set(ids))
                found[topic] += len(parts)
                if topic == 'detected_hands_3d':
                    for hand in parts:
                        self.check_hand(hand, ids[hand.person_ID])
        self.assertGreaterEqual(found['detected_hands'], len(FRAMES))
        self.assertGreaterEqual(found['detected_hands_3d'], len(FRAMES))
        self.assertEqual(found['detected_faces'], found['detected_faces_3d'])

    def check_hand(self, hand, person):
        """Check that the measured points of a hand are where the person has that wrist."""
        side = 'left' if hand.side == HandDetection_3d.LEFT else 'right'
        wrist = joints_of(person)[COCO_18.index[f'{side}_wrist']]
        points = np.array([(part.x, part.y, part.z) for part in hand.keypoints
                           if part.status == BodypartDetection_3d.MEASURED])
        self.assertTrue(len(points) == 0 or np.median(np.linalg.norm(points - wrist, axis=1)) < HAND_REACH)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_landmarks', LandmarksTest, sys.argv)
