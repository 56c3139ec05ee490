#!/usr/bin/python3
"""People in space by images and camera info alone; tests/unit/lift/test_monocular.py tests the joints."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from harness import (
    OUTSIDE,
    Camera,
    FakeDetector,
    Output,
    ShippedSequence,
    joints_of,
    need_weights,
    of_joints,
    person,
)
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from openpose_ros_pkg.networks.model_registry import POSE_LANDMARK
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED
from skeleton_extract_3d.ros.convert import camera_to_message

HIPS = [COCO_18.index['right_hip'], COCO_18.index['left_hip']]
# Frames in which both people are to be seen.
NUMBERS = range(8)
# A true distance is within this many reported sigma, and this share of the reported one.
SIGMAS, SHARE = 3.0, 0.25
# Greatest median distance of joints from the true ones, both from the middle of the hips [m].
RELATIVE = 0.15


class MonocularTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        need_weights(POSE_LANDMARK)
        rospy.init_node('check_monocular')
        cls.sequence, cls.detector = ShippedSequence(), FakeDetector('detect_poses_3d')
        cls.detector.answer = cls.detected
        cls.output = Output()
        cls.camera = Camera(points_topic='camera_info', points_type=CameraInfo)

    @classmethod
    def detected(cls, number: int):
        """Return the people of a frame by their true pixels."""
        return [person(truth.id, truth.pixels(truth.labels != OUTSIDE)) for truth in cls.sequence.people[number]]

    def test_people_are_in_space_without_depth(self):
        camera = self.sequence.frames.camera
        begin, ids = rospy.Time.from_sec(rospy.get_time()), []
        self.camera.points.publish(camera_to_message(camera, Header(stamp=begin)))
        rospy.sleep(0.5)  # so that it is there before the first image
        for number in NUMBERS:
            stamp = begin + rospy.Duration(1 + number / self.sequence.frames.fps)
            self.camera.images.publish(self.sequence.messages(number, stamp)[0])
            persons = self.output.frame(stamp).persons
            self.assertEqual(len(persons), 2)
            ids.append({found.person_ID for found in persons})
            for found, truth in zip(persons, self.sequence.people[number]):
                self.assertEqual(set(of_joints(found, 'status')), {INFERRED})
                joints, sigma = joints_of(found), of_joints(found, 'sigma')
                middle, true = (np.nanmean(each[HIPS], axis=0) for each in (joints, truth.xyz))
                away = np.linalg.norm(true)
                self.assertLess(abs(np.linalg.norm(middle) - away), min(SHARE * away, SIGMAS * sigma[HIPS].mean()))
                apart = np.linalg.norm((joints - middle) - (truth.xyz - true), axis=1)
                self.assertLess(np.median(apart), RELATIVE)
        self.assertEqual({frozenset(each) for each in ids}, {frozenset(ids[0])})


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_monocular', MonocularTest, sys.argv)
