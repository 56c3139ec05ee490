#!/usr/bin/python3
"""The extractor gives true positions, and outlives whatever it is sent."""
import sys
import unittest
from typing import List

import numpy as np
import rospy
import rostest
from harness import (
    FRAME_ID,
    HEIGHT,
    OUTPUT,
    WIDTH,
    Camera,
    FakeDetector,
    Output,
    cloud,
    image,
    now,
    person,
    points,
    position,
)
from openpose_ros_msgs.msg import BodypartDetection_3d
from sensor_msgs.msg import CameraInfo, Image, PointCloud2

from session import Diagnostics, Recorder, await_true

NODE = 'extractor'
# Keypoint [px] and the pixels of the cloud around it: rows, columns.
KEYPOINTS = {'nose': ((20.0, 30.0), slice(29, 32), slice(19, 22)),
             'neck': ((10.4, 20.6), slice(20, 23), slice(9, 12)),
             'right_wrist': ((0.0, 0.0), slice(0, 2), slice(0, 2)),
             'left_wrist': ((63.0, 47.0), slice(46, 48), slice(62, 64)),
             'right_ankle': ((32.0, 0.0), slice(0, 2), slice(31, 34)),
             'left_ankle': ((-0.4, 47.4), slice(46, 48), slice(0, 2))}
HOLE, OUTSIDE = (50.0, 10.0), (64.0, 20.0)


def mean_of_valid(xyz: np.ndarray) -> np.ndarray:
    """Return the mean of those points that are finite and not the origin, one by one."""
    valid = [point for point in xyz.reshape(-1, 3) if np.isfinite(point).all() and point.any()]
    return sum(valid) / len(valid)


class ExtractorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_extractor')
        cls.detector = FakeDetector('detect_poses_3d')
        cls.output, cls.diagnostics, cls.camera = Output(), Diagnostics(), Camera()

    def setUp(self):
        self.detector.answer = lambda number: [person(number, {'nose': (20, 30)})]

    def test_joints_are_means_of_the_valid_points_around_their_pixels(self):
        xyz = points(3)
        xyz[30, 20], xyz[29, 19], xyz[31, 21, 2] = np.nan, 0, np.inf
        xyz[1, 1], xyz[0, 0, 0] = 0, -np.inf
        xyz[9:12, 49:52] = np.nan
        joints = {name: pixel for name, (pixel, _, _) in KEYPOINTS.items()}
        joints.update(right_knee=HOLE, left_knee=OUTSIDE)
        self.detector.answer = lambda number: [person(40, joints, 0.75), person(41, {'neck': (10.4, 20.6)}, 0.5)]
        stamp = now()
        self.camera.send(image(3, stamp), cloud(xyz, stamp, 'frame_of_the_cloud'))
        array = self.output.frame(stamp)
        first, second = array.persons
        for name, (_, rows, columns) in KEYPOINTS.items():
            part = getattr(first, name)
            np.testing.assert_allclose(position(part), mean_of_valid(xyz[rows, columns]), atol=1e-5, err_msg=name)
            self.assertEqual((part.status, part.confidence), (BodypartDetection_3d.MEASURED, 0.75), name)
        for name, confidence in (('right_knee', 0.75), ('left_knee', 0.75), ('right_elbow', 0.0), ('chest', 0.0),
                                 ('mid_hip', 0.0)):
            part = getattr(first, name)
            self.assertTrue(np.isnan([part.x, part.y, part.z, part.sigma]).all(), name)
            self.assertEqual((part.status, part.confidence), (BodypartDetection_3d.MISSING, confidence), name)
        np.testing.assert_allclose(position(second.neck), position(first.neck))
        self.assertEqual(array.header.frame_id, 'frame_of_the_cloud')
        for found, number in ((first, 40), (second, 41)):
            self.assertEqual((found.header.stamp, found.header.frame_id), (stamp, 'frame_of_the_cloud'))
            self.assertEqual((found.person_ID, found.num_people_detected), (number, 2))

        def one_by_one():
            return [found.person_ID for found in list(self.output.persons) if found.header.stamp == stamp]

        await_true(lambda: one_by_one() == [40, 41], 'a message for each person')

    def listen(self, topic: str, kind: type) -> Recorder:
        """Return the recorder of an output while this test runs."""
        recorder = Recorder(f'{OUTPUT}/{topic}', kind)
        self.addCleanup(recorder.close)
        return recorder

    def await_output(self, *recorders: Recorder) -> List:
        """Send frames until one came to each: a node may learn of its subscriber only later; return the newest ones."""
        def came():
            self.output.frame(self.camera.send_frame(11))
            return all(recorder.messages for recorder in recorders)

        await_true(came, lambda: f'{[recorder.topic for recorder in recorders]}')
        newest = [recorder.messages[-1] for recorder in recorders]
        for message in newest:
            self.assertTrue(self.output.has(message.header.stamp))
        return newest

    def test_the_camera_info_of_the_input_stands_beside_the_image(self):
        """Nothing before it is there, since these points are those of no camera."""
        infos = self.listen('camera_info', CameraInfo)
        for _ in range(2):  # whatever belongs to the first one has been published
            self.output.frame(self.camera.send_frame(12))
        self.assertEqual(infos.messages, [])
        source = rospy.Publisher(f'{NODE}/camera_info', CameraInfo, queue_size=1, latch=True)
        self.addCleanup(source.unregister)
        source.publish(CameraInfo(width=WIDTH, height=HEIGHT, K=[50, 0, 31, 0, 51, 23, 0, 0, 1]))
        info, = self.await_output(infos)
        self.assertEqual((info.K[0], info.K[4], info.header.frame_id), (50.0, 51.0, FRAME_ID))

    def test_synchronised_inputs_are_echoed(self):
        messages = self.await_output(self.listen('input_rgb', Image), self.listen('input_pointcloud', PointCloud2))
        for message, sent in zip(messages, (image(11, messages[0].header.stamp),
                                            cloud(points(11), messages[1].header.stamp))):
            self.assertEqual((message.data, message.header.frame_id), (sent.data, FRAME_ID))


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_extractor', ExtractorTest, sys.argv)
