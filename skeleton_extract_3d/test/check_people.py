#!/usr/bin/python3
"""With its default parameters the extractor keeps hidden people and ids; tests/unit/estimator tests the joints."""
import sys
import unittest
from typing import List, NamedTuple, Optional, Sequence

import numpy as np
import rospy
import rostest
import tf2_ros
from harness import (
    FRAME_ID,
    OUTPUT,
    OUTSIDE,
    Camera,
    FakeDetector,
    Output,
    ShippedSequence,
    TruePerson,
    joints_of,
    of_joints,
    person,
    position,
)
from openpose_ros_msgs.msg import (
    PersonDetection,
    PersonDetection_3d,
    PersonDetection_3dArray,
    PersonDetectionArray,
)
from sensor_msgs.msg import CameraInfo

from session import PATIENCE, Recorder, await_true, is_heard
from skeleton_extract_3d.people import INFERRED, MISSING
from skeleton_extract_3d.ros.convert import rotation_and_translation

# Frames in which person 2 hides person 1.
HIDDEN = range(16, 25)
# A person who shows fewer joints is not detected.
LEAST_SHOWN = 3
# Within the pause between two plays [s] tracks end, and people who come back after it are new (return_timeout).
PAUSE = 15.0


class Frame(NamedTuple):
    """A frame of the sequence, the truth about people 1 and 2, and what the extractor says."""

    number: int
    truth: List[TruePerson]
    array: PersonDetection_3dArray

    def near(self, truth: TruePerson) -> PersonDetection_3d:
        """Return the person who is where one truly is: within half a metre, by the median of the joints."""
        distances = [np.nanmedian(np.linalg.norm(joints_of(found) - truth.xyz, axis=1))
                     for found in self.array.persons]
        if not distances or min(distances) > 0.5:
            raise AssertionError(f'person {truth.id} is missing in frame {self.number}: nearest {distances} m')
        return self.array.persons[int(np.argmin(distances))]


class PeopleTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_people')
        cls.sequence, cls.detector = ShippedSequence(), FakeDetector('detect_poses_3d')
        cls.detector.answer = cls.detected
        cls.arrays_2d = Recorder(f'{OUTPUT}/detected_poses', PersonDetectionArray)
        cls.infos = Recorder(f'{OUTPUT}/camera_info', CameraInfo)
        cls.output, cls.camera = Output(), Camera()
        cls.tf_buffer = tf2_ros.Buffer()
        cls.tf_listener = tf2_ros.TransformListener(cls.tf_buffer)
        await_true(lambda: is_heard('/tf'), 'joints as frames')
        cls.last_stamp = rospy.Time.from_sec(rospy.get_time())
        cls.frames = cls.play(range(len(cls.sequence.people)))

    @classmethod
    def detected(cls, number: int) -> List[PersonDetection]:
        """Return the people who show some joints, with the pixels of all; their order and ids mean nothing."""
        found = [person(50 + 2 * number + truth.id, truth.pixels(truth.labels != OUTSIDE))
                 for truth in cls.sequence.people[number] if truth.shown >= LEAST_SHOWN]
        return found[::-1] if number % 2 else found

    @classmethod
    def play(cls, numbers: Sequence[int], frame_id: str = FRAME_ID, begin: Optional[rospy.Time] = None) -> List[Frame]:
        """Send frames of the sequence and return what comes; `begin`: stamp of the first, else after a pause."""
        begin = begin or cls.last_stamp + rospy.Duration(PAUSE)
        played = []
        for number in numbers:
            stamp = begin + rospy.Duration((number - numbers[0]) / cls.sequence.frames.fps)
            cls.camera.send(*cls.sequence.messages(number, stamp, frame_id))
            played.append(Frame(number, cls.sequence.people[number], cls.output.frame(stamp)))
            cls.last_stamp = max(cls.last_stamp, stamp)
        return played

    def people_2d(self, frame: Frame) -> PersonDetectionArray:
        """Return the 2D results of a frame."""
        return self.arrays_2d.wait(1, frame.array.header.stamp)[0]

    def test_a_person_who_is_hidden_altogether_is_still_there(self):
        for frame in self.frames[HIDDEN.start:HIDDEN.stop]:
            found = frame.near(frame.truth[0])
            self.assertEqual(set(of_joints(found, 'status')) - {MISSING}, {INFERRED})
            self.assertEqual(set(of_joints(found, 'confidence')), {0.0})
            self.assertNotIn(found.person_ID, [one.person_ID for one in self.people_2d(frame).persons])

    def test_ids_stay_and_are_those_of_the_2d_results(self):
        ids = [{frame.near(frame.truth[row]).person_ID for frame in self.frames
                if frame.truth[row].shown >= LEAST_SHOWN} for row in range(2)]
        self.assertEqual([len(of_person) for of_person in ids], [1, 1], ids)
        self.assertNotEqual(*ids)
        for frame in self.frames:
            array, sent = self.people_2d(frame), self.detected(frame.number)
            in_space = {found.person_ID: found for found in frame.array.persons}
            self.assertEqual([found.num_people_detected for found in array.persons], [len(sent)] * len(sent))
            for found, one in zip(array.persons, sent):
                self.assertAlmostEqual(found.neck.x, one.neck.x, places=3)
                np.testing.assert_array_equal(of_joints(found, 'confidence'),
                                              of_joints(in_space[found.person_ID], 'confidence'))

    def test_joints_are_frames(self):
        frame = self.frames[-1]
        for found in frame.array.persons:
            for joint, following in (('right_hip', 'right_knee'), ('left_knee', 'left_ankle')):
                transform = self.tf_buffer.lookup_transform(FRAME_ID, f'person_{found.person_ID}/{joint}',
                                                            frame.array.header.stamp, rospy.Duration(PATIENCE))
                rotation, translation = rotation_and_translation(transform)
                np.testing.assert_allclose(translation, position(getattr(found, joint)), atol=1e-6)
                along = position(getattr(found, following)) - translation
                np.testing.assert_allclose(rotation[:, 0], along / np.linalg.norm(along), atol=1e-5)

    def test_ids_are_not_used_again(self):
        """Neither after a pause, nor for another camera, nor when the stamps begin anew."""
        plays = [self.frames, self.play(range(4)), self.play(range(4), frame_id='another_camera'),
                 self.play(range(4), begin=self.last_stamp - rospy.Duration(100))]
        ids = [{found.person_ID for frame in frames for found in frame.array.persons} for frames in plays]
        self.assertEqual([len(of_play) for of_play in ids], [2] * len(plays), ids)
        self.assertEqual(len(set.union(*ids)), 2 * len(plays), ids)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_people', PeopleTest, sys.argv)
