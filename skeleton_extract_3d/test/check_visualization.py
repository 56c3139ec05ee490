#!/usr/bin/python3
"""People become spheres and lines at their joints, hidden joints others than seen ones, and vanish when they leave."""
import sys
import unittest
from functools import partial
from typing import Sequence

import numpy as np
import rospy
import rostest
from dynamic_reconfigure.client import Client
from harness import OUTPUT, now
from openpose_ros_msgs.msg import PersonDetection_3dArray
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from openpose_ros_pkg.skeletons import COCO_18
from session import PATIENCE, Diagnostics, await_true, is_heard
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.ros.convert import faces_to_array, hands_to_array, people_to_messages

NODE = 'skeleton_extract_3d_visualization_node'
# A neck with a head and a right arm whose elbow is missing: two limbs [m].
JOINTS = {'neck': (0.0, -0.4, 3.0), 'nose': (0.0, -0.6, 2.9), 'right_shoulder': (-0.2, -0.4, 3.1),
          'right_wrist': (-0.3, 0.1, 2.8)}
# Of the nose [m]; the others have none.
SIGMA = 0.08


def people(*ids: int, hidden: Sequence[str] = (), ahead: float = 0.0) -> People3D:
    """Return people of those ids, each a metre to the right of the one before.

    Args:
        hidden: joints that are INFERRED.
        ahead: how much further away than in JOINTS they are [m].
    """
    xyz = np.full((len(ids), 18, 3), np.nan)
    for p in range(len(ids)):
        for joint, place in JOINTS.items():
            xyz[p, COCO_18.index[joint]] = np.add(place, (p, 0, ahead))
    found = np.isfinite(xyz).all(axis=2)
    status = np.where(found, MEASURED, MISSING)
    for joint in hidden:
        status[:, COCO_18.index[joint]] = INFERRED
    sigma = np.full(found.shape, np.nan)
    sigma[:, COCO_18.index['nose']] = SIGMA
    return People3D(COCO_18, xyz, found * 0.5, status, sigma, ids)


def landmarks(number: int) -> Points3D:
    """Return the points of a hand or a face, 2 cm from each to the next."""
    xyz = np.add((0.0, 0.0, 2.0), np.arange(number)[:, np.newaxis] * (0.02, 0, 0))[np.newaxis]
    return Points3D(xyz, np.full((1, number), 0.9), np.full((1, number), MEASURED), np.full((1, number), 0.01))


def places(marker: Marker) -> list:
    return [(point.x, point.y, point.z) for point in marker.points]


class VisualizationTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_visualization')
        cls.markers = {namespace: [] for namespace in ('', 'everything/')}
        cls.topics = set()
        cls.diagnostics = Diagnostics()
        topics = []
        for namespace in cls.markers:
            for topic in ('visualization_markers', 'visualization_skeleton'):
                topics.append(f'{namespace}{OUTPUT}/{topic}')
                rospy.Subscriber(topics[-1], Marker, partial(cls.keep, namespace, topic))
        cls.publisher = rospy.Publisher(f'{OUTPUT}/detected_poses_3d', PersonDetection_3dArray, queue_size=10)
        await_true(lambda: cls.publisher.get_num_connections() == 2 and all(map(is_heard, topics)), 'connections')

    @classmethod
    def keep(cls, namespace: str, topic: str, marker: Marker):
        cls.markers[namespace].append(marker)
        cls.topics.add((topic, marker.ns))

    def setUp(self):
        self.show(9)  # a third person, whose deletes tell when the next frame is complete
        for kept in self.markers.values():
            kept.clear()

    def show(self, *ids: int, number: int = 0, namespace: str = '', **looks) -> list:
        """Publish a frame and return its markers; both nodes have it then."""
        header = Header(stamp=now(), frame_id='somewhere')
        persons = people_to_messages(people(*ids, **looks), header)
        self.publisher.publish(PersonDetection_3dArray(header=header, pose_model='COCO_18', persons=persons))
        for either in self.markers:
            await_true(lambda either=either: self.of_frame(header, 1, either), f'markers of {ids} in {either or "/"}')
        return await_true(lambda: self.of_frame(header, number or 2 * len(ids), namespace), f'the markers of {ids}')

    def of_frame(self, header: Header, number: int, namespace: str) -> list:
        found = [marker for marker in list(self.markers[namespace]) if marker.header.stamp == header.stamp]
        return found if len(found) >= number else []

    def test_joints_and_limbs(self):
        found = {(marker.ns, marker.id): marker for marker in self.show(4, 9) if marker.action == Marker.ADD}
        self.assertEqual(set(found), {('joints', 4), ('skeleton', 4), ('joints', 9), ('skeleton', 9)})
        for (ns, _), marker in found.items():
            self.assertEqual(marker.type, Marker.SPHERE_LIST if ns == 'joints' else Marker.LINE_LIST)
            self.assertEqual(marker.header.frame_id, 'somewhere')
            self.assertTrue(np.isfinite(places(marker)).all())
        order = sorted(JOINTS, key=COCO_18.joints.index)
        np.testing.assert_allclose(places(found['joints', 4]), [JOINTS[joint] for joint in order], atol=1e-6)
        shifted = np.add([JOINTS[joint] for joint in order], (1, 0, 0))
        np.testing.assert_allclose(places(found['joints', 9]), shifted, atol=1e-6)
        limbs = [JOINTS[joint] for joint in ('neck', 'right_shoulder', 'neck', 'nose')]
        np.testing.assert_allclose(places(found['skeleton', 4]), limbs, atol=1e-6)
        self.assertLessEqual({('visualization_markers', 'joints'), ('visualization_skeleton', 'skeleton')}, self.topics)

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

    def test_whoever_leaves_is_deleted_and_nobody_else(self):
        self.show(4, 9)
        found = self.show(9, number=4)
        gone = {(marker.ns, marker.id) for marker in found if marker.action == Marker.DELETE}
        self.assertEqual(gone, {('joints', 4), ('skeleton', 4)})
        gone = {(marker.ns, marker.id) for marker in self.show(number=2) if marker.action == Marker.DELETE}
        self.assertEqual(gone, {('joints', 9), ('skeleton', 9)})

    def test_labels_spheres_of_sigma_trails_and_a_colour_for_each_person(self):
        self.show(4, 9, number=8, namespace='everything/')
        found = {(marker.ns, marker.id): marker
                 for marker in self.show(4, 9, number=10, namespace='everything/', ahead=0.5)}
        self.assertEqual(set(found), {(ns, person) for ns in ('joints', 'skeleton', 'label', 'trail')
                                      for person in (4, 9)} | {('sigma', 16 * 4 + 6), ('sigma', 16 * 9 + 6)})
        self.assertEqual(found['label', 4].text, '4')
        nose = np.add(JOINTS['nose'], (0, 0, 0.5))
        np.testing.assert_allclose(places(found['sigma', 16 * 4 + 6]), [nose], atol=1e-6)
        # without hips, the way of the shoulders; where 4 was before depends on the other tests
        middle = np.mean([JOINTS['neck'], JOINTS['right_shoulder']], axis=0)
        np.testing.assert_allclose(places(found['trail', 4])[-2:], [middle, np.add(middle, (0, 0, 0.5))], atol=1e-6)

    def check_shown(self, name: str, messages: Sequence, points: dict):
        """Publish a hand or a face, then none, and compare the markers.

        Args:
            messages: the array with somebody, and the empty one.
            points: how many points the markers have by (ns, id).
        """
        markers = []
        listener = rospy.Subscriber(f'{OUTPUT}/visualization_{name}', Marker, markers.append)
        publisher = rospy.Publisher(f'{OUTPUT}/detected_{name}_3d', type(messages[0]), queue_size=10)
        await_true(lambda: publisher.get_num_connections() and is_heard(listener.name), f'the node for {name}')
        publisher.publish(messages[0])
        await_true(lambda: len(markers) == len(points), f'markers of {name}')
        self.assertEqual({(marker.ns, marker.id): len(marker.points) for marker in markers}, points)
        self.assertEqual({(marker.action, marker.header.frame_id) for marker in markers}, {(Marker.ADD, 'somewhere')})
        for arrow in (marker for marker in markers if marker.type == Marker.ARROW):
            np.testing.assert_allclose(np.diff(places(arrow), axis=0), [(0.25, 0, 0)], atol=1e-6)
        publisher.publish(messages[1])
        await_true(lambda: len(markers) == 2 * len(points), f'deletes of {name}')
        self.assertEqual({(marker.ns, marker.id, marker.action) for marker in markers[len(points):]},
                         {(*key, Marker.DELETE) for key in points})

    def test_fingers_and_deletes_of_a_hand(self):
        hand = Hands3D(landmarks(21), np.ones(1), np.array([4]), np.array([True]))
        header = Header(stamp=now(), frame_id='somewhere')
        messages = [hands_to_array(hands, header) for hands in (hand, Hands3D.empty())]
        self.check_shown('hands', messages, {('hand', 2 * 4 + 1): 2 * 20})

    def test_contours_direction_and_deletes_of_a_face(self):
        face = Faces3D(landmarks(70), np.ones(1), np.array([4]), np.array([(0, 0, 0, 1)]), np.ones(1))
        header = Header(stamp=now(), frame_id='somewhere')
        messages = [faces_to_array(faces, header) for faces in (face, Faces3D.empty())]
        self.check_shown('faces', messages, {('face', 4): 2 * 63, ('head_direction', 4): 2})

    def test_people_of_an_unknown_joint_set_are_counted(self):
        before = self.diagnostics.count(NODE, 'bad input')
        self.publisher.publish(PersonDetection_3dArray(header=Header(stamp=now()), pose_model='SPIDER'))
        self.diagnostics.await_event(NODE, 'bad input', before + 1, ['SPIDER', 'COCO_18'])
        self.assertEqual(len(self.show(9)), 2)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_visualization', VisualizationTest, sys.argv)
