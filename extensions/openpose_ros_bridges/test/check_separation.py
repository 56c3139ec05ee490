#!/usr/bin/python3
"""A person stands before a robot: how near, and what is told when people, transforms or the clock do not come."""
import math
import sys
import threading
import time
import unittest
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonSeparation
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from animated_skeleton import STANDING, people_of
from openpose_ros_bridges.separation import CONSTANTS
from session import Diagnostics, Recorder, await_true
from skeleton_extract_3d.points.transform import transform_people
from skeleton_extract_3d.ros import convert

INPUT = '/openpose_ros/skeleton_3d'
STEP = 0.05
# The camera looks along x of the room, 1 m above the floor; the person stands 4 m before it, the gripper 1.5 m.
POSE = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]])
PLACE, GRIPPER = 4.0, 1.5


def at(x, z):
    pose = np.eye(4)
    pose[:3, 3] = x, 0.0, z
    return pose


class World(threading.Thread):
    """Sends clock, transforms and people, in simulated time, as long as it is told to."""

    def __init__(self):
        super().__init__(name='world', daemon=True)
        self.clock = rospy.Publisher('/clock', Clock, queue_size=1)
        self.people = rospy.Publisher(f'{INPUT}/detected_poses_3d', PersonDetection_3dArray, queue_size=5)
        self.broadcaster, static = tf2_ros.TransformBroadcaster(), tf2_ros.StaticTransformBroadcaster()
        static.sendTransform([self.transform(POSE, 'camera', 0.0), self.transform(at(-2.0, 0.5), 'base', 0.0)])
        self._static = static
        self.now = 1000.0
        self.on = {'clock': True, 'people': False, 'tf': True}

    @staticmethod
    def transform(pose, child, now):
        return convert.transform_from_matrix(pose, Header(stamp=rospy.Time.from_sec(now), frame_id='room'), child)

    def run(self):
        random, rotation = np.random.RandomState(1), POSE[:3, :3]
        while not rospy.is_shutdown():
            time.sleep(STEP)
            self.now += STEP * self.on['clock']
            header = Header(stamp=rospy.Time.from_sec(self.now), frame_id='camera')
            people = people_of([replace(STANDING, place=(PLACE, 0.0))], [5], random)
            people = transform_people(people, rotation.T, -rotation.T @ POSE[:3, 3])
            try:
                self.clock.publish(Clock(header.stamp))
                if self.on['tf'] and self.on['clock']:
                    self.broadcaster.sendTransform(self.transform(at(GRIPPER, 1.2), 'gripper', self.now))
                if self.on['people'] and self.on['clock']:
                    self.people.publish(convert.people_to_array(people, header))
            except rospy.ROSException:
                return  # the test has ended


class SeparationTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.world = None
        # the clock has to run before a node can begin
        rospy.init_node('check_separation')
        cls.world = World()
        cls.world.start()
        cls.diagnostics = Diagnostics('separation_node')
        cls.found = Recorder(f'{INPUT}/person_separation', PersonSeparation)

    def setUp(self):
        self.world.on.update(clock=True, people=True, tf=True)
        if self.id().rpartition('.')[2] != 'test_0_before_the_first_frame_nothing_is_known':
            self.await_bound(lambda message: message.bound > 0, 'a bound')
        else:
            self.world.on['people'] = False

    def await_bound(self, condition, what):
        """Return the first message from now on of which a condition holds."""
        begin = len(self.found.messages)
        return await_true(lambda: next(filter(condition, self.found.messages[begin:]), None),
                          lambda: f'{what}; newest: {self.found.messages[-1:]}', 20)

    @contextmanager
    def without(self, part):
        self.world.on[part] = False
        yield
        self.world.on[part] = True
        self.await_bound(lambda message: message.bound > 0, 'a bound again')

    def test_0_before_the_first_frame_nothing_is_known(self):
        message = self.found.wait(3)[-1]
        self.assertEqual((message.bound, message.people, message.person_ID), (0.0, 0, 0))
        self.assertTrue(math.isnan(message.distance) and math.isnan(message.age))
        self.assertIn('no people message', message.reason)

    def test_a_person_stands_before_the_gripper(self):
        message = self.await_bound(lambda message: message.bound > 0, 'a bound')
        self.assertEqual(message.header.frame_id, 'room')
        self.assertEqual((message.link, message.person_ID, message.people, message.reason), ('gripper', 5, 1, ''))
        self.assertAlmostEqual(message.distance, PLACE - GRIPPER - 0.1 - 0.15, delta=0.15)
        self.assertLess(message.bound, message.distance)
        self.assertGreater(message.bound, message.distance - 0.6)
        self.assertAlmostEqual(message.probability, 0.99, places=6)
        self.assertLess(message.age, 0.5)
        stamps = [message.header.stamp.to_sec() for message in self.found.messages]
        self.assertEqual(stamps, sorted(stamps))

    def test_the_camera_is_off(self):
        self.world.on['people'] = False
        off = self.world.now
        unknown = self.await_bound(lambda message: math.isnan(message.distance), 'no distance')
        self.assertLess(unknown.header.stamp.to_sec() - off, CONSTANTS.data_timeout + 0.5)
        self.assertIn('old', unknown.reason)
        begin = len(self.found.messages)
        self.found.wait(begin + 10)
        self.assertEqual({message.bound for message in self.found.messages[begin:begin + 10]}, {0.0})
        self.diagnostics.await_text('separation_node', 'the newest people are')

    def test_transforms_or_the_clock_do_not_come(self):
        for part, reason in (('tf', 'gripper'), ('clock', 'clock')):
            with self.without(part):
                zero = self.await_bound(lambda message: message.bound == 0, 'the bound 0')
                self.assertIn(reason, zero.reason)
                self.assertTrue(math.isnan(zero.distance))

    def test_a_recording_begins_again(self):
        self.world.now -= 30.0
        again = self.await_bound(lambda message: message.bound > 0 and abs(
            message.header.stamp.to_sec() - self.world.now) < 1, 'a bound after the jump')
        self.assertEqual((again.person_ID, again.people), (5, 1))


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_bridges', 'check_separation', SeparationTest)
