#!/usr/bin/python3
"""The floor of a room is published as a plane and as a frame; bad clouds are counted."""
import sys

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Quaternion, TransformStamped
from harness import FRAME_ID, CloudTest, cloud
from pcl_msgs.msg import ModelCoefficients
from scipy.spatial.transform import Rotation

from session import Recorder, await_true

WIDTH, HEIGHT, FOCAL = 160, 120, 114.0
# Height of the camera [m], and how far it looks down [rad].
ABOVE, DOWN = 1.2, 0.3
NORMAL = np.array([0, -np.cos(DOWN), -np.sin(DOWN)])
FORWARD = np.array([0, -np.sin(DOWN), np.cos(DOWN)])
# What the node has to reach: 1 degree, 3 cm; tests/unit/nodelets has more scenes.
ANGLE, LENGTH = np.radians(1), 0.03


def room():
    """A floor and a wall 5 m ahead as the camera sees them, with noise of 5 mm: (H, W, 3) float32 [m]."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    rays = np.stack([(u - 79.5) / FOCAL, (v - 59.5) / FOCAL, np.ones(u.shape)], axis=-1)
    fall, ahead = -rays @ NORMAL, rays @ FORWARD
    with np.errstate(divide='ignore'):
        depth = np.minimum(5 / ahead, np.where(fall > 0, ABOVE / fall, np.inf))
    noise = np.random.RandomState(1).normal(0, 0.005, depth.shape)
    return (rays * (depth + noise)[..., None]).astype(np.float32)


def position(buffer, stamp):
    """Return where the frame of the floor begins."""
    moved = buffer.lookup_transform(FRAME_ID, 'world', stamp).transform.translation
    return np.array([moved.x, moved.y, moved.z])


class FloorTest(CloudTest):
    NAMESPACES = ('with_tf', 'lazy', 'taken')

    def listen(self, ns):
        planes = Recorder(f'/{ns}/floor/plane', ModelCoefficients)
        self.addCleanup(planes.close)
        await_true(lambda: self.clouds[ns].get_num_connections() == 1, f'{ns} subscribes')
        return planes

    def count(self, ns, event):
        return self.diagnostics.count(f'{ns}/floor', event)

    def send_and_await(self, ns, xyz, event):
        """Publish a cloud and wait until it is counted."""
        before = self.count(ns, event)
        stamp = self.send(ns, cloud(xyz), 0.25)
        await_true(lambda: self.count(ns, event) == before + 1, f"{ns} counts '{event}'")
        return stamp

    def check_plane(self, message):
        self.assertEqual(message.header.frame_id, FRAME_ID)
        a, b, c, d = message.values
        self.assertAlmostEqual(np.linalg.norm([a, b, c]), 1, places=5)
        self.assertLess(np.arccos(np.dot([a, b, c], NORMAL)), ANGLE)
        self.assertAlmostEqual(d, ABOVE, delta=LENGTH)

    def test_1_plane_and_frame(self):
        planes, buffer = self.listen('with_tf'), tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        self.send_and_await('with_tf', room(), 'no floor')  # one alone is not believed
        stamp = self.send_and_await('with_tf', room(), 'floor')
        self.check_plane(planes.wait(1, stamp)[0])
        # the frame comes once those of others are heard; clouds of the same stamp are not searched
        await_true(lambda: buffer.can_transform(FRAME_ID, 'world', rospy.Time())
                   or not self.send('with_tf', cloud(room()[:2]), 0), 'the frame of the floor')
        between = self.send('with_tf', cloud(room()), 0.05)  # between two searches, tf goes on with each cloud
        await_true(lambda: buffer.can_transform(FRAME_ID, 'world', between), 'the frame of the floor')
        transform = buffer.lookup_transform(FRAME_ID, 'world', between).transform
        origin = position(buffer, between)
        np.testing.assert_allclose(origin, -ABOVE * NORMAL, atol=LENGTH)
        expected = np.stack([FORWARD, np.cross(NORMAL, FORWARD), NORMAL], axis=1)
        turned = Rotation.from_quat([getattr(transform.rotation, axis) for axis in 'xyzw'])
        np.testing.assert_allclose(turned.apply(np.eye(3)).T, expected, atol=ANGLE)
        self.assertEqual([message.header.stamp for message in planes.messages], [stamp])
        # where people hide the floor, its frame stays
        hidden = self.send_and_await('with_tf', np.full((HEIGHT, WIDTH, 3), np.nan, np.float32), 'no floor')
        await_true(lambda: buffer.can_transform(FRAME_ID, 'world', hidden), 'the frame of the hidden floor')
        np.testing.assert_allclose(position(buffer, hidden), origin, atol=1e-6)
        message = cloud(room())
        message.fields = message.fields[:2]
        self.send('with_tf', message, after=1)
        self.diagnostics.await_event('with_tf/floor', 'bad clouds', 1, ['no field z'])

    def test_2_unorganized_cloud_and_gravity_from_tf(self):
        self.assertEqual(self.clouds['lazy'].get_num_connections(), 0)  # no subscriber
        planes, flat = self.listen('lazy'), room().reshape(1, -1, 3)
        await_true(lambda: self.send('lazy', cloud(flat), 0.25) and self.count('lazy', 'no transform'), 'a warning')
        transform = TransformStamped(child_frame_id=FRAME_ID)
        transform.header.frame_id = 'base_link'
        turn = -(np.pi / 2 + DOWN) / 2
        transform.transform.rotation = Quaternion(np.sin(turn), 0, 0, np.cos(turn))
        broadcaster = tf2_ros.StaticTransformBroadcaster()
        broadcaster.sendTransform(transform)
        await_true(lambda: planes.messages or not self.send('lazy', cloud(flat), 0.25), 'a plane')
        self.check_plane(planes.messages[-1])
        # where the frame of the floor is to have the name of one that is there, it is not published
        await_true(lambda: self.count('taken', 'frame exists') or not self.send('taken', cloud(flat), 0.25),
                   'a warning')


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_nodelets', 'check_floor', FloorTest, sys.argv)
