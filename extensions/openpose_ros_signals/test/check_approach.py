#!/usr/bin/python3
"""approach_person.py sends a robot to a place before a person, renews and cancels the goal; move_base is a stand-in."""
import subprocess
import sys
import threading
import unittest
from pathlib import Path

import actionlib
import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from move_base_msgs.msg import MoveBaseAction
from openpose_ros_msgs.msg import PersonGesture, PersonSignalsArray
from std_msgs.msg import Header

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from session import PATIENCE, await_true
from signal_feed import Feed, does, signals, told

ROOT = Path(__file__).resolve().parents[3]
SIGNALS = 'openpose_ros/skeleton_3d/people_signals'
ROBOT = (-1.0, 1.0)  # of base_link in the map [m]
PROGRAMS = {'waves': (), 'ends': (), 'reached': ('_distance:=2.0',), 'nearest': ('_person:=nearest',),
            'aborted': ('_person:=7',)}  # arguments of the programs, by namespace


class StandInMoveBase:
    """Takes goals as move_base does and keeps them; it ends when a test says so."""

    def __init__(self, ns):
        self.goals, self.cancelled = [], 0
        self.server = actionlib.SimpleActionServer(f'{ns}/move_base', MoveBaseAction, auto_start=False)
        self.server.register_goal_callback(self.on_goal)
        self.server.register_preempt_callback(self.on_preempt)
        self.server.start()

    def on_goal(self):
        self.goals.append(self.server.accept_new_goal().target_pose)

    def on_preempt(self):
        if not self.server.is_new_goal_available():
            self.server.set_preempted()
            self.cancelled += 1

    def awaits(self, number, x, y, yaw):
        """Wait for so many goals; the last one is this place of the map."""
        await_true(lambda: len(self.goals) >= number, lambda: f'{number} goals, not {self.goals}')
        assert len(self.goals) == number, self.goals
        assert self.goals[-1].header.frame_id == 'map'
        pose = self.goals[-1].pose
        np.testing.assert_allclose([pose.position.x, pose.position.y, pose.position.z], [x, y, 0.0], atol=1e-3)
        half = np.array([0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)])
        turned = np.array([getattr(pose.orientation, axis) for axis in 'xyzw'])
        assert abs(half @ turned) > 1 - 1e-5, (yaw, turned)


class Robot(threading.Thread):
    """Says in tf where base_link stands in the map."""

    def run(self):
        broadcaster = tf2_ros.TransformBroadcaster()
        while not rospy.core.is_shutdown_requested():
            rospy.rostime.wallsleep(0.05)
            broadcaster.sendTransform(TransformStamped(
                Header(stamp=rospy.Time.now(), frame_id='map'), 'base_link',
                Transform(Vector3(*ROBOT, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))))


def stands(number, x, y, facing=None, *gestures):
    """Return the signals in odom of a person at a place of the map; facing: direction in it [rad], None: hidden."""
    values = {} if facing is None else {
        'body_facing': Vector3(np.sin(facing), -np.cos(facing), 0.0), 'body_facing_sigma': 0.2}
    return does(number, y - 2.0, 1.0 - x, 1.1, *gestures, **values)  # odom is at (1, 2), turned by 90 degrees


class ApproachTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_approach')
        cls.robot = Robot(daemon=True)
        cls.robot.start()
        cls.move_bases = {name: StandInMoveBase(f'/{name}') for name in PROGRAMS}
        cls.children = {name: subprocess.Popen([str(ROOT / 'examples/approach_person.py'), f'__ns:=/{name}', *each])
                        for name, each in PROGRAMS.items()}

    @classmethod
    def tearDownClass(cls):
        for child in cls.children.values():
            child.terminate()
        for child in cls.children.values():
            child.wait(PATIENCE)

    def program(self, name):
        """Return the program of a namespace, its move_base and what publishes its signals."""
        return (self.children[name], self.move_bases[name],
                Feed(f'/{name}/{SIGNALS}', PersonSignalsArray, signals(), 'odom'))

    def test_after_a_wave_the_person_walks_turns_and_is_lost(self):
        _, move_base, feed = self.program('waves')
        wave, other = told(PersonGesture.WAVE), stands(1, 0.0, 1.0, 0.0)
        with feed:
            feed.send(signals(other, stands(2, 4.0, 1.0, np.pi)), frames=10)
            self.assertEqual(move_base.goals, [])  # no person has waved
            feed.send(signals(other, stands(2, 4.0, 1.0, np.pi, wave)))
            move_base.awaits(1, 2.8, 1.0, 0.0)
            for x, y, facing in ((4.1, 1.0, np.pi), (4.0, 1.1, 3.0), (3.9, 1.0, -3.0)):  # waves no more, and sways
                feed.send(signals(other, stands(2, x, y, facing)), frames=12)
            move_base.awaits(1, 2.8, 1.0, 0.0)
            feed.send(signals(other, stands(2, 4.0, 1.5, np.pi)))
            move_base.awaits(2, 2.8, 1.5, 0.0)
            feed.send(signals(other, stands(2, 4.0, 1.5, np.pi / 2)))
            move_base.awaits(3, 4.0, 2.7, -np.pi / 2)
            for step in range(24):  # walks
                feed.send(signals(other, stands(2, 4.0, 1.5 + 0.08 * step, np.pi / 2)))
            # up to 4.54 m; less than 0.3 m are not followed
            await_true(lambda: move_base.goals[-1].pose.position.y > 4.2, lambda: f'no goal follows: {move_base.goals}')
            self.assertLessEqual(len(move_base.goals), 8)  # one a second
            self.assertEqual(move_base.cancelled, 0)
            feed.send(signals(other, does(2)), frames=10)  # hidden for half a second
            self.assertEqual(move_base.cancelled, 0)
            goals = len(move_base.goals)
            feed.send(signals(other))
            await_true(lambda: move_base.cancelled == 1, 'the goal is cancelled')
            feed.send(signals(other, stands(2, 4.0, 1.0, np.pi)), frames=10)  # is back, and did not wave
            self.assertEqual((len(move_base.goals), move_base.cancelled), (goals, 1))

    def test_signals_end(self):
        _, move_base, feed = self.program('ends')
        with feed:
            feed.send(signals(stands(2, 4.0, 1.0, np.pi, told(PersonGesture.WAVE))))
            move_base.awaits(1, 2.8, 1.0, 0.0)
        await_true(lambda: move_base.cancelled == 1, 'the goal is cancelled')

    def test_the_person_is_reached_and_waves_again(self):
        _, move_base, feed = self.program('reached')
        waves = stands(2, 4.0, 1.0, np.pi / 2, told(PersonGesture.WAVE))
        with feed:
            feed.send(signals(waves))
            move_base.awaits(1, 4.0, 3.0, -np.pi / 2)
            move_base.server.set_succeeded()
            feed.send(signals(waves), frames=25)  # still the same wave
            move_base.awaits(1, 4.0, 3.0, -np.pi / 2)
            again = told(PersonGesture.WAVE, since=rospy.Time.now())
            feed.send(signals(stands(2, 4.0, 1.0, np.pi / 2, again)))
            move_base.awaits(2, 4.0, 3.0, -np.pi / 2)
            feed.send(signals(stands(2, 4.0, 1.0, np.pi / 2, again, told(PersonGesture.STOP))), frames=15)
            self.assertEqual((len(move_base.goals), move_base.cancelled), (2, 1))

    def test_the_nearest_person_with_hidden_facing(self):
        child, move_base, feed = self.program('nearest')
        with feed:
            feed.send(signals(stands(1, 6.0, 1.0, np.pi), stands(2, 2.0, 5.0), does(3)))
            towards = np.array(ROBOT) - (2.0, 5.0)
            place = (2.0, 5.0) + 1.2 * towards / np.hypot(*towards)
            move_base.awaits(1, *place, np.arctan2(*-towards[::-1]))
            move_base.server.set_succeeded()
            self.assertEqual(child.wait(PATIENCE), 0)

    def test_where_move_base_gives_up_the_robots_own_side_is_next(self):
        child, move_base, feed = self.program('aborted')
        with feed:
            feed.send(signals(stands(1, 1.0, 1.0, np.pi), stands(7, 4.0, 1.0, -np.pi / 2)))
            move_base.awaits(1, 4.0, -0.2, np.pi / 2)
            move_base.server.set_aborted()
            move_base.awaits(2, 2.8, 1.0, 0.0)
            move_base.server.set_aborted()
            move_base.awaits(3, 4.0, -0.2, np.pi / 2)
            feed.send(signals(stands(7, 4.0, 1.0, -np.pi / 2, told(PersonGesture.STOP))))
            self.assertEqual(child.wait(PATIENCE), 0)
            await_true(lambda: move_base.cancelled == 1, 'the goal is cancelled')
            self.assertEqual(len(move_base.goals), 3)


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_signals', 'check_approach', ApproachTest)
