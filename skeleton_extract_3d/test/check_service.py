#!/usr/bin/python3
"""The extractor waits for its service, gives hung calls up, and finds a service that was restarted."""
import sys
import threading
import unittest

import rospy
import rostest
from harness import Camera, FakeDetector, Output, person

from session import PATIENCE, Diagnostics, await_true

NODE, FAILED = 'extractor', 'service call failed'


class ServiceTest(unittest.TestCase):
    def test_missing_then_there_then_hung_then_restarted(self):
        rospy.init_node('check_service')
        self.output, self.diagnostics, self.camera = Output(), Diagnostics(), Camera()

        # not there when the first frames come
        stamp = self.camera.send_frame(1)
        self.diagnostics.await_event(NODE, FAILED, 1, ['detect_poses_3d'])
        detector = FakeDetector('detect_poses_3d')
        self.frames_come_again(2)
        self.assertFalse(self.output.has(stamp))

        # hangs
        go_on, began = threading.Event(), threading.Event()
        self.addCleanup(go_on.set)

        def hang_once(number):
            # frames 2 may still be on their way
            if number == 3:
                began.set()
                go_on.wait()
            return [person(number, {'nose': (20, 30)})]

        detector.answer, failures = hang_once, self.diagnostics.count(NODE, FAILED)
        stamp = self.camera.send_frame(3)
        self.assertTrue(began.wait(PATIENCE))
        self.diagnostics.await_event(NODE, FAILED, failures + 1, ['no answer', '0.5 s'])
        self.frames_come_again(4)
        go_on.set()
        self.frames_come_again(5)
        self.assertFalse(self.output.has(stamp))

        # dies and comes back
        detector.shutdown()
        failures = self.diagnostics.count(NODE, FAILED)
        self.camera.send_frame(6)
        self.diagnostics.await_event(NODE, FAILED, failures + 1)
        FakeDetector('detect_poses_3d')
        self.frames_come_again(7)

    def frames_come_again(self, number):
        """Send frames as a camera does until one comes out."""
        stamps = []

        def one_came():
            stamps.append(self.camera.send_frame(number))
            rospy.sleep(0.03)
            return any(self.output.has(stamp) for stamp in stamps)

        await_true(one_came, f'people of one of the frames {number}')
        self.assertEqual(self.output.arrays[-1].persons[0].person_ID, number)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_service', ServiceTest, sys.argv)
