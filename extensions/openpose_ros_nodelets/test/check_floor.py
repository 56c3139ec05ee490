#!/usr/bin/python3
"""The floor of a room is published as a plane and as a frame; bad clouds are counted."""
import subprocess
import sys

import numpy as np
import roslib.packages
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Quaternion, TransformStamped
from harness import FRAME_ID, NodeletTest, cloud
from pcl_msgs.msg import ModelCoefficients
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage

from session import Recorder, await_true

WIDTH, HEIGHT, FOCAL = 160, 120, 114.0
# Height of the camera [m], and how far it looks down [rad].
ABOVE, DOWN = 1.2, 0.3
NORMAL = np.array([0, -np.cos(DOWN), -np.sin(DOWN)])
FORWARD = np.array([0, -np.sin(DOWN), np.cos(DOWN)])
# What the node has to reach: 1 degree, 3 cm.
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


class FloorTest(NodeletTest):
    def listen(self, ns):
        planes = Recorder(f'/{ns}/floor/plane', ModelCoefficients)
        self.addCleanup(planes.close)
        await_true(lambda: self.clouds[ns].get_num_connections() == 1, f'{ns} subscribes')
        return planes

    def send_points(self, ns, xyz, after=0.25):
        return self.send(ns, cloud(xyz, rospy.Time()), after)

    def count(self, ns, event):
        return int(self.diagnostics.value(f'{ns}/floor', event) or 0)

    def send_and_await(self, ns, xyz, event):
        """Publish a cloud and wait until it is counted."""
        before = self.count(ns, event)
        stamp = self.send_points(ns, xyz)
        await_true(lambda: self.count(ns, event) == before + 1, f"{ns} counts '{event}'")
        return stamp

    def check_plane(self, message):
        self.assertEqual(message.header.frame_id, FRAME_ID)
        a, b, c, d = message.values
        self.assertAlmostEqual(np.linalg.norm([a, b, c]), 1, places=5)
        self.assertLess(np.arccos(np.dot([a, b, c], NORMAL)), ANGLE)
        self.assertAlmostEqual(d, ABOVE, delta=LENGTH)

    def test_1_plane_and_frame_in_a_manager(self):
        planes, buffer = self.listen('managed'), tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        self.send_and_await('managed', room(), 'no floor')  # one alone is not believed
        stamp = self.send_and_await('managed', room(), 'floor')
        self.check_plane(planes.wait(1, stamp)[0])
        # the frame comes once those of others are heard; clouds of the same stamp are not searched
        await_true(lambda: buffer.can_transform(FRAME_ID, 'world', rospy.Time())
                   or not self.send_points('managed', room()[:2], after=0), 'the frame of the floor')
        # between two searches, tf goes on with each cloud
        between = self.send_points('managed', room(), after=0.05)
        await_true(lambda: buffer.can_transform(FRAME_ID, 'world', between), 'the frame of the floor')
        transform = buffer.lookup_transform(FRAME_ID, 'world', between).transform
        origin = position(buffer, between)
        np.testing.assert_allclose(origin, -ABOVE * NORMAL, atol=LENGTH)
        expected = np.stack([FORWARD, np.cross(NORMAL, FORWARD), NORMAL], axis=1)
        turned = Rotation.from_quat([getattr(transform.rotation, axis) for axis in 'xyzw'])
        np.testing.assert_allclose(turned.apply(np.eye(3)).T, expected, atol=ANGLE)
        self.assertEqual([message.header.stamp for message in planes.messages], [stamp])
        # where people hide the floor, its frame stays
        hidden = self.send_and_await('managed', np.full((HEIGHT, WIDTH, 3), np.nan, np.float32), 'no floor')
        await_true(lambda: buffer.can_transform(FRAME_ID, 'world', hidden), 'the frame of the hidden floor')
        np.testing.assert_allclose(position(buffer, hidden), origin, atol=1e-6)

    def test_3_unorganized_cloud_and_gravity_from_tf_alone(self):
        broadcaster = tf2_ros.StaticTransformBroadcaster()
        self.assertEqual(self.clouds['alone'].get_num_connections(), 0)  # no subscriber
        planes = self.listen('alone')
        flat = room().reshape(1, -1, 3)
        await_true(lambda: self.send_points('alone', flat) and self.count('alone', 'no transform') > 0, 'a warning')
        transform = TransformStamped(child_frame_id=FRAME_ID)
        transform.header.frame_id = 'base_link'
        turn = -(np.pi / 2 + DOWN) / 2
        transform.transform.rotation = Quaternion(np.sin(turn), 0, 0, np.cos(turn))
        broadcaster.sendTransform(transform)
        await_true(lambda: planes.messages or not self.send_points('alone', flat), 'a plane')
        self.check_plane(planes.messages[-1])
        # where the frame of the floor is to have the name of one that is there, it is not published
        taken = rospy.Publisher('/taken/points', PointCloud2, queue_size=10)
        self.addCleanup(taken.unregister)
        self.clouds['taken'] = taken
        await_true(lambda: self.count('taken', 'frame exists') > 0 or not self.send_points('taken', flat), 'a warning')

    def test_4_bad_clouds_are_counted(self):
        self.listen('managed')
        message = cloud(room(), rospy.Time())
        message.fields = message.fields[:2]
        self.send('managed', message, after=1)
        self.diagnostics.await_event('managed/floor', 'bad clouds', 1, ["no field 'z'"])

    def test_5_a_frame_that_is_heard_after_the_first_clouds_is_not_published(self):
        node = subprocess.Popen([roslib.packages.find_node('openpose_ros_nodelets', 'floor_node')[0], '__ns:=/late',
                                 '__name:=floor', '_publish_tf:=true', '_floor_frame:=late_world'])
        self.addCleanup(node.wait)
        self.addCleanup(node.terminate)
        late, sent = rospy.Publisher('/late/points', PointCloud2, queue_size=10), Recorder('/tf', TFMessage, False)
        self.addCleanup(late.unregister)
        self.clouds['late'] = late
        await_true(late.get_num_connections, 'late subscribes')
        for _ in range(4):  # the floor is found before the frame of another node comes
            self.send_points('late', room())
        broadcaster = tf2_ros.StaticTransformBroadcaster()
        transform = TransformStamped(child_frame_id='late_world')
        transform.header.frame_id, transform.transform.rotation.w = 'map', 1.0
        broadcaster.sendTransform(transform)
        await_true(lambda: self.count('late', 'frame exists') > 0 or not self.send_points('late', room()), 'a warning')
        self.assertNotIn('late_world', {each.child_frame_id for message in sent.messages
                                        for each in message.transforms})


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_nodelets', 'check_floor', FloorTest, sys.argv)
