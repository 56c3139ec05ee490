#!/usr/bin/python3
"""Compressed depth images give the true positions, and the cloud of what was seen to whoever listens."""
import struct
import sys
import unittest
from typing import Tuple

import cv2
import numpy as np
import rospy
import rostest
from harness import FRAME_ID, HEIGHT, OUTPUT, WIDTH, Camera, FakeDetector, Output, image, now, position
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2, PointField
from std_msgs.msg import Header

from openpose_ros_pkg.ros.convert import bgr_to_image
from session import await_true, is_heard
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.ros.convert import camera_to_message

FX, FY, CX, CY = 50.0, 52.0, 31.0, 24.5
# The depth image has half the resolution of the images and of the camera info: its camera by REP 104's scaling.
SIZE = (HEIGHT // 2, WIDTH // 2)
V, U = np.mgrid[:SIZE[0], :SIZE[1]]
RAYS = np.stack([(U - ((CX + 0.5) / 2 - 0.5)) / (FX / 2), (V - ((CY + 0.5) / 2 - 0.5)) / (FY / 2),
                 np.ones(SIZE)], axis=-1)
HOLE = (slice(2, 4), slice(3, 6))
NOSE, NOSE_PIXEL = (20.5, 30.5), (10, 15)  # [px of the image], column and row of the depth image
# compressed_depth_image_transport, codec.cpp: stored = A / z + B with A = quantization * (quantization + 1) and
# B = 1 - A / depth_max; its defaults are 100 and 10 m.
A = 100 * 101.0
B = 1 - A / 10.0


def metres() -> np.ndarray:
    """Return a slanted surface of 1.5 to 2.1 m, with a hole of NaN, (H, W) float [m]."""
    depth = 1.5 + 0.01 * U + 0.013 * V
    depth[HOLE] = np.nan
    return depth


def packed(pixels: np.ndarray, encoding: str, stamp: rospy.Time, a: float = 0.0, b: float = 0.0) -> CompressedImage:
    """Return the message of uint16 pixels as the transport writes it: its header of 12 bytes, and a PNG."""
    return CompressedImage(Header(stamp=stamp, frame_id=FRAME_ID), f'{encoding}; compressedDepth png',
                           struct.pack('<iff', 0, a, b) + cv2.imencode('.png', pixels)[1].tobytes())


def in_millimetres(stamp: rospy.Time) -> Tuple[CompressedImage, np.ndarray]:
    """Return the message of the surface in whole millimetres, and the depth that it holds [m]."""
    pixels = np.nan_to_num(np.round(metres() * 1000)).astype(np.uint16)
    return packed(pixels, '16UC1', stamp), np.where(pixels == 0, np.nan, pixels * 0.001)


def in_metres(stamp: rospy.Time) -> Tuple[CompressedImage, np.ndarray]:
    """Return the message of the surface as 32FC1, and the depth before it was quantised [m]."""
    pixels = np.nan_to_num(A / metres() + B).astype(np.uint16)
    return packed(pixels, '32FC1', stamp, A, B), metres()


def read(cloud: PointCloud2) -> np.ndarray:
    """Return x, y, z and the bits of rgb of an organized cloud, by its fields."""
    offsets = {field.name: field.offset for field in cloud.fields}
    assert all(field.datatype == PointField.FLOAT32 and field.count == 1 for field in cloud.fields)
    dtype = np.dtype({'names': list(offsets), 'formats': ['<f4', '<f4', '<f4', '<u4'],
                      'offsets': list(offsets.values()), 'itemsize': cloud.point_step})
    return np.frombuffer(cloud.data, dtype).reshape(cloud.height, cloud.width)


class CompressedDepthTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_compressed_depth')
        cls.detector = FakeDetector('detect_poses_3d', {'nose': NOSE})
        cls.output = Output()
        cls.camera = Camera('image', 'depth/compressedDepth', Image, CompressedImage)
        info = camera_to_message(CameraModel(WIDTH, HEIGHT, np.array([FX, 0, CX, 0, FY, CY, 0, 0, 1])), Header())
        cls.info = rospy.Publisher('camera_info', CameraInfo, queue_size=1, latch=True)
        cls.info.publish(info)
        # the camera info may come after the first frames, which are counted then
        await_true(lambda: cls.output.arrays or not cls.send(in_millimetres), 'a first result')

    @classmethod
    def send(cls, make) -> rospy.Time:
        stamp = now()
        cls.camera.send(image(1, stamp), make(stamp)[0])
        return stamp

    def nose(self, stamp: rospy.Time) -> np.ndarray:
        return position(self.output.frame(stamp).persons[0].nose)

    def test_positions_are_exact_in_millimetres_and_within_a_step_in_metres(self):
        column, row = NOSE_PIXEL
        around = slice(row - 1, row + 2), slice(column - 1, column + 2)
        for make, tolerance in ((in_millimetres, 1e-6), (in_metres, 2.2 ** 2 / A)):
            with self.subTest(make.__name__):
                stamp = now()
                message, depth = make(stamp)
                self.camera.send(image(1, stamp), message)
                truth = (RAYS * depth[..., None])[around].mean(axis=(0, 1))
                # a step of the stored 1 / z is z^2 / A in z, at z up to 2.2 m
                np.testing.assert_allclose(self.nose(stamp), truth, atol=tolerance)

    def test_the_cloud_of_depth_and_colours(self):
        clouds = []
        subscriber = rospy.Subscriber(f'{OUTPUT}/input_pointcloud', PointCloud2, clouds.append)
        await_true(lambda: is_heard(f'{OUTPUT}/input_pointcloud'), 'the extractor publishes clouds')
        stamp = now()
        message, depth = in_millimetres(stamp)
        # a colour for each pixel of the depth image: red, green, blue
        colours = np.stack([10 + U, 100 + V, 200 + U - V], axis=-1).astype(np.uint8)
        picture = np.repeat(np.repeat(colours[..., ::-1], 2, axis=0), 2, axis=1)
        picture[0, 0] = 1, 0, 0  # the frame's number
        self.camera.send(bgr_to_image(picture, Header(stamp=stamp)), message)
        cloud = await_true(lambda: next((each for each in list(clouds) if each.header.stamp == stamp), None),
                           'its cloud')
        subscriber.unregister()
        self.assertEqual((cloud.height, cloud.width, cloud.header.frame_id), (*SIZE, FRAME_ID))
        self.assertEqual([field.name for field in cloud.fields], ['x', 'y', 'z', 'rgb'])
        values = read(cloud)
        for i, axis in enumerate('xyz'):
            # float32
            np.testing.assert_allclose(values[axis], RAYS[..., i] * depth, rtol=3e-7, atol=1e-7, err_msg=axis)
            self.assertTrue(np.isnan(values[axis][HOLE]).all())
        red, green, blue = (values['rgb'] >> 16) & 255, (values['rgb'] >> 8) & 255, values['rgb'] & 255
        for found, i in ((red, 0), (green, 1), (blue, 2)):
            np.testing.assert_array_equal(found.ravel()[1:], colours[..., i].ravel()[1:])


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_compressed_depth', CompressedDepthTest, sys.argv)
