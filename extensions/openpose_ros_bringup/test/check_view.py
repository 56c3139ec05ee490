#!/usr/bin/python3
"""What `view` opens, in which frame and from where; a program that keeps the configuration takes the place of RViz."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
import yaml
from openpose_ros_msgs.msg import FusedCamera, FusedCameraArray, PersonDetection_3dArray
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from openpose_ros_pkg.skeletons import COCO_18
from session import ENDS_WITH_PARENT, await_true
from skeleton_extract_3d.people import MEASURED, People3D
from skeleton_extract_3d.ros import convert

SPACE = 'openpose_ros/skeleton_3d'
CAMERA = 'camera_color_frame'  # an optical frame, without the word in its name
# A person 3 m in front of the camera, 0.5 m to the right, 1.7 m tall: x right, y down, z forward.
PERSON = np.column_stack([np.full(18, 0.5), np.linspace(-0.5, 1.2, 18), np.full(18, 3.0)])
AHEAD = np.array([0, 0, 2.5])  # of the camera, what it looks at
# In the frame of a robot: the camera is 1 m high, looks along y, and 0.5 rad down.
MOUNT = np.eye(4)
MOUNT[:3, :3] = (Rotation.from_euler('z', np.pi / 2) * Rotation.from_euler('y', 0.5)
                 * Rotation.from_quat([-0.5, 0.5, -0.5, 0.5])).apply(np.eye(3)).T
MOUNT[:3, 3] = 0, 0, 1
RVIZ = '''#!/bin/sh
cp "$4" "$VIEW_TEST_FOLDER/config.rviz"
echo "$@" > "$VIEW_TEST_FOLDER/arguments"
sleep 1
exit $VIEW_TEST_STATUS
'''


def people(header, joints=PERSON):
    shape = (1, len(joints))
    return convert.people_to_array(People3D(COCO_18, joints[np.newaxis], np.ones(shape),
                                            np.full(shape, MEASURED, np.uint8), np.full(shape, 0.02), np.ones(1, int)),
                                   header)


class ViewTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_view')
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform([convert.transform_from_matrix(MOUNT, Header(frame_id=parent), child)
                                       for parent, child in (('base_link', CAMERA), ('room', 'left_optical'))])
        cls.senders = []
        cls.timer = rospy.Timer(rospy.Duration(0.2), lambda _: [send() for send in cls.senders])

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder, self.ns = Path(folder.name), self._testMethodName.split('_')[1]
        (self.folder / 'rosrun').write_text(RVIZ)
        (self.folder / 'rosrun').chmod(0o755)
        self.addCleanup(self.senders.clear)

    def publish(self, topic, make, frame):
        publisher = rospy.Publisher(topic, type(make(Header())), queue_size=1)
        self.senders.append(lambda: publisher.publish(make(Header(stamp=rospy.Time.now(), frame_id=frame))))

    def single_camera(self, frame=CAMERA, make=people):
        self.publish(f'{self.ns}/{SPACE}/detected_poses_3d', make, frame)
        self.publish(f'{self.ns}/{SPACE}/input_pointcloud', lambda header: PointCloud2(header=header), CAMERA)

    def opened(self, *parameters, status=0):
        """Return the configuration that RViz is opened with, and the exit status of the node."""
        variables = {**os.environ, 'VIEW_TEST_FOLDER': str(self.folder), 'VIEW_TEST_STATUS': str(status)}
        program = subprocess.check_output(['catkin_find', '--first-only', '--libexec', 'openpose_ros_bringup', 'view'],
                                          text=True).strip()
        variables['PATH'] = f"{self.folder}:{variables['PATH']}"
        node = subprocess.Popen([*ENDS_WITH_PARENT, program, f'__ns:=/{self.ns}', *parameters], env=variables)
        self.addCleanup(node.wait)
        self.addCleanup(node.kill)
        path = self.folder / 'config.rviz'
        ended = await_true(lambda: node.poll() is not None and [node.returncode], 'the end of view')[0]
        return (yaml.safe_load(path.read_text())['Visualization Manager'] if path.exists() else None), ended

    def check(self, manager, frame, focal):
        self.assertEqual(manager['Global Options']['Fixed Frame'], frame)
        found = [manager['Views']['Current']['Focal Point'][axis] for axis in 'XYZ']
        np.testing.assert_allclose(found, focal, atol=0.01)

    # in the frame of a level camera: x forward, y left, z up
    UPRIGHT = (2.5, 0, 0)

    def test_a_frame_of_the_points_is_shown_upright(self):
        self.single_camera()
        heard = []
        subscriber = rospy.Subscriber('/tf_static', TFMessage, heard.append)
        self.addCleanup(subscriber.unregister)
        manager, ended = self.opened()
        self.check(manager, f'{CAMERA}_upright', self.UPRIGHT)
        self.assertEqual(ended, 0)
        link = next(one for message in heard for one in message.transforms if one.child_frame_id.endswith('_upright'))
        rotation, shift = convert.rotation_and_translation(link)
        np.testing.assert_allclose(rotation.T @ [0, 0, 1], [1, 0, 0], atol=1e-9)  # forward
        np.testing.assert_allclose(rotation.T @ [0, -1, 0], [0, 0, 1], atol=1e-9)  # up
        self.assertEqual((link.header.frame_id, shift.tolist()), (CAMERA, [0, 0, 0]))

    def test_c_frame_that_tf_does_not_connect_is_replaced(self):
        self.single_camera()
        manager, _ = self.opened('_floor:=true')
        self.check(manager, f'{CAMERA}_upright', self.UPRIGHT)

    def test_e_fused_people(self):
        self.publish(f'e/{SPACE}/detected_poses_3d', lambda header: PersonDetection_3dArray(
            header=header, pose_model='COCO_18'), 'room')
        self.publish('e/cameras', lambda header: FusedCameraArray(header=header, cameras=[
            FusedCamera(name='left', frame_id='left_optical', has_depth=True), FusedCamera(name='door')]), 'room')
        manager, _ = self.opened('_cameras:=left', '_rgb_cameras:=door')
        topics = {display['Name']: display.get('Topic', display.get('Image Topic', display.get('Marker Topic')))
                  for display in manager['Displays']}
        self.assertEqual(topics['Cloud of left'], f'/left/{SPACE}/input_pointcloud')
        self.assertEqual(topics['Image of door'], '/door/openpose_ros/detected_poses_image')
        self.assertEqual(topics['Skeletons'], f'/e/{SPACE}/visualization_skeleton')
        self.assertNotIn('Cloud of door', topics)
        self.check(manager, 'room', MOUNT[:3, :3] @ AHEAD + MOUNT[:3, 3])


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_bringup', 'check_view', ViewTest, sys.argv)
