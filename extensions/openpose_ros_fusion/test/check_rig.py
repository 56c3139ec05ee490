#!/usr/bin/python3
"""Three cameras without depth, and a file that says where they stand: people, and the cameras on tf."""
import sys
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from openpose_ros_fusion.rig import read_rig
from openpose_ros_pkg.ros import convert as convert_2d
from session import Diagnostics, Recorder, await_true
from simulated_rig import CAMERA, around, walking
from skeleton_extract_3d.ros import convert

RATE = 10.0
PEOPLE = 2
NODE = 'people/people_fusion_node'
# Noise of the keypoints is 20 mm; depth comes from rays that cross.
WRONG = 0.06
CAMERAS = around(3)
RIG = read_rig(Path(__file__).resolve().with_name('rig.yaml'))


def mount(camera):
    """Return the frame of a driver above the optical frame of a camera."""
    pose = np.eye(4)
    pose[:3, 3] = (0.1, 0.2, 0.3)
    return convert.transform_from_matrix(pose, Header(frame_id=f'{camera}_link'), camera)


class RigTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_rig')
        cls.driver = tf2_ros.StaticTransformBroadcaster()
        cls.driver.sendTransform([mount('camera1')])
        cls.diagnostics = Diagnostics(NODE)
        cls.tf = Recorder('/tf_static', TFMessage)
        cls.room, cls.begin = walking(200.0, PEOPLE), rospy.get_time()
        cls.keypoints = {camera.name: rospy.Publisher(f'/{camera.name}/openpose_ros/detected_poses',
                                                      PersonDetectionArray, queue_size=5) for camera in CAMERAS}
        cls.infos = {camera.name: rospy.Publisher(f'/{camera.name}/openpose_ros/camera_info', CameraInfo, queue_size=5)
                     for camera in CAMERAS}
        cls.timer = rospy.Timer(rospy.Duration(1 / RATE), cls.send)

    @classmethod
    def send(cls, _):
        now = rospy.get_time()
        for camera in CAMERAS:
            header = Header(stamp=rospy.Time.from_sec(now), frame_id=camera.name)
            cls.infos[camera.name].publish(convert.camera_to_message(CAMERA, header))
            cls.keypoints[camera.name].publish(convert_2d.people_to_array(
                camera.keypoints(cls.room, now - cls.begin), header))

    def placed(self):
        """Return the frames that the node has placed with its newest message."""
        own = [message for message in self.tf.messages if message._connection_header['callerid'] == f'/{NODE}']
        return {one.child_frame_id for one in own[-1].transforms} if own else set()

    def check_tf(self, buffer):
        for camera in CAMERAS:
            await_true(lambda name=camera.name: buffer.can_transform('room', name, rospy.Time()), camera.name)
            rotation, translation = convert.rotation_and_translation(
                buffer.lookup_transform('room', camera.name, rospy.Time()))
            np.testing.assert_allclose(rotation, RIG.camera(camera.name).pose[0], atol=1e-6)
            np.testing.assert_allclose(translation, RIG.camera(camera.name).translation, atol=1e-6)

    def test_1_cameras_on_tf_below_the_frames_of_their_drivers(self):
        # without a subscriber to people
        await_true(lambda: self.placed() == {'camera0', 'camera1_link', 'camera2'}, lambda: f'placed: {self.placed()}')
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)
        self.check_tf(buffer)
        # a driver that starts later, and its frames
        self.driver.sendTransform([mount('camera1'), mount('camera2')])
        await_true(lambda: self.placed() == {'camera0', 'camera1_link', 'camera2_link'},
                   lambda: f'placed: {self.placed()}')
        await_true(lambda: buffer.can_transform('room', 'camera2_link', rospy.Time()), 'camera2_link')
        self.check_tf(buffer)
        listener.unregister()

    def test_2_people_of_cameras_without_depth(self):
        people = Recorder('/people/openpose_ros/skeleton_3d/detected_poses_3d', PersonDetection_3dArray)
        self.addCleanup(people.close)

        def errors():
            """Return the greatest median error of a person in each of the newest frames; inf where one is missing."""
            found = []
            for message in people.messages[-10:]:
                truth = self.room.at(message.header.stamp.to_sec() - self.begin)
                xyz = convert.people_from_array(message).xyz
                apart = np.median(np.linalg.norm(xyz[:, None] - truth[None], axis=3), axis=2)
                found.append(apart.min(axis=0).max() if len(xyz) == PEOPLE else np.inf)
            return found

        await_true(lambda: len(people.messages) > 10 and np.median(errors()) < WRONG, lambda: f'people: {errors()}')
        self.assertEqual(people.messages[-1].header.frame_id, 'room')


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_fusion', 'check_rig', RigTest, sys.argv)
