#!/usr/bin/python3
"""Clouds become depth images and camera infos; bad clouds are counted; nothing comes in without subscribers."""
import sys

import numpy as np
import rostest
from harness import FRAME_ID, CloudTest, cloud
from sensor_msgs.msg import CameraInfo, Image, RegionOfInterest
from std_msgs.msg import Header

from session import Recorder, await_true

WIDTH, HEIGHT = 64, 48
FX, FY, CX, CY = 50.0, 52.0, 31.0, 24.5
K = [FX, 0, CX, 0, FY, CY, 0, 0, 1]


def surface() -> np.ndarray:
    """Return a slanted surface as a pinhole camera sees it, with a hole: (H, W, 3) float32 [m]."""
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(np.float64)
    z = 1.50003 + 0.0031 * u + 0.0073 * v  # no half millimetres, which float32 may round either way
    z[0, 0] = np.nan
    return np.stack([(u - CX) / FX * z, (v - CY) / FY * z, z], axis=-1).astype(np.float32)


class CloudToDepthTest(CloudTest):
    NAMESPACES = ('auto', 'given')

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

    def test_1_millimetres_and_the_camera_that_fits(self):
        depths, infos = self.listen('auto')
        stamp = self.send('auto', cloud(surface()))
        image, info = depths.wait(1, stamp)[0], infos.wait(1, stamp)[0]
        self.assertEqual((image.encoding, image.width, image.height, image.step, image.header.frame_id),
                         ('16UC1', WIDTH, HEIGHT, 2 * WIDTH, FRAME_ID))
        expected = np.nan_to_num(np.round(1000 * surface()[..., 2].astype(np.float64)))
        np.testing.assert_array_equal(np.frombuffer(image.data, '<u2').reshape(HEIGHT, WIDTH), expected)
        self.assertEqual((info.width, info.height, info.header.frame_id), (WIDTH, HEIGHT, FRAME_ID))
        np.testing.assert_allclose(info.K, K, rtol=1e-5, atol=1e-4)  # coordinates are float32: 1e-7 of 64 px
        # what can not be used
        message = cloud(surface())
        message.data = message.data[:-1]
        self.send('auto', message)
        self.diagnostics.await_event('auto/cloud_to_depth', 'bad clouds', 1, ['98303'])
        self.send('auto', cloud(surface()[..., [2, 0, 1]]))  # as in a frame with x forward
        self.diagnostics.await_event('auto/cloud_to_depth', 'bad clouds', 2, ['pinhole camera'])
        self.infos['auto'].publish(CameraInfo(header=Header(frame_id=FRAME_ID), width=4 * WIDTH, height=HEIGHT, K=K,
                                              binning_x=2))
        await_true(lambda: self.send('auto', cloud(surface()))
                   and '64 x 48' in ' '.join(self.diagnostics.texts('auto/cloud_to_depth')), 'a warning')

    def test_2_metres_and_a_given_camera(self):
        depths, infos = self.listen('given')
        # of a part of the sensor, with binning
        given = CameraInfo(header=Header(frame_id=f'/{FRAME_ID}'), width=3 * WIDTH, height=HEIGHT + 7, K=K, D=[0.0] * 5,
                           distortion_model='plumb_bob', P=[49.0, 0, CX, 0, 0, FY, CY, 0, 0, 0, 1, 0], binning_x=2,
                           roi=RegionOfInterest(x_offset=5, y_offset=7, width=2 * WIDTH, height=HEIGHT))
        self.infos['given'].publish(given)
        info = await_true(lambda: self.send('given', cloud(surface())) and next(
            (one for one in infos.messages if one.binning_x), None), 'the camera info')
        image = depths.wait(1, info.header.stamp)[0]
        self.assertEqual(image.encoding, '32FC1')
        np.testing.assert_array_equal(np.frombuffer(image.data, '<f4').reshape(HEIGHT, WIDTH), surface()[..., 2])
        given.header = info.header
        self.assertEqual(info, given)


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_nodelets', 'check_cloud_to_depth', CloudToDepthTest, sys.argv)
