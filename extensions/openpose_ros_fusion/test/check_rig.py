#!/usr/bin/python3
"""A file says where three cameras stand: the node places them on tf, below the frames of their drivers."""
import sys
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from openpose_ros_fusion.rig import read_rig
from session import Recorder, await_true
from simulated_rig import around
from skeleton_extract_3d.ros import convert

NODE = '/people/people_fusion_node'
RIG = read_rig(Path(__file__).resolve().with_name('rig.yaml'))


def mount(camera):
    """Return the frame of a driver above the optical frame of a camera."""
    pose = np.eye(4)
    pose[:3, 3] = (0.1, 0.2, 0.3)
    return convert.transform_from_matrix(pose, Header(frame_id=f'{camera}_link'), camera)


class RigTest(unittest.TestCase):
    def setUp(self):
        self.tf, self.buffer = Recorder('/tf_static', TFMessage), tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.buffer)

    def check_placed(self, *frames):
        """Wait until the node has placed these frames, and check the cameras."""
        def placed():
            own = [message for message in self.tf.messages if message._connection_header['callerid'] == NODE]
            return {one.child_frame_id for one in own[-1].transforms} if own else set()
        await_true(lambda: placed() == set(frames), lambda: f'placed: {placed()}')
        for camera in around(3):
            await_true(lambda name=frames[-1]: self.buffer.can_transform('room', name, rospy.Time()), frames[-1])
            rotation, translation = convert.rotation_and_translation(
                self.buffer.lookup_transform('room', camera.name, rospy.Time()))
            np.testing.assert_allclose(rotation, camera.pose[0], atol=1e-4)
            np.testing.assert_allclose(translation, RIG.camera(camera.name).translation, atol=1e-6)

    def test_cameras_on_tf_below_the_frames_of_their_drivers(self):
        driver = tf2_ros.StaticTransformBroadcaster()
        driver.sendTransform([mount('camera1')])
        self.check_placed('camera0', 'camera1_link', 'camera2')
        # a driver that starts later, and its frames
        driver.sendTransform([mount('camera1'), mount('camera2')])
        self.check_placed('camera0', 'camera1_link', 'camera2_link')


if __name__ == '__main__':
    rospy.init_node('check_rig')
    rostest.rosrun('openpose_ros_fusion', 'check_rig', RigTest, sys.argv)
