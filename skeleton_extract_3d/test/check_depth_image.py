#!/usr/bin/python3
"""Depth images with camera info give the people and the cloud that clouds give."""
import struct
import sys
import unittest

import cv2
import numpy as np
import rospy
import rostest
from harness import FRAME_ID, HEIGHT, OUTPUT, WIDTH, Camera, FakeDetector, Output, image, now, person, position
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.ros.convert import image_to_bgr
from session import Diagnostics, Recorder, await_true
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import XYZRGB, cloud_from_depth
from skeleton_extract_3d.ros.convert import camera_to_message, cloud_to_message, depth_to_message

JOINTS = {'nose': (20, 30), 'neck': (0, 0), 'right_wrist': (63, 47), 'left_wrist': (40.3, 11.8), 'chest': (32, 5)}
# A wide, distorted lens.
LENS = CameraModel(WIDTH, HEIGHT, np.array([[50.0, 0, 31.0], [0, 52.0, 24.5], [0, 0, 1]]), 'plumb_bob',
                   np.array([-0.1, 0.02, 0.001, -0.002, 0.0]))


def depth_of(number: int) -> np.ndarray:
    """Return a slanted surface with a hole, (H, W) uint16 [mm]."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    depth = (1500 + 10 * number + 3 * u + 7 * v).astype(np.uint16)
    depth[10:12, 39:42] = 0
    return depth


def compressed(message: Image) -> CompressedImage:
    """Return the picture as PNG, so that the frame's number stays exact."""
    return CompressedImage(header=message.header, format='png',
                           data=cv2.imencode('.png', image_to_bgr(message))[1].tobytes())


def packed(depth: np.ndarray, header: Header) -> CompressedImage:
    """Return the message of compressed_depth_image_transport: its header of 12 bytes, and a PNG of millimetres."""
    return CompressedImage(header, '16UC1; compressedDepth png',
                           struct.pack('<iff', 0, 0, 0) + cv2.imencode('.png', depth)[1].tobytes())


class DepthImageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_depth_image')
        cls.detector = FakeDetector('detect_poses_3d')
        cls.detector.answer = lambda number: [person(number, JOINTS)]
        cls.diagnostics = Diagnostics()
        cls.outputs = cls.by_cloud, cls.by_depth, cls.by_packed = (
            Output('by_cloud'), Output('by_depth'), Output('by_packed'))
        cls.cloud_camera = Camera('image', 'points', listeners=(2, 1))
        cls.depth_camera = Camera('image/compressed', 'depth', CompressedImage, Image)
        cls.packed_depth = Camera('image', 'depth/compressedDepth', points_type=CompressedImage).points
        cls.clouds = [Recorder(f'{name}/{OUTPUT}/input_pointcloud', PointCloud2) for name in ('by_cloud', 'by_packed')]
        cls.info = rospy.Publisher('camera_info', CameraInfo, queue_size=1, latch=True)

    def send(self, number: int) -> rospy.Time:
        stamp = now()
        header = Header(stamp=stamp, frame_id=FRAME_ID)
        picture, depth = image(number, stamp), depth_of(number)
        points = cloud_from_depth(depth * 0.001, LENS, image_to_bgr(picture))
        self.cloud_camera.send(picture, cloud_to_message(points, header))
        self.depth_camera.send(compressed(picture), depth_to_message(depth, header))
        self.packed_depth.publish(packed(depth, header))
        return stamp

    def camera_info_comes(self) -> rospy.Time:
        """Publish it, send frames until one comes out of all extractors, and return its stamp."""
        self.info.publish(camera_to_message(LENS, Header(frame_id=FRAME_ID)))
        stamps = []

        def one_came():
            stamps.append(self.send(5))
            rospy.sleep(0.1)
            return next((stamp for stamp in stamps if all(output.has(stamp) for output in self.outputs)), None)

        return await_true(one_came, 'a frame after the camera info')

    # the first by its name: no camera info was published before
    def test_a_depth_image_gives_what_the_cloud_gives(self):
        stamp = self.send(1)
        self.diagnostics.await_event('by_depth/extractor', 'bad input', 1, ['no camera info', '/camera_info'])
        self.by_cloud.frame(stamp)
        self.diagnostics.await_text('by_depth/extractor', 'no message on /camera_info: published by ',
                                    'which sends nothing')
        good = self.camera_info_comes()
        of_cloud, of_depth, of_packed = (output.frame(good) for output in self.outputs)
        for array in (of_depth, of_packed):
            self.assertEqual(array.header.frame_id, of_cloud.header.frame_id)
            self.assertEqual([found.person_ID for found in (*of_cloud.persons, *array.persons)], [5, 5])
            for joint in ('nose', 'neck', 'right_wrist', 'left_wrist'):
                one, other = (getattr(each.persons[0], joint) for each in (of_cloud, array))
                self.assertEqual((one.status, one.confidence), (other.status, other.confidence), joint)
                # the cloud holds float32 [m]
                np.testing.assert_allclose(position(one), position(other), atol=1e-5, err_msg=joint)
        # seen through the lens, a corner's four pixels have their mean near (62.5, 46.5); without distortion it would
        # be two pixels away
        wrist, still = position(of_depth.persons[0].right_wrist), np.zeros(3)
        seen = cv2.projectPoints(wrist.reshape(1, 1, 3), still, still, LENS.matrix, LENS.distortion)[0].ravel()
        np.testing.assert_allclose(seen, (62.5, 46.5), atol=0.3)
        self.assertFalse(self.by_depth.has(stamp))

    def test_the_cloud_of_depth_and_colours_is_that_of_the_camera(self):
        """The cloud that came is passed on; of a depth image the same is made."""
        stamp = self.camera_info_comes()
        passed_on, made = (recorder.wait(1, stamp)[0] for recorder in self.clouds)
        self.assertEqual((made.width, made.height, made.fields, made.header.frame_id),
                         (passed_on.width, passed_on.height, passed_on.fields, FRAME_ID))
        for axis in 'xyz':
            one, other = (np.frombuffer(each.data, XYZRGB)[axis] for each in (passed_on, made))
            np.testing.assert_allclose(other, one, rtol=1e-6, atol=1e-6, err_msg=axis)
        one, other = (np.frombuffer(each.data, XYZRGB)['rgb'] for each in (passed_on, made))
        np.testing.assert_array_equal(one, other)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_depth_image', DepthImageTest, sys.argv)
