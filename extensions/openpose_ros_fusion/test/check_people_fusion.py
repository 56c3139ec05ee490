#!/usr/bin/python3
"""Four cameras around walking people: one set of people, whatever becomes of one of the cameras."""
import sys
import threading
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from openpose_ros_msgs.msg import FusedCamera, FusedCameraArray, PersonDetection_3dArray, PersonDetectionArray
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from openpose_ros_pkg.ros import convert as convert_2d
from session import Diagnostics, Recorder, await_true
from simulated_rig import CAMERA, around, walking
from skeleton_extract_3d.ros import convert

RATE = 15.0
PEOPLE = 2
OUTPUT = 'openpose_ros/skeleton_3d'
NODE = 'people/people_fusion_node'
# Noise of the cameras' joints is 20 mm per axis, and a late message is moved by what people do in a period.
WRONG = 0.06


class Players(threading.Thread):
    """Plays what the cameras see.

    Attributes:
        cameras: may be changed while it plays.
        silent: names of those that send nothing.
    """

    def __init__(self):
        super().__init__(name='players', daemon=True)
        self.room, self.cameras = walking(200.0, PEOPLE), around(4)
        self.silent, self.begin = set(), rospy.get_time()
        self.broadcaster = tf2_ros.StaticTransformBroadcaster()
        self.people = [rospy.Publisher(f'/{camera.name}/{OUTPUT}/detected_poses_3d', PersonDetection_3dArray,
                                       queue_size=5) for camera in self.cameras[:3]]
        self.keypoints = rospy.Publisher('/camera3/openpose_ros/detected_poses', PersonDetectionArray, queue_size=5)
        self.infos = rospy.Publisher('/camera3/openpose_ros/camera_info', CameraInfo, queue_size=5)

    def tell_where(self, *names):
        """Publish where cameras are believed to stand."""
        self.broadcaster.sendTransform([transform(camera) for camera in self.cameras if camera.name in names])

    def run(self):
        rate = rospy.Rate(RATE)
        while not rospy.is_shutdown():
            try:
                now = rospy.get_time()
                for camera in self.cameras:
                    if camera.name not in self.silent:
                        self.send(camera, now)
                rate.sleep()
            except rospy.ROSException:
                return  # the test has ended

    def send(self, camera, now):
        header = Header(stamp=rospy.Time.from_sec(now + camera.late), frame_id=camera.name)
        index = int(camera.name[-1])
        if index < 3:
            people = camera.people(self.room, now - self.begin)
            self.people[index].publish(convert.people_to_array(people, header))
        else:
            self.infos.publish(convert.camera_to_message(CAMERA, header))
            self.keypoints.publish(convert_2d.people_to_array(camera.keypoints(self.room, now - self.begin), header))


def transform(camera):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = camera.believed_pose
    return convert.transform_from_matrix(matrix, Header(frame_id='room'), camera.name)


class PeopleFusionTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_people_fusion')
        cls.diagnostics = Diagnostics(NODE)
        cls.players = Players()
        cls.players.tell_where('camera0', 'camera1', 'camera3')  # camera2 comes later
        cls.players.start()
        cls.arrays = Recorder(f'/people/{OUTPUT}/detected_poses_3d', PersonDetection_3dArray)
        cls.states = Recorder('/people/cameras', FusedCameraArray)

    def fused(self):
        """Return stamps, and ids and greatest median errors [m] of the people, of the frames of a second from now."""
        first = len(self.arrays.messages)
        await_true(lambda: len(self.arrays.messages) > first
                   and (self.arrays.messages[-1].header.stamp - self.arrays.messages[first].header.stamp).to_sec()
                   >= 1.0, 'fused people')
        frames = [(array.header.stamp.to_sec(), convert.people_from_array(array))
                  for array in self.arrays.messages[first:]]
        truth = [self.players.room.at(stamp - self.players.begin) for stamp, _ in frames]
        errors = [np.median(np.linalg.norm(people.xyz[:, None] - joints[None], axis=3), axis=2)
                  for (_, people), joints in zip(frames, truth)]
        return ([stamp for stamp, _ in frames], [people.ids[found.argmin(axis=0)].tolist() if len(people) else []
                                                 for (_, people), found in zip(frames, errors)],
                [found.min(axis=0).max() if found.size else np.inf for found in errors], [len(p) for _, p in frames])

    def people_are_right(self):
        """Check the frames of a second; return the ids of the people."""
        stamps, ids, errors, numbers = self.fused()
        self.assertTrue(np.all(np.diff(stamps) > 0))
        self.assertEqual(set(numbers), {PEOPLE})
        self.assertEqual(len({tuple(each) for each in ids}), 1, 'ids stay')
        self.assertLess(np.median(errors), WRONG)
        return ids[0]

    def await_state(self, name, state):
        def newest():
            return {camera.name: camera for camera in self.states.messages[-1].cameras} if self.states.messages else {}
        await_true(lambda: name in newest() and newest()[name].state == state,
                   lambda: f'{name} in state {state}; it is {newest().get(name)}')
        return newest()[name]

    def test_one_set_of_people(self):
        # the camera of which tf knows nothing is left out, and said so; the others are fused
        self.await_state('camera2', FusedCamera.NO_TRANSFORM)
        self.diagnostics.await_text(NODE, 'camera2 no transform')
        self.await_state('camera0', FusedCamera.OK)
        ids = self.people_are_right()
        self.players.tell_where('camera0', 'camera1', 'camera2', 'camera3')
        self.await_state('camera2', FusedCamera.OK)
        self.assertEqual(self.people_are_right(), ids)
        camera = self.await_state('camera3', FusedCamera.OK)
        self.assertFalse(camera.has_depth)
        self.assertEqual(camera.people, PEOPLE)
        self.assertEqual(self.arrays.messages[-1].header.frame_id, 'room')

        # one dies, and comes back
        self.players.silent = {'camera1'}
        self.await_state('camera1', FusedCamera.SILENT)
        self.diagnostics.await_text(NODE, 'camera1 silent')
        self.assertEqual(self.people_are_right(), ids)
        self.players.silent = set()
        self.await_state('camera1', FusedCamera.OK)

        # one does not stand where it is believed to
        self.players.cameras[2].moved = (0.08, 0.06, 0.0)
        self.players.tell_where('camera0', 'camera1', 'camera2', 'camera3')
        camera = self.await_state('camera2', FusedCamera.DISAGREES)
        self.diagnostics.await_text(NODE, 'camera2 disagrees')
        await_true(lambda: abs(self.states.messages[-1].cameras[2].error - 0.1) < 0.025, 'its error')
        self.assertEqual(self.people_are_right(), ids)
        self.await_state('camera0', FusedCamera.OK)


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_fusion', 'check_people_fusion', PeopleFusionTest)
