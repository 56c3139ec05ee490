#!/usr/bin/python3
"""Nobody listens: neither extractor nor visualization reads anything. Whoever comes gets results at once."""
import sys
import threading
import time
import unittest
from typing import Any, List, Optional, Tuple

import rospy
import rostest
from harness import OUTPUT, Camera, FakeDetector, image, now
from openpose_ros_msgs.msg import PersonDetection_3dArray
from std_srvs.srv import SetBool
from visualization_msgs.msg import Marker

from openpose_ros_pkg.ros.input_watch import PATIENCE as SILENCE
from session import PATIENCE, Diagnostics, await_true

RATE = 30.0  # [Hz] of the camera
# From the subscription to the first result [s]. Other programs may take the processor: the best of some tries counts.
FIRST_RESULT, TRIES = 0.3, 8


def enable(node: str, whether: bool) -> bool:
    """Enable or disable a node; tell whether it said so."""
    rospy.wait_for_service(f'{node}/enable', PATIENCE)
    answer = rospy.ServiceProxy(f'{node}/enable', SetBool)(whether)
    return answer.success and answer.message == ('enabled' if whether else 'disabled')


class Listener:
    """Subscribes as a user does, to what may not be published yet, and keeps what comes."""

    def __init__(self, topic: str, kind: type) -> None:
        self.messages: List[Any] = []
        self.seconds: Optional[float] = None
        """From the subscription to the first message [s]."""
        self._began = time.monotonic()
        self._subscriber = rospy.Subscriber(f'{OUTPUT}/{topic}', kind, self._keep)

    def _keep(self, message: Any) -> None:
        self.seconds = self.seconds or time.monotonic() - self._began
        self.messages.append(message)

    def __enter__(self) -> 'Listener':
        return self

    def __exit__(self, *_: object) -> None:
        self._subscriber.unregister()

    def wait(self, number: int) -> None:
        """Wait for so many more messages."""
        number += len(self.messages)
        await_true(lambda: len(self.messages) >= number, f'{number} messages')


class DemandTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_demand')
        cls.diagnostics, cls.camera = Diagnostics(), Camera(listeners=(0, 0))
        cls.detector = FakeDetector('detect_poses_3d')
        # images without points, too briefly to say that the points are missing
        with Listener('detected_poses_3d', PersonDetection_3dArray):
            await_true(lambda: cls.listeners() == (1, 1), 'the extractor listens')
            cls.camera.images.publish(image(0, now()))
            cls.alone_since = time.monotonic()
        await_true(lambda: cls.listeners() == (0, 0), 'the extractor leaves the camera')
        cls.stopped = threading.Event()
        cls.thread = threading.Thread(target=cls.film)
        cls.thread.start()

    @classmethod
    def tearDownClass(cls):
        cls.stopped.set()
        cls.thread.join()

    @classmethod
    def film(cls):
        while not cls.stopped.wait(1 / RATE):
            cls.camera.send_frame(1)

    @classmethod
    def listeners(cls) -> Tuple[int, int]:
        """Return how many nodes listen to images and points."""
        return cls.camera.images.get_num_connections(), cls.camera.points.get_num_connections()

    def assert_idle(self):
        await_true(lambda: self.listeners() == (0, 0), 'the extractor leaves the camera')
        for node in ('extractor', 'visualization'):
            self.diagnostics.await_state(node, 'idle: no subscriber')
        answered = self.detector.answered
        time.sleep(3 / RATE)
        self.assertEqual(self.detector.answered, answered, 'no network runs')

    def assert_first_result_at_once(self, topic: str, kind: type):
        """The first listener gets results quickly, and with the last one work ends."""
        seconds: List[float] = []
        while len(seconds) < TRIES and min(seconds, default=PATIENCE) > FIRST_RESULT:
            self.assert_idle()
            with Listener(topic, kind) as listener:
                listener.wait(1)
            seconds.append(listener.seconds)
        rospy.loginfo('first of %s after %s s', topic, ', '.join(f'{each:.3f}' for each in seconds))
        self.assertLess(min(seconds), FIRST_RESULT)
        self.assert_idle()

    def test_people(self):
        self.assert_first_result_at_once('detected_poses_3d', PersonDetection_3dArray)

    def test_markers_wake_both_nodes(self):
        self.assert_first_result_at_once('visualization_markers', Marker)

    def test_who_needs_no_listener(self):
        """Neither a node that is not lazy nor one that publishes frames on /tf."""
        Camera('not_lazy/image', 'not_lazy/points', listeners=(2, 2))

    def test_disabled_they_read_nothing_and_say_so(self):
        with Listener('visualization_markers', Marker) as markers:
            markers.wait(1)
            for node in ('visualization', 'extractor'):
                self.addCleanup(enable, node, True)
                self.assertTrue(enable(node, False))
                # without the visualization, nobody wants the extractor's results either
                await_true(lambda: self.listeners() == (0, 0), 'the extractor leaves the camera')
                self.diagnostics.await_state(node, 'disabled')
                self.assertTrue(enable(node, True))
                markers.wait(2)

    def test_an_input_that_nobody_reads_is_not_missed(self):
        time.sleep(max(0.0, self.alone_since + 2 * SILENCE - time.monotonic()))
        self.assertFalse([text for text in self.diagnostics.texts('extractor') if 'no message on' in text])


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_demand', DemandTest, sys.argv)
