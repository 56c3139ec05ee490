#!/usr/bin/python3
"""The whole chain on the shipped sequence finds its two people where they truly are, and knows what it does not see."""
import subprocess
import sys
import time
import unittest
from collections import Counter
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np
import rosgraph
import rospy
import rostest
import tf2_ros
from harness import OUTPUT, VISIBLE, Camera, Output, ShippedSequence, TruePerson, joints_of, of_joints, position
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.skeletons import COCO_18
from session import PATIENCE, await_true, is_heard
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.points.rgbd_sequence import WORLD_FRAME, play_order
from skeleton_extract_3d.ros.convert import camera_to_message, cloud_to_message, depth_to_message, transform_from_matrix

OF_2D_SERVICE = '--2d-service' in sys.argv
# At least FRAMES are played, until the sequence has begun again or turned back BEGINNINGS times. Each is sent when the
# people of the one before have come, so that people move from frame to frame by as much on any machine.
FRAMES, BEGINNINGS = 50, 2
# From frame to frame, by their stamps [s].
PERIOD = rospy.Duration(0.1)
# A frame is sent again, under a later stamp, that was lost: no service or camera info was there yet [s].
RESEND = 5.0
CAMERA, FRAME_ID = '/kinect2/qhd/', 'kinect2_rgb_optical_frame'
# Messages of persons that rostopic echo writes: of two frames at least, as there are two or three people.
ECHOED = 6
# Whoever is further than this from every person of the truth, by the median of the joints, is somebody else [m].
SAME_PERSON = 0.5
# Median error of visible joints, and the error from which a position is wrong [m].
MEDIAN_ERROR, WRONG = 0.06, 0.15
# Of the people that show at least half of their joints; of those that show hardly any, after they were seen: these are
# few frames, and the one who is hidden stops, which nobody can know.
LEAST_FOUND, LEAST_FOUND_HIDDEN = 0.9, 0.4
# Whoever was seen in fewer frames is not expected when hidden.
SIGHTINGS = 3
# Frames with somebody hidden that are judged, at least.
LEAST_HIDDEN = 3
# Share of the hidden joints that are said to be measured where they are not.
MOST_LIES = 0.1
MARKER_TYPES = {'joints': Marker.SPHERE_LIST, 'joints_inferred': Marker.SPHERE_LIST,
                'skeleton': Marker.LINE_LIST, 'skeleton_inferred': Marker.LINE_LIST}
if not OF_2D_SERVICE:  # the look of the demo
    MARKER_TYPES['label'] = Marker.TEXT_VIEW_FACING


class Match(NamedTuple):
    """A person of the truth in a frame, and who is nearest to it.

    Attributes:
        round: how often the sequence has begun again or turned back before.
        frame: number in the sequence.
        truth: the person.
        found: id of the nearest person; None: nobody is near.
        status, error: (18,) of that person's joints; error [m] NaN where MISSING.
    """

    round: int
    frame: int
    truth: TruePerson
    found: Optional[int]
    status: np.ndarray
    error: np.ndarray


class ChainTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_chain')
        cls.sequence, cls.output = ShippedSequence(), Output()
        cls.frames: Dict[rospy.Time, int] = {}
        cls.markers: List[Marker] = []
        cls.arrays_2d: List[PersonDetectionArray] = []
        cls.subscribers = [
            rospy.Subscriber(f'{OUTPUT}/visualization_{name}', Marker, cls.markers.append)
            for name in ('markers', 'skeleton')] + [
            rospy.Subscriber(f'{OUTPUT}/detected_poses', PersonDetectionArray, cls.arrays_2d.append)]
        await_true(lambda: all(is_heard(subscriber.name) for subscriber in cls.subscribers), 'markers and 2D results')
        topic = f'/{OUTPUT}/detected_poses_keypoints_3d'
        # the columns as a user's script sees them
        cls.echo = subprocess.Popen(['rostopic', 'echo', '-p', '-n', str(ECHOED), topic], stdout=subprocess.PIPE,
                                    universal_newlines=True)
        cls.addClassCleanup(cls.echo.kill)
        master = rosgraph.Master('/check_chain')
        await_true(lambda: any(name.startswith('/rostopic') for name in dict(master.getSystemState()[1])[topic]),
                   'rostopic echo')
        cls.start_camera()
        for number in play_order(len(cls.sequence.frames), 'loop' if OF_2D_SERVICE else 'forth_and_back'):
            cls.play(number)
            judged = cls.judged()
            if len(judged) >= FRAMES and judged[-1][0] >= BEGINNINGS and len(cls.hidden_matches()) >= LEAST_HIDDEN:
                break

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
    def play(cls, number: int):
        """Send a frame of the sequence, and wait for its people."""
        frame, camera, sent = cls.sequence.frames.frame(number), cls.sequence.frames.camera, []

        def came():
            if not sent or time.monotonic() > sent[-1] + RESEND:
                cls.stamp += PERIOD
                cls.frames[cls.stamp] = number
                header = Header(stamp=cls.stamp, frame_id=FRAME_ID)
                points = (depth_to_message(frame.depth, header) if OF_2D_SERVICE else
                          cloud_to_message(cloud_from_depth(frame.depth * 0.001, camera, frame.bgr), header))
                cls.camera.send(bgr_to_image(frame.bgr, header), points)
                sent.append(time.monotonic())
            return cls.output.has(cls.stamp)

        await_true(came, f'people of frame {number}')

    @classmethod
    def judged(cls) -> List[Tuple[int, int, PersonDetection_3dArray]]:
        """Return the arrays, each with the number of the round and of its frame in the sequence."""
        judged, rounds, before, direction = [], 0, None, 1
        for array in list(cls.output.arrays):
            frame = cls.frames[array.header.stamp]
            step = 0 if before is None else frame - before
            jumps = abs(step) > len(cls.sequence.frames) // 2
            if jumps or step * direction < 0:
                rounds, direction = rounds + 1, direction if jumps else -direction
            before = frame
            judged.append((rounds, frame, array))
        return judged

    @classmethod
    def matches(cls) -> Tuple[List[Match], int]:
        """Return everybody of the truth in all frames, and how many people were seen whom the truth does not know.

        Strangers have MEASURED joints: whoever vanished where the sequence began again is INFERRED for a while.
        """
        matches, strangers = [], 0
        # in the room with the 2D service
        frame_from_points = cls.sequence.frames.T_world_camera if OF_2D_SERVICE else np.eye(4)
        for number, frame, array in cls.judged():
            joints = np.array([joints_of(person) for person in array.persons]).reshape(-1, 18, 3)
            status = np.array([of_joints(person, 'status') for person in array.persons]).reshape(-1, 18)
            near = np.zeros(len(joints), bool)
            for truth in cls.sequence.people[frame]:
                xyz = truth.xyz @ frame_from_points[:3, :3].T + frame_from_points[:3, 3]
                errors = np.linalg.norm(joints - xyz, axis=2)
                typical = np.nanmedian(errors, axis=1)
                near |= typical < SAME_PERSON
                if len(typical) and typical.min() < SAME_PERSON:
                    row = int(typical.argmin())
                    matches.append(Match(number, frame, truth, array.persons[row].person_ID, status[row], errors[row]))
                else:
                    matches.append(Match(number, frame, truth, None, np.full(18, MISSING), np.full(18, np.nan)))
            strangers += (~near & (status == MEASURED).any(axis=1)).sum()
        return matches, strangers

    @classmethod
    def hidden_matches(cls) -> List[Match]:
        """Return the people of the truth who are hidden in a frame and were seen often enough before."""
        seen: Counter = Counter()
        hidden = []
        for match in cls.matches()[0]:
            # whoever turns back has been seen before; where the sequence begins again, people vanish
            since = match.round if OF_2D_SERVICE else 0
            if match.truth.shown >= 9 and match.found is not None:
                seen[since, match.truth.id] += 1
            if match.truth.shown <= 1 and seen[since, match.truth.id] >= SIGHTINGS:
                hidden.append(match)
        return hidden

    def test_people_are_where_they_truly_are(self):
        matches, strangers = self.matches()
        shown = [match for match in matches if match.truth.shown >= 9]
        found = [match for match in shown if match.found is not None]
        errors = np.concatenate([match.error[match.truth.labels == VISIBLE] for match in found])
        errors = errors[np.isfinite(errors)]
        rospy.loginfo('%d frames, %d of %d people, %d strangers, median error %.3f m', len(self.judged()), len(found),
                      len(shown), strangers, np.median(errors))
        self.assertGreaterEqual(len(found), LEAST_FOUND * len(shown))
        self.assertLess(np.median(errors), MEDIAN_ERROR)
        self.assertLessEqual(strangers, 0.05 * len(shown))

    def test_what_is_hidden_is_not_said_to_be_measured(self):
        matches, _ = self.matches()
        status = np.concatenate([match.status[match.truth.hidden] for match in matches])
        error = np.concatenate([match.error[match.truth.hidden] for match in matches])
        lies = (status == MEASURED) & (error > WRONG)
        near = (status != MISSING) & (error <= WRONG)
        rospy.loginfo('%d hidden joints: %.2f within %.2f m, %.2f lies', len(status), near.mean(), WRONG, lies.mean())
        self.assertGreater(len(status), FRAMES)
        self.assertLessEqual(lies.mean(), MOST_LIES)

    def test_somebody_behind_another_one_is_still_there(self):
        hidden = self.hidden_matches()
        missed = [(match.round, match.frame) for match in hidden if match.found is None]
        found = [match for match in hidden if match.found is not None]
        rospy.loginfo('hidden in %d frames, not found in %s', len(hidden), missed)
        self.assertGreaterEqual(len(found), LEAST_FOUND_HIDDEN * len(hidden))
        for match in found:
            self.assertIn(INFERRED, match.status)

    def test_people_keep_their_ids(self):
        for _, _, array in self.judged():
            ids = [person.person_ID for person in array.persons]
            self.assertEqual(len(set(ids)), len(ids))
        # in the next round they appear elsewhere from one frame to the next, and may be others
        ids: Dict[Tuple[int, int], Dict[int, int]] = {}
        for match in self.matches()[0]:
            if match.found is not None:
                ids.setdefault((match.round, match.truth.id), {})[match.frame] = match.found
        for (number, person), by_frame in ids.items():
            self.assertEqual(len(set(by_frame.values())), 1, f'person {person} in round {number}: {by_frame}')
        whose = Counter((number, found) for (number, _), by_frame in ids.items() for found in set(by_frame.values()))
        self.assertEqual(set(whose.values()), {1}, 'two people have two ids')

    def test_messages_say_whose_they_are(self):
        frame_id = WORLD_FRAME if OF_2D_SERVICE else FRAME_ID
        for _, _, array in self.judged():
            self.assertEqual((array.header.frame_id, array.pose_model), (frame_id, 'COCO_18'))
            for person in array.persons:
                self.assertEqual((person.header.stamp, person.header.frame_id), (array.header.stamp, frame_id))
                self.assertEqual(person.num_people_detected, len(array.persons))

    def test_markers_are_the_joints(self):
        arrays = {array.header.stamp: array for array in list(self.output.arrays)}
        checked: Counter = Counter()
        for marker in list(self.markers):
            if marker.action != Marker.ADD or marker.header.stamp not in arrays:
                continue
            person, = (person for person in arrays[marker.header.stamp].persons if person.person_ID == marker.id)
            places = np.array([(point.x, point.y, point.z) for point in marker.points])
            parts = [getattr(person, joint) for joint in COCO_18.joints]
            measured = np.array([position(part) for part in parts if part.status == MEASURED])
            self.assertTrue(np.isfinite(places).all())
            self.assertEqual(marker.type, MARKER_TYPES[marker.ns])
            if marker.ns == 'label':
                self.assertIn(marker.text, (str(marker.id), f'{marker.id} (hidden)'))
            self.assertEqual(marker.header.frame_id, person.header.frame_id)
            self.assertGreaterEqual(marker.lifetime.to_sec(), 0.15)
            if marker.ns == 'joints':
                np.testing.assert_allclose(places, measured, atol=1e-6)
            elif marker.ns == 'joints_inferred':
                inferred = np.array([position(part) for part in parts if part.status == INFERRED])
                np.testing.assert_allclose(places, inferred, atol=1e-6)
            elif marker.ns == 'skeleton':
                self.assertLess(np.abs(places[:, None] - measured).max(axis=2).min(axis=1).max(), 1e-6)
            checked[marker.ns] += 1
        self.assertEqual(set(checked), set(MARKER_TYPES))
        self.assertGreater(min(checked['joints'], checked['skeleton']), FRAMES // 2)

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
        # not of somebody hidden
        self.assertTrue(any(float(row['field.neck.confidence']) > 0 for row in rows))

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
