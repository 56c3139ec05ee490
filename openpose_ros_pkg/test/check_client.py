#!/usr/bin/python3
"""The client node, with a service that is late, refuses, dies and returns, or hangs."""
import sys
import threading
import unittest

import numpy as np
import rospy
import rostest
from harness import distance, image, joints, node, publisher, true_people
from openpose_ros_msgs.msg import PersonDetectionArray
from openpose_ros_msgs.srv import GetPersons
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image

from session import Diagnostics, Recorder, await_true

CLIENT, SERVICE_NODE, FAILED = 'openpose_ros_node', 'openpose_ros_service_node', 'service call failed'
HUNG = 'hung/openpose_ros_node'
FAST = ('_net_input_width:=464', '_net_input_height:=256', '_target_rate:=0')
FRAMES = 40  # of the sequence that the camera plays
ACCURACY = 10.0  # [px] of the median joint; people move by 10 to 20 from frame to frame
GREY = np.full((48, 64, 3), 128, np.uint8)


class ChainTest(unittest.TestCase):
    """One story of the whole chain."""

    def test_late_killed_restarted_and_bad_image(self):
        log = Recorder('/rosout', Log)
        sent = Recorder('openpose_ros/input_image', Image)
        arrays = Recorder('openpose_ros/detected_poses', PersonDetectionArray, connect=False)
        diagnostics = Diagnostics(CLIENT)

        # no service yet: says so; the camera's images are handed on all the same
        diagnostics.await_count(CLIENT, FAILED, 1)
        diagnostics.await_text(CLIENT, '/detect_poses', 'unavailable')
        await_true(lambda: any('waiting for service /detect_poses' in m.msg for m in log.messages.copy()),
                   'the client says that it waits')
        self.assertEqual(diagnostics.count(CLIENT, 'frames'), 0)
        first = sent.wait(1)[0]
        self.assertEqual((first.width, first.height, first.encoding), (960, 540, 'bgr8'))
        self.assertEqual(first.header.frame_id, 'camera_optical_frame')

        # it comes: the client goes on, with the camera's stamps, and the people are those of its picture
        with node('openpose_ros_node', *FAST, name=SERVICE_NODE) as service:
            self.assert_results_come(sent, arrays)
            diagnostics.await_count(CLIENT, 'frames', 3)

            # it dies without a word, and returns; the counters show all failures before
            diagnostics.await_count(CLIENT, 'frames', diagnostics.count(CLIENT, 'frames') + 1)
            failed = diagnostics.count(CLIENT, FAILED)
            service.kill()
            service.wait()
        await_true(lambda: diagnostics.count(CLIENT, FAILED) > failed, 'the client notices that the service died')
        with node('openpose_ros_node', *FAST, name=SERVICE_NODE):
            self.assert_results_come(sent, arrays)

    def assert_results_come(self, sent, arrays):
        """Results of images from now on that were sent come, and one with both people shows them where they are."""
        begin = rospy.Time.now()
        # frames that show most of both people
        truth = [people for people in map(true_people, range(FRAMES)) if min(map(len, people)) >= 11]

        def come():
            # some of the images may be lost on their way to this test
            stamps = {message.header.stamp for message in sent.messages.copy()}
            return [array for array in arrays.messages.copy()
                    if array.header.stamp > begin and array.header.stamp in stamps]

        def right():
            for array in come():
                found = [joints(person) for person in array.persons]
                for people in truth:
                    if len(found) == 2 and all(min(distance(t, f) for f in found) < ACCURACY for t in people):
                        return True
            return False
        await_true(right, lambda: f'both people of one of the frames; {[len(a.persons) for a in come()]} people came')


class FakeService:
    """Stands in for the detection service; keeps the images that it is sent and finds no person.

    Answers wait while `hangs` is true.
    """

    def __init__(self, name):
        self.images = []
        self._go_on = threading.Event()
        self._go_on.set()
        self._service = rospy.Service(name, GetPersons, self._serve)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._go_on.set()
        self._service.shutdown('end of the test')

    def hang(self, hangs):
        (self._go_on.clear if hangs else self._go_on.set)()

    def _serve(self, request):
        self.images.append(request.image)
        self._go_on.wait()
        return [[]]


class FaultsTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.diagnostics = Diagnostics(HUNG)
        cls.camera = publisher('hung/image_raw', Image)

    def assert_goes_on(self, service):
        """Only images from now on count."""
        before, frames = len(service.images), self.diagnostics.count(HUNG, 'frames')
        stamp = rospy.Time.now()

        def answered():
            self.camera.publish(image(GREY, stamp.to_sec()))
            return (any(m.header.stamp == stamp for m in service.images[before:])
                    and self.diagnostics.count(HUNG, 'frames') > frames)
        await_true(answered, 'the client goes on')

    def test_a_service_that_hangs_in_the_middle_of_a_call(self):
        """It costs `service_timeout` and is counted; the next image works."""
        with FakeService('hung/detect_poses') as service:
            self.assert_goes_on(service)
            failed = self.diagnostics.count(HUNG, FAILED)
            service.hang(True)
            for number in (1, 2):
                self.camera.publish(image(GREY))
                self.diagnostics.await_count(HUNG, FAILED, failed + number)
            self.diagnostics.await_text(HUNG, '/hung/detect_poses: no answer within 0.5 s')
            service.hang(False)
            self.assert_goes_on(service)


if __name__ == '__main__':
    rospy.init_node('client_test')
    rostest.rosrun('openpose_ros_pkg', 'client', 'check_client', sys.argv)
