#!/usr/bin/python3
"""The whole chain on the shipped sequence finds its two people where they truly are, and knows what it does not see."""
import subprocess
import sys
import time
import unittest
from typing import Dict, List, NamedTuple, Optional, Set, Tuple

import numpy as np
import rosgraph
import rospy
import rostest
import tf2_ros
from harness import OUTPUT, VISIBLE, Camera, Output, ShippedSequence, TruePerson, joints_of, of_joints
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.skeletons import COCO_18
from session import PATIENCE, await_true
from skeleton_extract_3d.people import MEASURED, MISSING
from skeleton_extract_3d.points.rgbd_sequence import WORLD_FRAME
from skeleton_extract_3d.ros.convert import camera_to_message, depth_to_message, transform_from_matrix

OF_2D_SERVICE = '--2d-service' in sys.argv
# Numbers of the frames of each round: the sequence begins again, or turns back. Each frame is sent when the people of
# the one before have come, so that people move from frame to frame by as much on any machine.
ROUNDS = (range(40), range(40)) if OF_2D_SERVICE else (range(40), range(38, -1, -1))
# From frame to frame, by their stamps [s].
PERIOD = rospy.Duration(0.1)
# A frame is sent again, under a later stamp, that was lost: no service or camera info was there yet [s].
RESEND = 5.0
CAMERA, FRAME_ID = '/kinect2/qhd/', 'kinect2_rgb_optical_frame'
# Messages of persons that rostopic echo writes: of two frames at least, as there are two or three people.
ECHOED = 6
# A person who is further than this from every person of the truth, by the median of the joints, is a stranger [m].
SAME_PERSON = 0.5
# Median error of visible joints, and the error from which a position is wrong [m].
MEDIAN_ERROR, WRONG = 0.06, 0.15
# Of the people that show at least half of their joints.
LEAST_FOUND = 0.9
# Share of the hidden joints that are said to be measured where they are not.
MOST_LIES = 0.1


class Match(NamedTuple):
    """A person of the truth in a frame, and the one that is nearest.

    Attributes:
        round: of ROUNDS.
        truth: the person.
        found: id of the nearest person; None: no person is near.
        status, error: (18,) of that person's joints; error [m] NaN where MISSING.
    """

    round: int
    truth: TruePerson
    found: Optional[int]
    status: np.ndarray
    error: np.ndarray


class ChainTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_chain')
        cls.sequence, cls.output = ShippedSequence(), Output()
        cls.played: Dict[rospy.Time, Tuple[int, int]] = {}
        """Round and number of each frame, by stamp."""
        topic = f'/{OUTPUT}/detected_poses_keypoints_3d'
        # the columns as a user's script sees them
        cls.echo = subprocess.Popen(['rostopic', 'echo', '-p', '-n', str(ECHOED), topic], stdout=subprocess.PIPE,
                                    universal_newlines=True)
        cls.addClassCleanup(cls.echo.kill)
        master = rosgraph.Master('/check_chain')
        await_true(lambda: any(name.startswith('/rostopic') for name in dict(master.getSystemState()[1])[topic]),
                   'rostopic echo')
        cls.start_camera()
        for each, numbers in enumerate(ROUNDS):
            for number in numbers:
                cls.play(each, number)
        cls.matches, cls.strangers = cls.compared()

    @classmethod
    def start_camera(cls):
        """Advertise the camera's topics, and say where it stands."""
        cls.stamp = rospy.Time.from_sec(rospy.get_time())
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform(transform_from_matrix(cls.sequence.frames.T_world_camera,
                                                            Header(stamp=cls.stamp, frame_id=WORLD_FRAME), FRAME_ID))
        cls.info = rospy.Publisher(f'{CAMERA}camera_info', CameraInfo, queue_size=1, latch=True)
        cls.info.publish(camera_to_message(cls.sequence.frames.camera, Header(stamp=cls.stamp, frame_id=FRAME_ID)))
        points = ('image_depth_rect', Image) if OF_2D_SERVICE else ('points', PointCloud2)
        cls.camera = Camera(f'{CAMERA}image_color', CAMERA + points[0], points_type=points[1])

    @classmethod
    def play(cls, of_round: int, number: int):
        """Send a frame of the sequence, and wait for its people."""
        sent = []

        def came():
            if not sent or time.monotonic() > sent[-1] + RESEND:
                cls.stamp += PERIOD
                cls.played[cls.stamp] = of_round, number
                image, points = cls.sequence.messages(number, cls.stamp, FRAME_ID)
                if OF_2D_SERVICE:
                    points = depth_to_message(cls.sequence.frames.frame(number).depth, image.header)
                cls.camera.send(image, points)
                sent.append(time.monotonic())
            return cls.output.has(cls.stamp)

        await_true(came, f'people of frame {number}')

    @classmethod
    def compared(cls) -> Tuple[List[Match], int]:
        """Return each person of the truth in all frames, and the number of people that the truth does not have.

        Strangers have MEASURED joints: a person who vanished where the sequence began again is INFERRED for a while.
        """
        matches, strangers = [], 0
        # in the room with the 2D service
        frame_from_points = cls.sequence.frames.T_world_camera if OF_2D_SERVICE else np.eye(4)
        for array in cls.output.arrays:
            of_round, number = cls.played[array.header.stamp]
            joints = np.array([joints_of(person) for person in array.persons]).reshape(-1, 18, 3)
            status = np.array([of_joints(person, 'status') for person in array.persons]).reshape(-1, 18)
            near = np.zeros(len(joints), bool)
            for truth in cls.sequence.people[number]:
                xyz = truth.xyz @ frame_from_points[:3, :3].T + frame_from_points[:3, 3]
                errors = np.linalg.norm(joints - xyz, axis=2)
                typical = np.nanmedian(errors, axis=1)
                near |= typical < SAME_PERSON
                if len(typical) and typical.min() < SAME_PERSON:
                    row = int(typical.argmin())
                    matches.append(Match(of_round, truth, array.persons[row].person_ID, status[row], errors[row]))
                else:
                    matches.append(Match(of_round, truth, None, np.full(18, MISSING), np.full(18, np.nan)))
            strangers += (~near & (status == MEASURED).any(axis=1)).sum()
        return matches, strangers

    def test_people_are_where_they_truly_are(self):
        shown = [match for match in self.matches if match.truth.shown >= 9]
        found = [match for match in shown if match.found is not None]
        errors = np.concatenate([match.error[match.truth.labels == VISIBLE] for match in found])
        errors = errors[np.isfinite(errors)]
        rospy.loginfo('%d frames, %d of %d people, %d strangers, median error %.3f m', len(self.output.arrays),
                      len(found), len(shown), self.strangers, np.median(errors))
        self.assertGreaterEqual(len(found), LEAST_FOUND * len(shown))
        self.assertLess(np.median(errors), MEDIAN_ERROR)
        self.assertLessEqual(self.strangers, 0.05 * len(shown))

    def test_what_is_hidden_is_not_said_to_be_measured(self):
        status = np.concatenate([match.status[match.truth.hidden] for match in self.matches])
        error = np.concatenate([match.error[match.truth.hidden] for match in self.matches])
        lies = (status == MEASURED) & (error > WRONG)
        near = (status != MISSING) & (error <= WRONG)
        rospy.loginfo('%d hidden joints: %.2f within %.2f m, %.2f lies', len(status), near.mean(), WRONG, lies.mean())
        self.assertGreater(len(status), len(self.output.arrays))
        self.assertLessEqual(lies.mean(), MOST_LIES)

    def test_people_keep_their_ids(self):
        for array in self.output.arrays:
            ids = [person.person_ID for person in array.persons]
            self.assertEqual(len(set(ids)), len(ids))
        # in the next round they appear elsewhere from one frame to the next, and may be others
        ids_of: Dict[Tuple[int, int], Set[int]] = {}
        for match in self.matches:
            if match.found is not None:
                ids_of.setdefault((match.round, match.truth.id), set()).add(match.found)
        self.assertEqual({len(ids) for ids in ids_of.values()}, {1}, ids_of)
        each = {(of_round, *ids) for (of_round, _), ids in ids_of.items()}
        self.assertEqual(len(each), len(ids_of), 'two people have two ids')

    def test_rostopic_echo_has_the_columns_of_the_original(self):
        header, *rows = (line.split(',') for line in self.echo.communicate(timeout=PATIENCE)[0].splitlines())
        parts = (*COCO_18.joints, 'chest')
        original = ['%time', 'field.num_people_detected', 'field.person_ID'] + [
            f'field.{part}.{name}' for part in parts for name in ('x', 'y', 'z', 'confidence')]
        self.assertEqual([column for column in header if column in original], original)
        self.assertEqual(header[1:4], ['field.header.seq', 'field.header.stamp', 'field.header.frame_id'])
        self.assertLess(header.index('field.header.frame_id'), header.index('field.num_people_detected'))
        self.assertEqual([len(row) for row in rows], [len(header)] * ECHOED)
        rows = [dict(zip(header, row)) for row in rows]
        for row in rows:
            self.assertEqual(row['%time'], row['field.header.stamp'])
            self.assertTrue(0 <= float(row['field.neck.confidence']) <= 1)
            self.assertEqual((row['field.chest.x'], row['field.chest.confidence']), ('nan', '0.0'))
        # not of a hidden person alone
        self.assertTrue(any(float(row['field.neck.confidence']) > 0 for row in rows))

    def test_what_is_published_has_one_publisher_and_there_is_one_network(self):
        published, _, services = (dict(each) for each in rosgraph.Master('/check_chain').getSystemState())
        for topic in ('detected_poses', 'detected_poses_keypoints', 'detected_poses_image', 'detected_poses_3d'):
            self.assertEqual(published[f'/{OUTPUT}/{topic}'], ['/skeleton_extract_3d_node'], topic)
        service = '/openpose_ros_service_node'
        self.assertEqual(published.get('/openpose_ros/detected_poses'), [service] if OF_2D_SERVICE else None)
        detectors = {'/detect_poses', '/detect_poses_3d'} & set(services)
        self.assertEqual(detectors, {'/detect_poses'} if OF_2D_SERVICE else {'/detect_poses_3d'})


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_chain', ChainTest, sys.argv)
