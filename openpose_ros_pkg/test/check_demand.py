#!/usr/bin/python3
"""Nothing is read for nobody: the service node rests until somebody listens, and it and its client when disabled."""
import sys
import threading
import time
import unittest

import numpy as np
import rospy
import rostest
from harness import image, publisher
from openpose_ros_msgs.msg import PersonDetectionArray, Timing
from openpose_ros_msgs.srv import GetPersons
from sensor_msgs.msg import Image
from std_srvs.srv import SetBool

from session import PATIENCE, Diagnostics, Recorder, await_true

NODE, CLIENT = 'openpose_ros_service_node', 'openpose_ros_node'
GREY = np.full((96, 128, 3), 128, np.uint8)
RATE = 30.0  # [Hz] of the camera
# From the subscription to the first result [s]. Other programs may take the processor: the best of some tries counts.
FIRST_RESULT, TRIES = 0.3, 8


def listen():
    """Subscribe as a user does, to what may not be published yet."""
    return Recorder('openpose_ros/detected_poses', PersonDetectionArray, connect=False)


def enable(node, whether):
    rospy.wait_for_service(f'{node}/enable', PATIENCE)
    answer = rospy.ServiceProxy(f'{node}/enable', SetBool)(whether)
    return answer.success and answer.message == ('enabled' if whether else 'disabled')


class DemandTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.camera = rospy.Publisher('camera/image_raw', Image, queue_size=1)
        cls.diagnostics = Diagnostics(NODE, CLIENT)
        rospy.wait_for_service('detect_poses', PATIENCE)
        cls.detect = rospy.ServiceProxy('detect_poses', GetPersons)
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
            cls.camera.publish(image(GREY, rospy.get_time()))

    def assert_idle(self):
        await_true(lambda: self.camera.get_num_connections() == 0, 'the node leaves the camera')
        self.diagnostics.await_state(NODE, 'idle: no subscriber')

    def test_the_first_subscriber_gets_a_result_at_once_and_the_last_one_ends_the_work(self):
        seconds = []
        while len(seconds) < TRIES and min(seconds, default=PATIENCE) > FIRST_RESULT:
            self.assert_idle()
            begin = time.monotonic()
            results = listen()
            try:
                await_true(lambda results=results: results.messages, 'the first result')
                seconds.append(time.monotonic() - begin)
            finally:
                results.close()
        rospy.loginfo('first result after %s s', ', '.join(f'{each:.3f}' for each in seconds))
        self.assertLess(min(seconds), FIRST_RESULT)
        self.assert_idle()

    def test_nobody_wants_the_results_who_only_listens_to_the_timing(self):
        self.assert_idle()
        reports = Recorder(f'{NODE}/timing', Timing)
        self.addCleanup(reports.close)
        reports.wait(2)
        self.assertEqual(self.camera.get_num_connections(), 0)

    def test_a_client_is_answered_while_the_camera_rests(self):
        self.assert_idle()
        self.assertEqual(self.detect(image(GREY)).detections, [])
        self.assertEqual(self.camera.get_num_connections(), 0)

    def test_subscribers_who_come_and_go_quickly(self):
        """Whoever is there in the end gets results."""
        for number in range(30):
            results = listen()
            time.sleep(0.01 * (number % 7))
            results.close()
        results = listen()
        self.addCleanup(results.close)
        begin = rospy.Time.now()
        await_true(lambda: any(message.header.stamp > begin for message in results.messages.copy()), 'a result')

    def test_disabled_it_reads_nothing_and_says_so(self):
        self.addCleanup(enable, NODE, True)
        results = listen()
        self.addCleanup(results.close)
        results.wait(1)
        self.assertTrue(enable(NODE, False))
        await_true(lambda: self.camera.get_num_connections() == 0, 'the node leaves the camera')
        with self.assertRaisesRegex(rospy.ServiceException, f'{NODE} is disabled'):
            self.detect(image(GREY))
        self.diagnostics.await_state(NODE, 'disabled')
        self.assertEqual(self.diagnostics.value(NODE, 'enabled'), 'false')
        self.assertTrue(enable(NODE, True))
        number = len(results.messages)
        results.wait(number + 3)
        self.assertEqual(self.detect(image(GREY)).detections, [])

    def test_a_client_that_is_disabled_sends_nothing(self):
        self.addCleanup(enable, CLIENT, True)
        camera = publisher('other_camera/image_raw', Image)
        camera.publish(image(GREY))
        self.diagnostics.await_count(CLIENT, 'frames', 1)
        self.assertTrue(enable(CLIENT, False))
        self.diagnostics.await_state(CLIENT, 'disabled')
        await_true(lambda: camera.get_num_connections() == 0, 'the client leaves the camera')
        self.assertTrue(enable(CLIENT, True))
        await_true(camera.get_num_connections, 'the client is back')
        camera.publish(image(GREY))
        self.diagnostics.await_count(CLIENT, 'frames', 2)


if __name__ == '__main__':
    rospy.init_node('demand_test')
    rostest.rosrun('openpose_ros_pkg', 'demand', DemandTest, sys.argv)
