#!/usr/bin/python3
"""The service node in stream mode: results of a camera's newest images, the timing report, clients beside it."""
import sys
import time
import unittest

import cv2
import numpy as np
import rospy
import rostest
from harness import distance, image, joints, picture, publisher, true_people
from openpose_ros_msgs.msg import PersonDetectionArray, Timing
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from openpose_ros_pkg.ros.convert import compressed_image_to_bgr, image_to_bgr
from session import Diagnostics, Recorder, await_true

NODE = 'openpose_ros_service_node'
# [px] The fields of the small input that this test uses have one value for 17 x 17 pixels of the picture; measured up
# to 19 for the median joint. The people are 150 to 400 apart.
ACCURACY = 25.0
GREY = np.full((48, 64, 3), 128, np.uint8)


class StreamTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.arrays = Recorder('openpose_ros/detected_poses', PersonDetectionArray)
        cls.camera = publisher('camera/image_raw', Image)
        cls.diagnostics = Diagnostics(NODE)

    def result_of(self, message, camera=None, recorder=None):
        """Send the image until its result, or another output, is there: the node may be at work on another one."""
        recorder = recorder or self.arrays

        def results():
            (camera or self.camera).publish(message)
            return [output for output in recorder.messages if output.header.stamp == message.header.stamp]
        return await_true(results, f'{recorder.topic} of an image')[0]

    def listen(self, topic, kind):
        """Return the recorder of an output while this test runs."""
        recorder = Recorder(f'openpose_ros/{topic}', kind)
        self.addCleanup(recorder.close)
        return recorder

    def assert_people(self, array, number):
        found, truth = [joints(person) for person in array.persons], true_people(number)
        self.assertEqual(len(found), len(truth))
        for person in truth:
            self.assertLess(min(distance(person, other) for other in found), ACCURACY)

    def test_people_of_the_cameras_images(self):
        for number, stamp in ((0, 10.0), (8, 11.0)):
            array = self.result_of(image(picture(number), stamp, 'stream'))
            self.assert_people(array, number)
            self.assertEqual(array.header.frame_id, 'stream')
        self.assertEqual(self.result_of(image(GREY, 12.0)).persons, [])

    def test_the_newest_wins_and_results_come_in_order(self):
        """A camera far faster than the network: every result is newer than the one before; the last image gets one."""
        self.result_of(image(GREY, 29.0))
        skipped, first = self.diagnostics.count(NODE, 'images skipped'), len(self.arrays.messages)
        stamps = [30.0 + number / 100 for number in range(100)]
        pictures = [image(picture(number), 0.0, 'fast') for number in (0, 1)]
        for number, stamp in enumerate(stamps):
            message = pictures[number % 2]
            message.header.stamp = rospy.Time.from_sec(stamp)
            self.camera.publish(message)
            time.sleep(0.01)
        await_true(lambda: self.arrays.messages[-1].header.stamp.to_sec() > stamps[-10], 'the result of a late image')
        found = [array.header.stamp.to_sec() for array in self.arrays.messages[first:]]
        found = [stamp for stamp in found if stamp >= stamps[0]]
        self.assertEqual(found, sorted(set(found)))
        self.assertLess(len(found), len(stamps))
        await_true(lambda: self.diagnostics.count(NODE, 'images skipped') > skipped, 'skipped images are counted')

    def test_what_is_drawn_comes_as_jpeg_too(self):
        """The JPEG shows the raw message. After test_timing, by its name: that one sees that nothing has been drawn."""
        drawn = self.listen('detected_poses_image', Image)
        jpegs = self.listen('detected_poses_image/compressed', CompressedImage)
        message = image(picture(0), 25.0, 'drawn')
        raw, jpeg = (self.result_of(message, recorder=recorder) for recorder in (drawn, jpegs))
        self.assertEqual((jpeg.format, jpeg.header.frame_id), ('bgr8; jpeg compressed bgr8', 'drawn'))
        difference = cv2.absdiff(compressed_image_to_bgr(jpeg), image_to_bgr(raw))
        self.assertLess(difference.mean(), 3.0)  # grey values of 255, at quality 80
        self.assertGreater(cv2.absdiff(image_to_bgr(raw), picture(0)).mean(), 1.0)  # there is something drawn

    def test_the_camera_info_of_the_camera_is_passed_on(self):
        """But not to an image of another size."""
        infos, message = self.listen('camera_info', CameraInfo), image(picture(0), 27.0, 'calibrated')
        calibration = publisher('camera/camera_info', CameraInfo)
        self.result_of(message)
        self.assertEqual(infos.messages, [])

        def info():
            calibration.publish(CameraInfo(width=960, height=540, K=np.diag([500.0, 510.0, 1.0]).ravel(), D=[0.1] * 5))
            self.camera.publish(message)
            return infos.messages
        found = await_true(info, 'the camera info')[-1]
        self.assertEqual((found.header.stamp, found.header.frame_id), (message.header.stamp, 'calibrated'))
        self.assertEqual((found.K[0], found.K[4], found.D), (500.0, 510.0, (0.1,) * 5))
        before = self.diagnostics.count(NODE, 'camera info of another image')
        self.result_of(image(GREY, 28.0))
        self.diagnostics.await_count(NODE, 'camera info of another image', before + 1)
        self.assertNotIn(28.0, [other.header.stamp.to_sec() for other in infos.messages])

    def test_timing(self):
        """Each stage of an image that passed; without a subscriber nothing is drawn."""
        reports = Recorder(f'{NODE}/timing', Timing)
        self.addCleanup(reports.close)
        self.result_of(image(picture(0), 70.0, 'timing'))
        since = rospy.get_time()

        def report():
            """The node adds the times of an image after it has published the result."""
            found = [{stage.stage: stage for stage in message.stages} for message in reports.messages.copy()
                     if message.header.stamp.to_sec() > since]
            return [stages for stages in found if stages['total'].count > 0]
        stages = await_true(report, 'a report')[0]
        self.assertEqual(list(stages), ['wait', 'decode_message', 'detection', 'publish', 'total', 'landmarks',
                                        'search', 'draw'])
        self.assertEqual(stages['draw'].count, 0)
        for name in ('wait', 'decode_message', 'detection', 'publish', 'total'):
            self.assertGreater(stages[name].count, 0, name)
            self.assertGreater(stages[name].p50, 0.0, name)
            self.assertGreaterEqual(stages[name].p95, stages[name].p50, name)
        # network of the small input: a few milliseconds at least on any processor; a second would be a wrong unit
        self.assertTrue(1.0 < stages['detection'].p50 < 5000.0)
        self.assertGreater(stages['total'].p95, stages['detection'].p50)
        await_true(lambda: self.diagnostics.value(NODE, 'detection, median [ms]'), 'the time of the detection')

        self.result_of(image(picture(0), 71.0, 'timing'), recorder=self.listen('detected_poses_image', Image))
        await_true(lambda: {stage.stage: stage.count for stage in reports.messages[-1].stages}['draw'] > 0,
                   'the time of a drawing')

    def test_compressed_images_and_the_3d_names(self):
        arrays = Recorder('compressed/openpose_ros/skeleton_3d/detected_poses', PersonDetectionArray)
        camera = publisher('compressed/camera/image_raw/compressed', CompressedImage)
        message = CompressedImage(format='png', data=cv2.imencode('.png', picture(0))[1].tobytes())
        message.header.stamp, message.header.frame_id = rospy.Time(80, 5), 'compressed camera'
        array = self.result_of(message, camera, arrays)
        self.assert_people(array, 0)
        self.assertEqual(array.header.frame_id, 'compressed camera')


if __name__ == '__main__':
    rospy.init_node('stream_test')
    rostest.rosrun('openpose_ros_pkg', 'stream', StreamTest, sys.argv)
