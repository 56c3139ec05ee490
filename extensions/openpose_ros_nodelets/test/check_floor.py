#!/usr/bin/python3
"""The floor of a room is published as a plane and as a frame; a table that fills the view, and bad clouds, are not."""
import sys
import unittest

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Quaternion, TransformStamped
from harness import FRAME_ID, cloud
from pcl_msgs.msg import ModelCoefficients
from sensor_msgs.msg import PointCloud2

from session import Diagnostics, Recorder, await_true

WIDTH, HEIGHT, FOCAL = 160, 120, 114.0
# Height of the camera [m], and how far it looks down [rad].
ABOVE, DOWN = 1.2, 0.3
NORMAL = np.array([0, -np.cos(DOWN), -np.sin(DOWN)])
FORWARD = np.array([0, -np.sin(DOWN), np.cos(DOWN)])
# What the node has to reach: 1 degree, 3 cm.
ANGLE, LENGTH = np.radians(1), 0.03


def room(table=None, height=ABOVE):
    """A floor and a wall 5 m ahead as the camera sees them, with noise of 5 mm: (H, W, 3) float32 [m].

    Args:
        table: height of a table that covers all up to 3.5 m ahead [m]; None: there is none.
        height: of the camera [m].
    """
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    rays = np.stack([(u - 79.5) / FOCAL, (v - 59.5) / FOCAL, np.ones(u.shape)], axis=-1)
    fall, ahead = -rays @ NORMAL, rays @ FORWARD
    with np.errstate(divide='ignore'):
        depth = np.minimum(5 / ahead, np.where(fall > 0, height / fall, np.inf))
        if table is not None:
            on_table = (height - table) / np.where(fall > 0, fall, np.nan)
            depth = np.where(on_table * ahead < 3.5, on_table, depth)
    noise = np.random.RandomState(1).normal(0, 0.005, depth.shape)
    return (rays * (depth + noise)[..., None]).astype(np.float32)


def axes(rotation: Quaternion):
    """The axes of a rotation as columns, (3, 3)."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class FloorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_floor')
        cls.diagnostics = Diagnostics()
        cls.clouds = {ns: rospy.Publisher(f'/{ns}/points', PointCloud2, queue_size=10) for ns in ('managed', 'alone')}
        cls.last = rospy.Time(1000)

    def listen(self, ns):
        planes = Recorder(f'/{ns}/floor/plane', ModelCoefficients)
        self.addCleanup(planes.close)
        await_true(lambda: self.clouds[ns].get_num_connections() == 1, f'{ns} subscribes')
        return planes

    def send(self, ns, xyz, after=0.25):
        """Publish a cloud, so many seconds after the last one by its stamp, and return that."""
        type(self).last += rospy.Duration.from_sec(after)
        self.clouds[ns].publish(cloud(xyz, self.last))
        return self.last

    def count(self, ns, event):
        return int(self.diagnostics.value(f'{ns}/floor', event) or 0)

    def send_and_await(self, ns, xyz, event):
        """Publish a cloud and wait until it is counted."""
        before = self.count(ns, event)
        stamp = self.send(ns, xyz)
        await_true(lambda: self.count(ns, event) == before + 1, f"{ns} counts '{event}'")
        return stamp

    def check_plane(self, message, height=ABOVE):
        self.assertEqual(message.header.frame_id, FRAME_ID)
        a, b, c, d = message.values
        self.assertAlmostEqual(np.linalg.norm([a, b, c]), 1, places=5)
        self.assertLess(np.arccos(np.dot([a, b, c], NORMAL)), ANGLE)
        self.assertAlmostEqual(d, height, delta=LENGTH)

    def test_1_plane_and_frame_in_a_manager(self):
        planes, buffer = self.listen('managed'), tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        self.send_and_await('managed', room(), 'no floor')  # one alone is not believed
        stamp = self.send_and_await('managed', room(), 'floor')
        self.check_plane(planes.wait(1, stamp)[0])
        # between two searches, tf goes on with each cloud
        between = self.send('managed', room(), after=0.05)
        await_true(lambda: buffer.can_transform(FRAME_ID, 'ground', between), 'the frame of the floor')
        transform = buffer.lookup_transform(FRAME_ID, 'ground', between).transform
        origin = np.array([transform.translation.x, transform.translation.y, transform.translation.z])
        np.testing.assert_allclose(origin, -ABOVE * NORMAL, atol=LENGTH)
        expected = np.stack([FORWARD, np.cross(NORMAL, FORWARD), NORMAL], axis=1)
        np.testing.assert_allclose(axes(transform.rotation), expected, atol=ANGLE)
        self.assertEqual([message.header.stamp for message in planes.messages], [stamp])

    def test_2_a_table_is_no_floor(self):
        planes = self.listen('managed')
        for _ in range(3):
            self.send_and_await('managed', room(table=0.7), 'no floor')
        self.assertEqual(planes.messages, [])

    def test_3_unorganized_cloud_and_gravity_from_tf_alone(self):
        broadcaster = tf2_ros.StaticTransformBroadcaster()
        self.assertEqual(self.clouds['alone'].get_num_connections(), 0)  # no subscriber
        planes = self.listen('alone')
        flat = room().reshape(1, -1, 3)
        await_true(lambda: self.send('alone', flat) and self.count('alone', 'no transform') > 0, 'a warning')
        transform = TransformStamped(child_frame_id=FRAME_ID)
        transform.header.frame_id = 'base_link'
        turn = -(np.pi / 2 + DOWN) / 2
        transform.transform.rotation = Quaternion(np.sin(turn), 0, 0, np.cos(turn))
        broadcaster.sendTransform(transform)
        await_true(lambda: planes.messages or not self.send('alone', flat), 'a plane')
        self.check_plane(planes.messages[-1])

    def test_4_bad_clouds_are_counted(self):
        self.listen('managed')
        message = cloud(room(), self.last)
        message.fields = message.fields[:2]
        type(self).last += rospy.Duration(1)
        message.header.stamp = self.last
        self.clouds['managed'].publish(message)
        self.diagnostics.await_event('managed/floor', 'bad clouds', 1, ["no field 'z'"])


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_nodelets', 'check_floor', FloorTest, sys.argv)
