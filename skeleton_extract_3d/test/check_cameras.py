#!/usr/bin/python3
"""Two cameras share one detection service: both get their share, ids and markers of their own, and a switch each."""
import sys
import unittest
from itertools import groupby
from typing import List, Tuple

import rosgraph
import rospy
import rostest
from harness import OUTPUT
from openpose_ros_msgs.msg import PersonDetection_3dArray
from std_srvs.srv import SetBool
from visualization_msgs.msg import Marker

from openpose_ros_pkg.ros.session import PATIENCE, await_true

CAMERAS = ('left', 'right')
# Results of each camera that are judged.
RESULTS = 12
# The left camera is twice as fast as the right one, and each may begin a frame while the other's is answered.
MOST_IN_A_ROW = 6


class CamerasTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_cameras')
        cls.arrivals: List[Tuple[str, PersonDetection_3dArray]] = []
        cls.markers: List[Tuple[str, Marker]] = []
        cls.subscribers = [
            rospy.Subscriber(f'{camera}/{OUTPUT}/{topic}', kind, lambda message, camera=camera, kept=kept:
                             kept.append((camera, message)))
            for camera in CAMERAS for topic, kind, kept in (
                ('detected_poses_3d', PersonDetection_3dArray, cls.arrivals),
                ('visualization_markers', Marker, cls.markers))]
        await_true(lambda: all(cls.people(camera) for camera in CAMERAS), 'people before each camera')
        first = len(cls.arrivals)
        cls.wait(RESULTS, *CAMERAS)
        cls.judged = cls.arrivals[first:]

    @classmethod
    def people(cls, camera: str) -> List[PersonDetection_3dArray]:
        """Return the results of a camera with somebody in them."""
        return [array for name, array in list(cls.arrivals) if name == camera and array.persons]

    @classmethod
    def wait(cls, number: int, *cameras: str) -> None:
        """Wait for so many more results of each camera."""
        before = len(cls.arrivals)
        await_true(lambda: all([name for name, _ in cls.arrivals[before:]].count(each) >= number for each in cameras),
                   f'{number} results of {cameras}')

    def test_neither_waits_for_ever(self):
        rows = [(name, len(list(row))) for name, row in groupby(name for name, _ in self.judged)]
        longest = {camera: max(number for name, number in rows if name == camera) for camera in CAMERAS}
        rospy.loginfo('%d results in all, most in a row %s', len(self.judged), longest)
        self.assertLessEqual(max(longest.values()), MOST_IN_A_ROW)

    def test_each_has_ids_of_its_own(self):
        """Although the frames of both have the same name, each counts from 1."""
        for camera in CAMERAS:
            people = self.people(camera)
            self.assertEqual({array.header.frame_id for array in people}, {'kinect2_rgb_optical_frame'})
            self.assertIn(1, {person.person_ID for array in people for person in array.persons})

    def test_markers_of_each(self):
        await_true(lambda: {name for name, _ in list(self.markers)} == set(CAMERAS), 'markers of both')
        arrays = {(name, array.header.stamp): array for name, array in list(self.arrivals)}
        shown = [(arrays[name, marker.header.stamp], marker) for name, marker in list(self.markers)
                 if (name, marker.header.stamp) in arrays and marker.action == Marker.ADD]
        self.assertGreater(len(shown), 0)
        for array, marker in shown:
            self.assertIn(marker.id, [person.person_ID for person in array.persons])

    def test_the_service_publishes_nothing_itself(self):
        published = dict(rosgraph.Master('/check_cameras').getSystemState()[0])
        self.assertNotIn('/openpose_ros/detected_poses', published)
        for camera in CAMERAS:
            self.assertEqual(published[f'/{camera}/{OUTPUT}/detected_poses'], [f'/{camera}/skeleton_extract_3d_node'])

    def test_one_is_disabled_and_the_other_goes_on(self):
        name = 'left/skeleton_extract_3d_node/enable'
        rospy.wait_for_service(name, PATIENCE)
        enable = rospy.ServiceProxy(name, SetBool)
        self.addCleanup(enable, True)
        self.assertTrue(enable(False).success)
        self.wait(3, 'right')  # meanwhile, what was at work in the left one came
        before = len(self.arrivals)
        self.wait(5, 'right')
        self.assertEqual({camera for camera, _ in self.arrivals[before:]}, {'right'})
        self.assertTrue(enable(True).success)
        self.wait(3, *CAMERAS)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_cameras', CamerasTest, sys.argv)
