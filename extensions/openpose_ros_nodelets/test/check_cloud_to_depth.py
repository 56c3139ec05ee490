#!/usr/bin/python3
"""Clouds become depth images and camera infos; bad clouds are counted; nothing comes in without subscribers."""
import subprocess
import sys

import numpy as np
import rospy
import rostest
from harness import FRAME_ID, NodeletTest, cloud
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, RegionOfInterest
from std_msgs.msg import Header
from std_srvs.srv import SetBool

from session import Recorder, await_true

WIDTH, HEIGHT = 64, 48
FX, FY, CX, CY = 50.0, 52.0, 31.0, 24.5
K = [FX, 0, CX, 0, FY, CY, 0, 0, 1]
# Depths that are no depths, by their pixel (u, v) [m].
MISSING = {(0, 0): np.nan, (1, 0): np.inf, (2, 0): -np.inf, (3, 0): 0.0, (4, 0): -1.0, (5, 0): 0.0004}
NEAREST, FARTHEST, TOO_FAR = (6, 0), (7, 0), (8, 0)


def surface() -> np.ndarray:
    """Return a slanted surface as a pinhole camera sees it, with some odd points: (H, W, 3) float32 [m]."""
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(np.float64)
    z = 1.50003 + 0.0031 * u + 0.0073 * v  # no half millimetres, which float32 may round either way
    for (column, row), depth in {**MISSING, NEAREST: 0.001, FARTHEST: 65.535, TOO_FAR: 65.6}.items():
        z[row, column] = depth
    with np.errstate(invalid='ignore'):
        return np.stack([(u - CX) / FX * z, (v - CY) / FY * z, z], axis=-1).astype(np.float32)


def millimetres(xyz: np.ndarray) -> np.ndarray:
    """Return the depth image of the surface, (H, W) uint16 [mm]."""
    z = xyz[..., 2].astype(np.float64)
    known = np.isfinite(z) & (z > 0) & (z < 65.5355)
    return np.where(known, np.round(1000 * np.where(known, z, 0)), 0).astype(np.uint16)


def bad_clouds(stamp: rospy.Time):
    """Yield clouds that can not be used, and words of the warning; test_organized_cloud.cpp has more of them."""
    message = cloud(surface(), stamp)
    message.data = message.data[:-1]
    yield message, ['truncated', '98303', '98304']
    turned = surface()[..., [2, 0, 1]]  # as in a frame with x forward
    yield cloud(turned, stamp), ['pinhole camera']


class CloudToDepthTest(NodeletTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.infos = cls.publishers('camera_info', CameraInfo, latch=True)

    def listen(self, ns):
        """Listen to both outputs until the end of the test; before, as after it, nothing comes in."""
        await_true(lambda: self.diagnostics.value(f'{ns}/cloud_to_depth', 'enabled') == 'true', f'{ns} is there')
        await_true(lambda: self.clouds[ns].get_num_connections() == 0, f'{ns} has unsubscribed')
        outputs = [Recorder(f'/{ns}/depth_registered/{topic}', kind)
                   for topic, kind in (('image_rect', Image), ('camera_info', CameraInfo))]
        for output in outputs:
            self.addCleanup(output.close)
        await_true(lambda: self.clouds[ns].get_num_connections() == 1, f'{ns} subscribes')
        return outputs

    def check_depth(self, image, encoding, expected):
        self.assertEqual((image.encoding, image.width, image.height, image.header.frame_id, image.is_bigendian),
                         (encoding, WIDTH, HEIGHT, FRAME_ID, 0))
        self.assertEqual(image.step, WIDTH * expected.itemsize)
        np.testing.assert_array_equal(np.frombuffer(image.data, expected.dtype).reshape(HEIGHT, WIDTH), expected)

    def test_2_depth_and_fitted_camera_in_a_manager(self):
        depths, infos = self.listen('managed')
        xyz = surface()
        for slash, layout in (('', {}), ('/', {'offsets': (4, 8, 12), 'point_step': 16}), ('', {'padding': 40}),
                              ('/', {'offsets': (3, 11, 17), 'point_step': 21})):
            message = cloud(xyz, rospy.Time(), **layout)
            message.header.frame_id = slash + message.header.frame_id
            stamp = self.send('managed', message)
            expected = millimetres(xyz)
            self.assertEqual([int(expected[v, u]) for u, v in (NEAREST, FARTHEST, TOO_FAR)], [1, 65535, 0])
            self.check_depth(depths.wait(1, stamp)[0], '16UC1', expected)
            info = infos.wait(1, stamp)[0]
            self.assertEqual((info.width, info.height, info.header.frame_id, info.distortion_model),
                             (WIDTH, HEIGHT, FRAME_ID, 'plumb_bob'))
            # coordinates are float32: 1e-7 of 64 px
            np.testing.assert_allclose(info.K, K, rtol=1e-5, atol=1e-4)
            np.testing.assert_allclose(np.reshape(info.P, (3, 4))[:, :3].ravel(), info.K)
            self.assertEqual((list(info.D), list(info.R)), ([0] * 5, [1, 0, 0, 0, 1, 0, 0, 0, 1]))

    def test_3_metres_and_given_camera_alone(self):
        depths, infos = self.listen('alone')
        xyz = surface()
        self.diagnostics.await_text('alone/cloud_to_depth', *(
            f'no message on /alone/{topic}: published by 1 nodes, which send nothing; '
            f'other topics of type {kind._type}: /'
            for topic, kind in (('points', PointCloud2), ('camera_info', CameraInfo))))
        self.assertEqual(self.diagnostics.reports('alone/cloud_to_depth')[-1].level, 'WARN')
        self.send('alone', cloud(xyz, rospy.Time()))
        await_true(lambda: '/alone/points' not in self.diagnostics.texts('alone/cloud_to_depth')[-1], 'clouds came')
        self.diagnostics.await_event('alone/cloud_to_depth', 'bad clouds', 1, ['no camera info', '/alone/camera_info'])
        # of a part of the sensor, with binning
        given = CameraInfo(header=Header(stamp=rospy.Time(5), frame_id=f'/{FRAME_ID}'), width=3 * WIDTH,
                           height=HEIGHT + 7, K=K, distortion_model='plumb_bob', D=[0.0] * 5,
                           P=[49.0, 0, CX, 0, 0, FY, CY, 0, 0, 0, 1, 0],
                           binning_x=2, roi=RegionOfInterest(x_offset=5, y_offset=7, width=2 * WIDTH, height=HEIGHT))
        self.infos['alone'].publish(given)
        stamp = await_true(lambda: (sent := self.send('alone', cloud(xyz, rospy.Time()))) and infos.messages and sent,
                           'a camera info')
        with np.errstate(invalid='ignore'):
            expected = np.where(np.isfinite(xyz[..., 2]) & (xyz[..., 2] > 0), xyz[..., 2], np.float32('nan'))
        self.check_depth(depths.wait(1, stamp)[0], '32FC1', expected)
        given.header = Header(infos.wait(1, stamp)[0].header.seq, stamp, FRAME_ID)
        self.assertEqual(infos.wait(1, stamp)[0], given)

    def test_4_bad_clouds_are_counted(self):
        depths, _ = self.listen('managed')
        for number, (message, words) in enumerate(bad_clouds(rospy.Time()), 1):
            self.send('managed', message)
            self.diagnostics.await_event('managed/cloud_to_depth', 'bad clouds', number, words)
        self.assertEqual(depths.messages, [])
        depths.wait(1, self.send('managed', cloud(surface(), rospy.Time())))

    def test_5_a_camera_of_another_view_is_refused(self):
        self.listen('managed')
        self.infos['managed'].publish(CameraInfo(header=Header(frame_id=FRAME_ID), width=4 * WIDTH, height=HEIGHT, K=K,
                                                 binning_x=2))
        await_true(lambda: self.send('managed', cloud(surface(), rospy.Time()))
                   and 'camera info is of' in ' '.join(self.diagnostics.texts('managed/cloud_to_depth')), 'a warning')
        self.diagnostics.await_event('managed/cloud_to_depth', 'bad clouds', 1, ['64 x 48', '128 x 48', FRAME_ID])

    def test_6_enable(self):
        self.listen('alone')
        enable = rospy.ServiceProxy('/alone/cloud_to_depth/enable', SetBool)
        self.assertTrue(enable(False).success)
        await_true(lambda: self.clouds['alone'].get_num_connections() == 0, 'it unsubscribes')
        self.assertTrue(enable(True).success)
        await_true(lambda: self.clouds['alone'].get_num_connections() == 1, 'it subscribes')

    def test_7_wrong_parameters_end_the_program_and_spare_the_manager(self):
        alone = ['rosrun', 'openpose_ros_nodelets', 'cloud_to_depth_node']
        managed = ['rosrun', 'nodelet', 'nodelet', 'load', 'openpose_ros_nodelets/cloud_to_depth', '/manager']
        for setting, words in (('_encoding:=8UC1', ["'encoding' = 8UC1", '16UC1, 32FC1']),
                               ('_encodings:=32FC1', ["parameter 'encodings' = 32FC1", 'rosparam delete /refused'])):
            for command in (alone, managed):
                done = subprocess.run([*command, '__name:=refused', setting], stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, timeout=60, check=False)
                rospy.delete_param('/refused')
                self.assertGreater(done.returncode, 0)  # negative: a signal
                for word in words if command is alone else ():
                    self.assertIn(word, done.stdout.decode())
        self.assertTrue(rospy.ServiceProxy('/managed/cloud_to_depth/enable', SetBool)(True).success)


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_nodelets', 'check_cloud_to_depth', CloudToDepthTest, sys.argv)
