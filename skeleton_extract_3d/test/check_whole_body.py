#!/usr/bin/python3
"""Hands and faces of a network for whole bodies, from the crop that is computed for the body, as messages."""
import sys
import unittest

import cv2
import numpy as np
import rospy
import rostest
from harness import OUTPUT, Camera, now, position
from openpose_ros_msgs.msg import (
    BodypartDetection_3d,
    FaceDetection_3dArray,
    FaceDetectionArray,
    HandDetection,
    HandDetection_3dArray,
    HandDetectionArray,
    PersonDetection_3dArray,
)
from std_msgs.msg import Header

from openpose_ros_pkg.ros.convert import bgr_to_image
from session import Diagnostics, Recorder
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.ros.convert import cloud_to_message
from stand_in_networks import chart
from whole_bodies import FACE, HANDS, PEOPLE, SIZE, whole

KINDS = {'hands': HandDetectionArray, 'faces': FaceDetectionArray, 'hands_3d': HandDetection_3dArray,
         'faces_3d': FaceDetection_3dArray}
DEPTH, RELIEF, FOCAL, FRAME_ID = 3.0, 0.022, 500.0, 'test_optical_frame'
# Points are in bins of half a pixel of a crop that is smaller than its part of the image [px].
NEAR = 1.5


def pixels(keypoints):
    return np.array([(point.x, point.y) for point in keypoints])


class WholeBodyTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_whole_body')
        cls.people = Recorder(f'{OUTPUT}/detected_poses_3d', PersonDetection_3dArray)
        cls.camera, cls.diagnostics = Camera('/image', '/points'), Diagnostics('people')
        camera = CameraModel(*SIZE, [FOCAL, 0, 319.5, 0, FOCAL, 239.5, 0, 0, 1])
        depth = np.full(SIZE[::-1], DEPTH + 1.0)
        for person in PEOPLE:  # they stand before a wall
            outline = cv2.convexHull(np.round(whole(person)).astype(np.int32))
            cv2.polylines(cv2.fillConvexPoly(depth, outline, DEPTH), [outline], True, DEPTH, thickness=20)
        depth += RELIEF * np.sin(np.arange(SIZE[1]) / 20)[:, None]  # and are no pictures: a body is not flat
        cls.cloud = cloud_from_depth(depth, camera, chart(*SIZE))

    def send(self):
        header = Header(stamp=now(), frame_id=FRAME_ID)
        self.camera.send(bgr_to_image(chart(*SIZE), header), cloud_to_message(self.cloud, header))
        return self.people.wait(1, header.stamp)[0]

    def test_hands_and_faces_are_those_of_the_network_for_the_body(self):
        recorders = {name: Recorder(f'{OUTPUT}/detected_{name}', kind) for name, kind in KINDS.items()}
        for _ in range(3):
            array = self.send()
        found = {name: recorder.wait(1, array.header.stamp)[0] for name, recorder in recorders.items()}
        # the neck tells the people: one is left of the middle
        true = {person.person_ID: whole(PEOPLE[int(person.neck.x > 0)]) for person in array.persons}
        self.assertEqual(len(true), 2)
        self.assertEqual(array.pose_model, 'BODY_25')
        sides = [(person, side) for person in true for side in (HandDetection.LEFT, HandDetection.RIGHT)]
        self.assertEqual(sorted((hand.person_ID, hand.side) for hand in found['hands'].hands), sorted(sides))
        for hand in found['hands'].hands:
            side = HANDS['left' if hand.side == HandDetection.LEFT else 'right']
            np.testing.assert_allclose(pixels(hand.keypoints), true[hand.person_ID][side], atol=NEAR)
        self.assertEqual(sorted(face.person_ID for face in found['faces'].faces), sorted(true))
        for face in found['faces'].faces:
            np.testing.assert_allclose(pixels(face.keypoints)[:68], true[face.person_ID][FACE], atol=NEAR)
        self.check_in_space(found, true)
        for person in array.persons:
            heel = position(person.left_heel)
            self.assertLess(np.linalg.norm(heel - position(person.left_ankle)), 0.2)
        # no network for hands and faces is missing, as none is loaded
        self.assertFalse([text for text in self.diagnostics.texts('people') if 'landmark' in text])

    def check_in_space(self, found, true):
        self.assertEqual(len(found['hands_3d'].hands), 4)
        for hand in found['hands_3d'].hands:
            self.assertEqual({part.status for part in hand.keypoints}, {BodypartDetection_3d.MEASURED})
            xyz = np.array([position(part) for part in hand.keypoints])
            np.testing.assert_allclose(xyz[:, 2], DEPTH, atol=0.03 + RELIEF)
            side = HANDS['left' if hand.side == HandDetection.LEFT else 'right']
            uv = FOCAL * xyz[:, :2] / xyz[:, 2:] + (319.5, 239.5)
            np.testing.assert_allclose(uv, true[hand.person_ID][side], atol=NEAR)
        self.assertEqual(len(found['faces_3d'].faces), 2)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_whole_body', WholeBodyTest, sys.argv)
