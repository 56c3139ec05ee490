#!/usr/bin/python3
"""One process that finds people in the image and in space does what two nodes do, and serves detection to others."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from harness import OUTPUT, Camera, Output, ShippedSequence, now, of_joints
from openpose_ros_msgs.msg import PersonDetectionArray, Timing
from openpose_ros_msgs.srv import GetPersons

from demand import enable
from session import Diagnostics, Recorder, await_true
from skeleton_extract_3d.ros.extractor import AGE_STAGES, STAGES

# Frames of the shipped sequence that both forms are sent, before any of them loses sight of a person, and their rate:
# one expects people by tracks in space, the other one by tracks in the image, which agree over a short time.
FRAMES, RATE = 5, 15.0


class OneProcessTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_one_process')
        cls.sequence, cls.diagnostics = ShippedSequence(), Diagnostics()
        # no subscriber yet
        cls.diagnostics.await_state('one/people', 'idle: no subscriber')
        cls.one, cls.two = Output('one'), Output('two')
        cls.reports = Recorder('one/people/timing', Timing)
        cls.arrays_2d = Recorder(f'one/{OUTPUT}/detected_poses', PersonDetectionArray)
        rospy.wait_for_service('two/detect_poses_3d')
        cls.camera = Camera('/image', '/points', listeners=(2, 2))

    def send(self, number, stamp):
        """Send a frame; return what both forms made of it."""
        self.camera.send(*self.sequence.messages(number, stamp))
        return self.one.frame(stamp), self.two.frame(stamp)

    def test_both_forms_give_the_same_people(self):
        begin = now()
        for number in range(FRAMES):
            one, two = self.send(number, begin + rospy.Duration(number / RATE))
            self.assertEqual(len(one.persons), 2)
            self.assertEqual([found.person_ID for found in one.persons], [found.person_ID for found in two.persons])
            for mine, theirs in zip(one.persons, two.persons):
                for what in ('x', 'y', 'z', 'status', 'sigma', 'confidence'):
                    np.testing.assert_array_equal(of_joints(mine, what), of_joints(theirs, what), what)
            in_image = self.arrays_2d.wait(1, one.header.stamp)[0].persons
            self.assertEqual([found.person_ID for found in in_image],
                             [found.person_ID for found in one.persons][:len(in_image)])

    def test_the_age_is_split_by_stage(self):
        def report():
            self.send(2, now())
            found = [{stage.stage: stage for stage in report.stages} for report in self.reports.messages.copy()]
            return [stages for stages in found if stages['age'].count > 0]

        stages = await_true(report, 'a report')[-1]
        self.assertEqual(tuple(stages), STAGES)
        self.assertAlmostEqual(sum(stages[name].mean for name in AGE_STAGES) / stages['age'].mean, 1.0, delta=0.02)
        self.assertGreater(stages['detection'].p50, 0)

    def test_one_switch_rests_both_halves(self):
        call = rospy.ServiceProxy('one/detect_poses_3d', GetPersons)
        image, _ = self.sequence.messages(0, now())
        self.addCleanup(enable, 'one/people', True)
        self.assertTrue(enable('one/people', False))
        await_true(lambda: self.camera.images.get_num_connections() == 1, 'the image is not read')
        with self.assertRaises(rospy.ServiceException):
            call(image)
        self.assertTrue(enable('one/people', True))
        await_true(lambda: self.camera.images.get_num_connections() == 2, 'the image is read again')
        self.assertEqual(len(call(image).detections), 2)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_one_process', OneProcessTest, sys.argv)
