#!/usr/bin/python3
"""Cameras share one detector: each gets its share, ids of its own, and a switch; for two launch files."""
import sys
import unittest
from itertools import groupby
from typing import List, Tuple

import rosgraph
import rospy
import rostest
from harness import OUTPUT
from openpose_ros_msgs.msg import PersonDetection_3dArray

from demand import enable
from session import Diagnostics, await_true

# Results of each camera that are judged.
RESULTS = 12
# Each camera is twice as fast as the next one, and may begin a frame while another's is answered.
MOST_IN_A_ROW = 6


class CamerasTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_cameras')
        cls.cameras = rospy.get_param('~cameras').split()
        cls.one_process = rospy.get_param('~one_process')
        cls.arrivals: List[Tuple[str, PersonDetection_3dArray]] = []
        cls.subscribers = [rospy.Subscriber(f'{camera}/{OUTPUT}/detected_poses_3d', PersonDetection_3dArray,
                                            lambda message, camera=camera: cls.arrivals.append((camera, message)))
                           for camera in cls.cameras]
        await_true(lambda: all(cls.people(camera) for camera in cls.cameras), 'people before each camera')
        first = len(cls.arrivals)
        cls.wait(RESULTS, *cls.cameras)
        cls.judged = cls.arrivals[first:]

    @classmethod
    def people(cls, camera: str) -> List[PersonDetection_3dArray]:
        """Return the results of a camera that have people."""
        return [array for name, array in list(cls.arrivals) if name == camera and array.persons]

    @classmethod
    def wait(cls, number: int, *cameras: str) -> None:
        """Wait for so many more results of each camera."""
        before = len(cls.arrivals)
        await_true(lambda: all([name for name, _ in cls.arrivals[before:]].count(each) >= number for each in cameras),
                   f'{number} results of {cameras}')

    def test_neither_waits_for_ever(self):
        rows = [(name, len(list(row))) for name, row in groupby(name for name, _ in self.judged)]
        longest = {camera: max(number for name, number in rows if name == camera) for camera in self.cameras}
        rospy.loginfo('%d results in all, most in a row %s', len(self.judged), longest)
        self.assertLessEqual(max(longest.values()), MOST_IN_A_ROW)

    def test_each_has_ids_of_its_own(self):
        """Although the frames of all have the same name, each counts from 1."""
        for camera in self.cameras:
            people = self.people(camera)
            self.assertEqual({array.header.frame_id for array in people}, {'kinect2_rgb_optical_frame'})
            self.assertIn(1, {person.person_ID for array in people for person in array.persons})

    def test_topics_and_diagnostics_belong_to_a_camera(self):
        published = dict(rosgraph.Master('/check_cameras').getSystemState()[0])
        self.assertFalse({'/openpose_ros/detected_poses', f'/{OUTPUT}/detected_poses'} & set(published))
        for camera in self.cameras:
            node = '/skeleton_extract_3d_node' if self.one_process else f'/{camera}/skeleton_extract_3d_node'
            self.assertEqual(published[f'/{camera}/{OUTPUT}/detected_poses'], [node])
            self.assertEqual(published[f'/{camera}/skeleton_extract_3d_node/timing'], [node])
        Diagnostics(*(f'{camera}/skeleton_extract_3d_node' for camera in self.cameras))

    def test_one_is_disabled_and_the_others_go_on(self):
        first, *others = self.cameras
        node = f'{first}/skeleton_extract_3d_node'
        self.addCleanup(enable, node, True)
        self.assertTrue(enable(node, False))
        self.wait(3, *others)  # meanwhile, what was at work in the first one came
        before = len(self.arrivals)
        self.wait(5, *others)
        self.assertEqual({camera for camera, _ in self.arrivals[before:]}, set(others))
        self.assertTrue(enable(node, True))
        self.wait(3, *self.cameras)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_cameras', CamerasTest, sys.argv)
