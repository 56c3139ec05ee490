#!/usr/bin/python3
"""The whole chain on the shipped sequence finds its two people where they truly are."""
import json
import subprocess
import sys
import unittest
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np
import rosgraph
import rospy
import rostest
from harness import OUTPUT, Output, position, wait_for
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from sensor_msgs.msg import Image
from visualization_msgs.msg import Marker

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.rgbd_sequence import RgbdSequence

SEQUENCE = Path(__file__).resolve().parents[1] / 'demo' / 'cross'
OF_2D_SERVICE = '--2d-service' in sys.argv
# Frames to judge: a whole round of the sequence, unless frames are dropped.
FRAMES = 40
STARTUP = 60.0
# Joints lie inside the body and the cloud on its surface: 5 to 8 cm of the error are the radius of trunk and limbs, the
# rest is that of the pixel. Joints further than this from every person of the truth are somebody else's [m].
MEDIAN_ERROR, SAME_PERSON = 0.12, 0.5
# Of the people that show at least half of their joints.
LEAST_FOUND = 0.9
VISIBLE = 2


class Truth:
    """What is to be seen in each frame of the sequence."""

    def __init__(self) -> None:
        sequence, truth = RgbdSequence.read(SEQUENCE), json.loads((SEQUENCE / 'gt.json').read_text())
        self.frame_of = {sequence.frame(i).bgr.tobytes(): i for i in range(len(sequence))}
        self.order = [truth['joints'].index(joint) for joint in COCO_18.joints]
        self.frames = truth['frames']
        self.world_from_camera = sequence.T_world_camera

    def people(self, frame: int, in_world: bool) -> List[Tuple[np.ndarray, np.ndarray]]:
        """Return of each person the joints (18, 3) [m] and which are visible (18,)."""
        matrix = self.world_from_camera if in_world else np.eye(4)
        return [(np.array(person['xyz'])[self.order] @ matrix[:3, :3].T + matrix[:3, 3],
                 np.array(person['vis'])[self.order] == VISIBLE) for person in self.frames[frame]['people']]


class ChainTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_chain')
        cls.truth, cls.output = Truth(), Output()
        cls.frames: Dict[rospy.Time, int] = {}
        cls.markers: List[Marker] = []
        cls.arrays_2d: List[PersonDetectionArray] = []
        cls.subscribers = [rospy.Subscriber(f'{OUTPUT}/input_rgb', Image, cls.keep_frame, queue_size=5)] + [
            rospy.Subscriber(f'{OUTPUT}/visualization_{name}', Marker, cls.markers.append)
            for name in ('markers', 'skeleton')] + [
            rospy.Subscriber(f'{OUTPUT}/detected_poses', PersonDetectionArray, cls.arrays_2d.append)]
        topic = f'/{OUTPUT}/detected_poses_keypoints_3d'
        # the columns as a user's script sees them
        cls.echo = subprocess.Popen(['rostopic', 'echo', '-p', '-n', '2', topic], stdout=subprocess.PIPE,
                                    universal_newlines=True)
        cls.addClassCleanup(cls.echo.kill)
        wait_for(lambda: len(cls.judged()) >= FRAMES, f'{FRAMES} frames', STARTUP)

    @classmethod
    def keep_frame(cls, message: Image):
        cls.frames[message.header.stamp] = cls.truth.frame_of[message.data]

    @classmethod
    def judged(cls) -> List[Tuple[int, PersonDetection_3dArray]]:
        """Return the arrays whose frame of the sequence is known."""
        return [(cls.frames[array.header.stamp], array) for array in list(cls.output.arrays)
                if array.header.stamp in cls.frames]

    def test_people_are_where_they_truly_are(self):
        errors, expected, found, invented = [], 0, 0, 0
        for frame, array in self.judged():
            joints = np.array([[position(getattr(person, joint)) for joint in COCO_18.joints]
                               for person in array.persons]).reshape(-1, 18, 3)
            truth = self.truth.people(frame, in_world=OF_2D_SERVICE)
            distances = np.array([[np.linalg.norm(one - xyz, axis=1) for xyz, _ in truth] for one in joints])
            for p, (_, visible) in enumerate(truth):
                typical = [np.nanmedian(row[p][visible]) for row in distances if np.isfinite(row[p][visible]).any()]
                if visible.sum() >= 9:
                    expected += 1
                    found += min(typical, default=np.inf) < SAME_PERSON
                if typical and min(typical) < SAME_PERSON:
                    best = distances[int(np.argmin([np.nanmedian(row[p]) for row in distances]))][p][visible]
                    errors.extend(best[np.isfinite(best)])
            invented += sum(np.nanmin(np.nanmedian(row, axis=1)) > SAME_PERSON for row in distances)
        rospy.loginfo('%d frames, %d of %d people, %d invented, median error %.3f m', len(self.judged()), found,
                      expected, invented, np.median(errors))
        self.assertGreaterEqual(found, LEAST_FOUND * expected)
        self.assertLess(np.median(errors), MEDIAN_ERROR)
        self.assertLessEqual(invented, 0.05 * expected)

    def test_people_keep_their_ids(self):
        by_frame = [[person.person_ID for person in array.persons] for _, array in self.judged()]
        for ids in by_frame:
            self.assertEqual(len(set(ids)), len(ids))
        # two people, one of whom is hidden for a while, in at most two rounds of the sequence
        self.assertIn(len({person for ids in by_frame for person in ids}), range(2, 9))

    def test_messages_say_whose_they_are(self):
        frame_id = 'world' if OF_2D_SERVICE else 'kinect2_rgb_optical_frame'
        for _, array in self.judged():
            self.assertEqual((array.header.frame_id, array.pose_model), (frame_id, 'COCO_18'))
            for person in array.persons:
                self.assertEqual((person.header.stamp, person.header.frame_id), (array.header.stamp, frame_id))
                self.assertEqual(person.num_people_detected, len(array.persons))

    def test_markers_are_the_joints(self):
        arrays = {array.header.stamp: array for array in list(self.output.arrays)}
        checked = 0
        for marker in list(self.markers):
            if marker.action != Marker.ADD or marker.header.stamp not in arrays:
                continue
            person, = (person for person in arrays[marker.header.stamp].persons if person.person_ID == marker.id)
            places = np.array([(point.x, point.y, point.z) for point in marker.points])
            joints = np.array([position(getattr(person, joint)) for joint in COCO_18.joints])
            joints = joints[np.isfinite(joints).all(axis=1)]
            self.assertTrue(np.isfinite(places).all())
            self.assertEqual(marker.type, {'joints': Marker.SPHERE_LIST, 'skeleton': Marker.LINE_LIST}[marker.ns])
            self.assertEqual(marker.header.frame_id, person.header.frame_id)
            self.assertGreaterEqual(marker.lifetime.to_sec(), 0.15)
            if marker.ns == 'joints':
                np.testing.assert_allclose(places, joints, atol=1e-6)
            else:
                self.assertLess(np.abs(places[:, None] - joints).max(axis=2).min(axis=1).max(), 1e-6)
            checked += 1
        self.assertGreater(checked, FRAMES)

    def test_rostopic_echo_has_the_columns_of_the_original(self):
        header, first, _ = (line.split(',') for line in self.echo.communicate(timeout=20)[0].splitlines())
        parts = (*COCO_18.joints, 'chest')
        original = ['%time', 'field.num_people_detected', 'field.person_ID'] + [
            f'field.{part}.{name}' for part in parts for name in ('x', 'y', 'z', 'confidence')]
        self.assertEqual([column for column in header if column in original], original)
        self.assertEqual(header[1:4], ['field.header.seq', 'field.header.stamp', 'field.header.frame_id'])
        self.assertLess(header.index('field.header.frame_id'), header.index('field.num_people_detected'))
        row = dict(zip(header, first))
        self.assertEqual(len(first), len(header))
        self.assertEqual(row['%time'], row['field.header.stamp'])
        self.assertTrue(0 < float(row['field.neck.confidence']) <= 1)
        self.assertEqual((row['field.chest.x'], row['field.chest.confidence']), ('nan', '0.0'))

    def test_2d_results_carry_the_ids_of_the_people_in_space(self):
        in_space = {array.header.stamp: array for array in list(self.output.arrays)}
        pairs = [(array, in_space[array.header.stamp]) for array in list(self.arrays_2d)
                 if array.header.stamp in in_space]
        self.assertGreater(len(pairs), FRAMES // 2)
        for array, people in pairs:
            ids = [person.person_ID for person in array.persons]
            self.assertEqual(ids, [person.person_ID for person in people.persons][:len(ids)])
            for person, same in zip(array.persons, people.persons):
                self.assertEqual([getattr(person, joint).confidence for joint in COCO_18.joints],
                                 [getattr(same, joint).confidence for joint in COCO_18.joints])

    def test_what_is_published_has_one_publisher(self):
        published = dict(rosgraph.Master('/check_chain').getSystemState()[0])
        for topic in ('detected_poses', 'detected_poses_keypoints', 'detected_poses_image', 'detected_poses_3d'):
            self.assertEqual(published[f'/{OUTPUT}/{topic}'], ['/skeleton_extract_3d_node'], topic)
        service = '/openpose_ros_service_node'
        self.assertEqual(published.get('/openpose_ros/detected_poses'), [service] if OF_2D_SERVICE else None)

    def test_there_is_one_network(self):
        services = {name for name, _ in rosgraph.Master('/check_chain').getSystemState()[2]}
        detectors = {'/detect_poses', '/detect_poses_3d'} & services
        self.assertEqual(detectors, {'/detect_poses'} if OF_2D_SERVICE else {'/detect_poses_3d'})


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_chain', ChainTest, sys.argv)
