#!/usr/bin/python3
"""Without a subscriber, neither extractor nor visualization reads anything; the first one gets results at once."""
import sys
import time
import unittest

import rospy
import rostest
from harness import OUTPUT, Camera, FakeDetector, image, now
from openpose_ros_msgs.msg import PersonDetection_3dArray
from visualization_msgs.msg import Marker

from demand import FIRST_RESULT, enable, seconds_to_first_result, subscribe
from openpose_ros_pkg.ros.input_watch import PATIENCE as SILENCE
from openpose_ros_pkg.ros.threads import repeat
from session import Diagnostics, await_true

RATE = 30.0  # [Hz] of the camera
PEOPLE, MARKERS = (f'{OUTPUT}/detected_poses_3d', PersonDetection_3dArray), (f'{OUTPUT}/visualization_markers', Marker)


class DemandTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_demand')
        cls.diagnostics, cls.camera = Diagnostics(), Camera(listeners=(0, 0))
        cls.detector = FakeDetector('detect_poses_3d')
        # images without points, too briefly to say that the points are missing
        people = subscribe(*PEOPLE)
        cls.await_subscribers(1, 'the extractor reads its input')
        cls.camera.images.publish(image(0, now()))
        cls.alone_since = time.monotonic()
        people.close()
        cls.await_subscribers(0, 'the extractor leaves the camera')
        repeat(lambda: cls.camera.send_frame(1), 'camera', period=1 / RATE)

    @classmethod
    def await_subscribers(cls, number: int, what: str):
        """Wait until images and points have so many subscribers."""
        await_true(lambda: all(each.get_num_connections() == number for each in (cls.camera.images, cls.camera.points)),
                   what)

    def assert_idle(self):
        self.await_subscribers(0, 'the extractor leaves the camera')
        for node in ('extractor', 'visualization'):
            self.diagnostics.await_state(node, 'idle: no subscriber')
        answered = self.detector.answered
        time.sleep(3 / RATE)
        self.assertEqual(self.detector.answered, answered, 'no network runs')

    def test_the_first_result_comes_at_once(self):
        """People, and markers, which wake both nodes."""
        for topic in (PEOPLE, MARKERS):
            self.assertLess(seconds_to_first_result(*topic, self.assert_idle), FIRST_RESULT, topic)

    def test_nodes_that_need_no_subscriber(self):
        """A node that is not lazy, and one that publishes frames on /tf."""
        Camera('not_lazy/image', 'not_lazy/points', listeners=(2, 2))

    def test_disabled_they_read_nothing_and_say_so(self):
        markers = subscribe(*MARKERS)
        self.addCleanup(markers.close)
        markers.wait(1)
        for node in ('visualization', 'extractor'):
            self.addCleanup(enable, node, True)
            self.assertTrue(enable(node, False))
            # without the visualization, the extractor's results have no subscriber either
            self.await_subscribers(0, 'the extractor leaves the camera')
            self.diagnostics.await_state(node, 'disabled')
            self.assertTrue(enable(node, True))
            markers.wait(len(markers.messages) + 2)

    def test_an_input_that_is_not_read_is_not_missed(self):
        time.sleep(max(0.0, self.alone_since + 2 * SILENCE - time.monotonic()))
        self.assertFalse([text for text in self.diagnostics.texts('extractor') if 'no message on' in text])


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_demand', DemandTest, sys.argv)
