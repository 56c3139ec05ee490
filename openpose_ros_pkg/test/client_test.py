#!/usr/bin/python3
"""The client node: camera -> client -> service, with services that are late, die, hang or refuse."""
import socket
import sys
import threading
import unittest

import cv2
import numpy as np
import rosgraph
import rospy
import rostest
from openpose_ros_msgs.msg import PersonDetectionArray
from openpose_ros_msgs.srv import GetPersons
from ros_test_tools import Counters, Recorder, distance, image, joints, node, picture, true_people, wait_for
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CompressedImage, Image

SERVICE_NODE = 'openpose_ros_service_node'
FAST = ('_net_input_width:=464', '_net_input_height:=256')
FRAMES = 40  # of the sequence that the camera plays
ACCURACY = 10.0  # [px] of the median joint; people move by 10 to 20 from frame to frame
GREY = np.full((48, 64, 3), 128, np.uint8)


class FakeService:
    """Stands in for the detection service; keeps the images that it is sent and finds nobody.

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


def publisher(topic, kind):
    """A publisher whose subscriber is there."""
    result = rospy.Publisher(topic, kind, queue_size=10)
    wait_for(lambda: result.get_num_connections() > 0, f'a subscriber of {topic}')
    return result


class ChainTest(unittest.TestCase):
    """One story of the whole chain."""

    def test_late_killed_restarted_and_bad_image(self):
        log = Recorder('/rosout', Log)
        sent = Recorder('openpose_ros/input_image', Image)
        arrays = Recorder('openpose_ros/detected_poses', PersonDetectionArray, connect=False)
        counters = Counters('openpose_ros_node')

        # no service yet: says so; the camera's images are handed on all the same
        counters.wait('service call failed', 1)
        counters.wait_text('/detect_poses', 'unavailable')
        wait_for(lambda: any('waiting for service /detect_poses' in m.msg for m in log.messages.copy()),
                 'the client says that it waits')
        self.assertEqual(counters['frames'], 0)
        first = sent.wait(1)[0]
        self.assertEqual((first.width, first.height, first.encoding), (960, 540, 'bgr8'))
        self.assertEqual(first.header.frame_id, 'camera_optical_frame')

        # it comes: the client goes on, with the camera's stamps, and the people are those of its picture
        with node('openpose_ros_node', *FAST, name=SERVICE_NODE) as service:
            self.assert_results_come(sent, arrays)
            counters.wait('frames', 3)

            # an image that is cut off is refused by the service, counted, and the next ones work
            service_counters = Counters(SERVICE_NODE)
            before = counters['service call failed']
            camera = publisher('/usb_cam/image_raw', Image)
            cut_off = image(GREY)
            cut_off.data = cut_off.data[:100]

            def counted():
                camera.publish(cut_off)  # again and again, as the camera's next image may take its place
                return service_counters['bad image'] > 0 and counters['service call failed'] > before
            wait_for(counted, 'the image that is cut off is counted')
            counters.wait_text('truncated', '100 bytes', 'expected 9216')
            self.assert_results_come(sent, arrays)

            # it dies without a word, and returns
            failed = counters['service call failed']
            service.kill()
            service.wait()
        wait_for(lambda: counters['service call failed'] > failed, 'the client notices that the service died')
        with node('openpose_ros_node', *FAST, name=SERVICE_NODE):
            self.assert_results_come(sent, arrays)

    def assert_results_come(self, sent, arrays):
        """New results come, of images that were sent, and one with both people shows them where they are."""
        start = len(arrays.messages)
        # frames that show most of both people
        truth = [people for people in map(true_people, range(FRAMES)) if min(map(len, people)) >= 11]

        def right():
            for array in arrays.messages[start:]:
                found = [joints(person) for person in array.persons]
                for people in truth:
                    if len(found) == 2 and all(min(distance(t, f) for f in found) < ACCURACY for t in people):
                        return array
            return None
        array = wait_for(right, lambda: f'both people of one of the frames; '
                                        f'{[len(a.persons) for a in arrays.messages[start:]]} people came')
        sent.wait(1, array.header.stamp)


class HungServiceTest(unittest.TestCase):
    """A service that does not answer costs `service_timeout` and is counted; the next image works."""

    @classmethod
    def setUpClass(cls):
        cls.counters = Counters('hung/openpose_ros_node')
        cls.camera = publisher('hung/image_raw', Image)

    def assert_goes_on(self, service):
        """Only images from now on count."""
        before, frames = len(service.images), self.counters['frames']
        stamp = rospy.Time.now()

        def answered():
            self.camera.publish(image(GREY, stamp.to_sec()))
            return any(m.header.stamp == stamp for m in service.images[before:]) and self.counters['frames'] > frames
        wait_for(answered, 'the client goes on')

    def test_it_hangs_in_the_middle_of_a_call(self):
        with FakeService('hung/detect_poses') as service:
            self.assert_goes_on(service)
            failed = self.counters['service call failed']
            service.hang(True)
            for number in (1, 2):
                self.camera.publish(image(GREY))
                self.counters.wait('service call failed', failed + number)
            self.counters.wait_text('no answer from /hung/detect_poses within 0.5 s')
            service.hang(False)
            self.assert_goes_on(service)

    def test_it_does_not_even_let_callers_in(self):
        """As a process that was stopped: the system takes the connection, and nobody talks."""
        failed = self.counters['service call failed']
        with socket.socket() as listener:
            listener.bind(('localhost', 0))
            listener.listen(20)
            uri = f'rosrpc://localhost:{listener.getsockname()[1]}'
            master = rosgraph.Master(rospy.get_name() + '_stopped')
            master.registerService('/hung/detect_poses', uri, 'http://localhost:1/')
            try:
                for number in (1, 2):
                    self.camera.publish(image(GREY))
                    self.counters.wait('service call failed', failed + number)
            finally:
                master.unregisterService('/hung/detect_poses', uri)
        with FakeService('hung/detect_poses') as service:
            self.assert_goes_on(service)


class CompressedTest(unittest.TestCase):

    def test_compressed_images(self):
        camera = publisher('compressed/image_raw/compressed', CompressedImage)
        counters = Counters('compressed/openpose_ros_node')
        bgr = picture(0)
        with FakeService('compressed/detect_poses') as service:
            sent = Recorder('compressed/openpose_ros/input_image', Image)
            good = CompressedImage(format='png', data=cv2.imencode('.png', bgr)[1].tobytes())
            good.header.stamp, good.header.frame_id = rospy.Time(7, 5), 'compressed camera'
            camera.publish(good)
            counters.wait('frames', 1)
            for received in (service.images[0], sent.wait(1)[0]):
                self.assertEqual((received.header.stamp, received.header.frame_id), (good.header.stamp,
                                                                                    'compressed camera'))
                self.assertEqual((received.width, received.height, received.encoding), (960, 540, 'bgr8'))
                self.assertEqual(received.data, bgr.tobytes())

            camera.publish(CompressedImage(format='jpeg', data=b'garbage'))
            counters.wait('bad image', 1)
            counters.wait_text("'jpeg' and 7 bytes")
            camera.publish(good)
            counters.wait('frames', 2)
            self.assertEqual(len(service.images), 2)


class SuiteTest(unittest.TestSuite):

    def __init__(self):
        load = unittest.defaultTestLoader.loadTestsFromTestCase
        super().__init__(load(case) for case in (ChainTest, HungServiceTest, CompressedTest))


if __name__ == '__main__':
    rospy.init_node('client_test')
    rostest.rosrun('openpose_ros_pkg', 'client', 'client_test.SuiteTest', sys.argv)
