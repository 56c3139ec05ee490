#!/usr/bin/python3
"""People, hands and faces become markers where they are, which vanish with them; tests/unit/show tests their looks."""
import sys
import unittest

import numpy as np
import rospy
import rostest
from dynamic_reconfigure.client import Client
from harness import OUTPUT, now
from openpose_ros_msgs.msg import FaceDetection_3dArray, HandDetection_3dArray, PersonDetection_3dArray
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from openpose_ros_pkg.skeletons import COCO_18
from session import PATIENCE, Diagnostics, Recorder, await_true
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import MEASURED, MISSING, People3D
from skeleton_extract_3d.ros.convert import faces_to_array, hands_to_array, people_to_array

NODE = 'skeleton_extract_3d_visualization_node'
# A neck with a head and a right arm whose elbow is missing: two limbs [m].
JOINTS = {'neck': (0.0, -0.4, 3.0), 'nose': (0.0, -0.6, 2.9), 'right_shoulder': (-0.2, -0.4, 3.1),
          'right_wrist': (-0.3, 0.1, 2.8)}


def people(*ids: int) -> People3D:
    """Return people of those ids, each a metre to the right of the one before."""
    xyz = np.full((len(ids), 18, 3), np.nan)
    for p in range(len(ids)):
        for joint, place in JOINTS.items():
            xyz[p, COCO_18.index[joint]] = np.add(place, (p, 0, 0))
    found = np.isfinite(xyz).all(axis=2)
    return People3D(COCO_18, xyz, found * 0.5, np.where(found, MEASURED, MISSING), np.full(found.shape, np.nan), ids)


def landmarks(number: int) -> Points3D:
    """Return the points of a hand or a face, 2 cm from each to the next."""
    xyz = np.add((0.0, 0.0, 2.0), np.arange(number)[:, np.newaxis] * (0.02, 0, 0))[np.newaxis]
    return Points3D(xyz, np.full((1, number), 0.9), np.full((1, number), MEASURED), np.full((1, number), 0.01))


def header() -> Header:
    return Header(stamp=now(), frame_id='somewhere')


class VisualizationTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_visualization')
        cls.diagnostics = Diagnostics()
        cls.markers = [Recorder(f'{OUTPUT}/visualization_{name}', Marker) for name in ('markers', 'skeleton')]
        cls.publisher = cls.publisher_of('poses', PersonDetection_3dArray)

    @classmethod
    def publisher_of(cls, name, kind):
        """Return a publisher of an input of the node, which is heard."""
        publisher = rospy.Publisher(f'{OUTPUT}/detected_{name}_3d', kind, queue_size=10)
        await_true(publisher.get_num_connections, f'the node for {name}')
        return publisher

    def setUp(self):
        self.show(9)

    def show(self, *ids: int, number: int = 0) -> list:
        """Publish a frame and return its markers, at least so many; by default, two of each person."""
        array = people_to_array(people(*ids), header())
        self.publisher.publish(array)

        def of_frame():
            found = [marker for recorder in self.markers for marker in recorder.messages.copy()
                     if marker.header.stamp == array.header.stamp]
            return found if len(found) >= (number or 2 * len(ids)) else []
        return await_true(of_frame, f'the markers of {ids}')

    def test_parameters_change_while_the_node_runs(self):
        client = Client(NODE, timeout=PATIENCE)
        try:
            client.update_configuration({'joint_scale': 0.125, 'label': True, 'joint_colour': '0 1 0 1'})
            found = {marker.ns: marker for marker in self.show(9, number=3)}
            self.assertEqual((found['joints'].scale.x, found['label'].text), (0.125, '9'))
            self.assertEqual((found['joints'].color.r, found['joints'].color.g), (0, 1))
            refused = client.update_configuration({'joint_colour': 'green'})
            self.assertEqual(refused['joint_colour'], '0 1 0 1')
        finally:
            client.update_configuration({'joint_scale': 0.05, 'label': False, 'joint_colour': '1 0 0 1'})
        found = self.show(9, number=3)
        self.assertEqual([marker.ns for marker in found if marker.action == Marker.DELETE], ['label'])

    def test_hands_and_faces_are_shown_and_deleted(self):
        hand = Hands3D(landmarks(21), np.ones(1), np.array([4]), np.array([True]))
        face = Faces3D(landmarks(70), np.ones(1), np.array([4]), np.array([(0, 0, 0, 1)]), np.ones(1))
        for name, kind, to_array, some, points in (
                ('hands', HandDetection_3dArray, hands_to_array, hand, {('hand', 9): 40}),
                ('faces', FaceDetection_3dArray, faces_to_array, face, {('face', 4): 126, ('head_direction', 4): 2})):
            with self.subTest(name):
                # the node reads what its markers need that have a subscriber
                recorder = Recorder(f'{OUTPUT}/visualization_{name}', Marker)
                publisher = self.publisher_of(name, kind)
                publisher.publish(to_array(some, header()))
                found = recorder.wait(len(points))
                self.assertEqual({(each.ns, each.id): len(each.points) for each in found}, points)
                self.assertEqual({(each.action, each.header.frame_id) for each in found}, {(Marker.ADD, 'somewhere')})
                publisher.publish(to_array(some.empty(), header()))
                gone = recorder.wait(2 * len(points))[len(points):]
                self.assertEqual({(each.ns, each.id, each.action) for each in gone},
                                 {(*key, Marker.DELETE) for key in points})

    def test_people_of_an_unknown_joint_set_are_counted(self):
        before = self.diagnostics.count(NODE, 'bad input')
        self.publisher.publish(PersonDetection_3dArray(header=Header(stamp=now()), pose_model='SPIDER'))
        self.diagnostics.await_event(NODE, 'bad input', before + 1, ['SPIDER', 'COCO_18'])
        self.assertEqual(len(self.show(9)), 2)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_visualization', VisualizationTest, sys.argv)
