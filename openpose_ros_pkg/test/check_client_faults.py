#!/usr/bin/python3
"""The client node on what goes wrong: services that hang, compressed images that are none."""
import sys
import threading
import unittest

import cv2
import numpy as np
import rospy
import rostest
from harness import image, picture, publisher
from openpose_ros_msgs.srv import GetPersons
from sensor_msgs.msg import CompressedImage, Image

from session import Diagnostics, Recorder, await_true

HUNG, COMPRESSED = 'hung/openpose_ros_node', 'compressed/openpose_ros_node'
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


class HungServiceTest(unittest.TestCase):
    """A service that does not answer costs `service_timeout` and is counted; the next image works."""

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

    def test_it_hangs_in_the_middle_of_a_call(self):
        with FakeService('hung/detect_poses') as service:
            self.assert_goes_on(service)
            failed = self.diagnostics.count(HUNG, 'service call failed')
            service.hang(True)
            for number in (1, 2):
                self.camera.publish(image(GREY))
                self.diagnostics.await_count(HUNG, 'service call failed', failed + number)
            self.diagnostics.await_text(HUNG, '/hung/detect_poses: no answer within 0.5 s')
            service.hang(False)
            self.assert_goes_on(service)


class CompressedTest(unittest.TestCase):

    def test_compressed_images(self):
        camera = publisher('compressed/image_raw/compressed', CompressedImage)
        diagnostics = Diagnostics(COMPRESSED)
        bgr = picture(0)
        with FakeService('compressed/detect_poses') as service:
            sent = Recorder('compressed/openpose_ros/input_image', Image)
            good = CompressedImage(format='png', data=cv2.imencode('.png', bgr)[1].tobytes())
            good.header.stamp, good.header.frame_id = rospy.Time(7, 5), 'compressed camera'
            camera.publish(good)
            diagnostics.await_count(COMPRESSED, 'frames', 1)
            for received in (service.images[0], sent.wait(1)[0]):
                self.assertEqual((received.header.stamp, received.header.frame_id), (good.header.stamp,
                                                                                    'compressed camera'))
                self.assertEqual((received.width, received.height, received.encoding), (960, 540, 'bgr8'))
                self.assertEqual(received.data, bgr.tobytes())

            camera.publish(CompressedImage(format='jpeg', data=b'garbage'))
            diagnostics.await_count(COMPRESSED, 'bad image', 1)
            diagnostics.await_text(COMPRESSED, "'jpeg' and 7 bytes")
            camera.publish(good)
            diagnostics.await_count(COMPRESSED, 'frames', 2)
            self.assertEqual(len(service.images), 2)


if __name__ == '__main__':
    rospy.init_node('client_faults_test')
    rostest.rosrun('openpose_ros_pkg', 'client_faults', 'check_client_faults', sys.argv)
