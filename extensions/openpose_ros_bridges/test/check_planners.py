#!/usr/bin/python3
"""People walk and leave: what planners know of them at any time.

None of the planners is installed everywhere. MoveIt and costmap_2d are re-enacted by `planner_readers`; the messages of
moveit_msgs and costmap_converter, with those they need, are written by `foreign_packages`.
"""
import importlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from animated_skeleton import STANDING, Limb, held, joints_of, people_of
from foreign_packages import write_packages
from openpose_ros_pkg.skeletons import COCO_18
from planner_readers import ObstacleLayer, PlanningScene
from session import Diagnostics, Recorder, await_true
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.convert import rotation_and_translation

RATE = 15.0
TIMEOUT = 30.0
# To and fro along y of the room, at 1 m/s; and standing, with an arm out.
WALK = held(*((4.0 * leg, replace(STANDING, facing=90.0, place=(2.0, (-2.0, 2.0)[leg % 2]))) for leg in range(60)))
STANDS = replace(STANDING, place=(3.5, 0.0), left=Limb((0.0, 1.0, 0.0), (0.0, 1.0, 0.0)))
QUARTER = np.sqrt(0.5)


class Room:
    """Sends the people that a camera sees, until it is told to be silent."""

    def __init__(self):
        self.ids, self.sends = (5, 6), True
        self.begin = rospy.get_time()
        self._random = np.random.RandomState(1)
        self._people = rospy.Publisher('/openpose_ros/skeleton_3d/detected_poses_3d', PersonDetection_3dArray,
                                       queue_size=5)
        self._timer = rospy.Timer(rospy.Duration(1 / RATE), self._send)

    def poses(self, stamp):
        return {5: WALK(stamp - self.begin), 6: STANDS}

    def _send(self, _event):
        if self.sends:
            now, ids = rospy.get_time(), self.ids
            poses = self.poses(now)
            people = people_of([poses[name] for name in ids], ids, self._random)
            with suppress(rospy.ROSException):  # the test has ended
                self._people.publish(convert.people_to_array(people, Header(stamp=rospy.Time.from_sec(now),
                                                                            frame_id='room')))


def transform(parent, child, place, turn=(0.0, 0.0, 0.0, 1.0)):
    told = TransformStamped(header=Header(frame_id=parent), child_frame_id=child)
    told.transform.translation, told.transform.rotation = Vector3(*place), Quaternion(*turn)
    return told


class PlannersTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_planners')
        cls.folder = Path(tempfile.mkdtemp())
        write_packages(cls.folder)
        sys.path.insert(0, str(cls.folder))
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        elbow, wrist = (joints_of(STANDS)[COCO_18.index[f'left_{joint}']] for joint in ('elbow', 'wrist'))
        cls.broadcaster.sendTransform([
            transform('world', 'odom', (0.0, 0.0, 0.5)), transform('odom', 'base_link', (0.5, 0.0, 0.0)),
            # the room is turned: its y is -x of odom
            transform('odom', 'room', (0.5, 0.0, 0.0), (0.0, 0.0, QUARTER, QUARTER)),
            transform('room', 'elbow', elbow), transform('room', 'wrist', wrist + 0.5 * (wrist - elbow))])
        cls.frames = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.frames)
        cls.kind = importlib.import_module('moveit_msgs.msg').PlanningScene
        cls.room = Room()
        cls.signals = cls.start('people_signals_node', '_fixed_frame:=odom', package='openpose_ros_signals')

    @classmethod
    def tearDownClass(cls):
        cls.stop(cls.signals)
        shutil.rmtree(str(cls.folder))

    def setUp(self):
        self.room.ids, self.room.sends = (5, 6), True

    @classmethod
    def start(cls, node, *arguments, package='openpose_ros_bridges'):
        environment = {**os.environ, 'PYTHONPATH': f"{cls.folder}:{os.environ.get('PYTHONPATH', '')}"}
        return subprocess.Popen(['rosrun', package, node, *arguments], env=environment)

    @staticmethod
    def stop(node):
        node.send_signal(signal.SIGINT)
        node.wait(TIMEOUT)

    def test_a_scene_has_the_people_that_are_there(self):
        diagnostics = Diagnostics()
        node = self.start('moveit_node', '_planning_frame:=world', '_robot_links:=elbow>wrist:0.1 nowhere:1')
        self.addCleanup(self.stop, node)
        diagnostics.await_state('/moveit_node', 'idle: no subscriber')
        markers = Recorder('/moveit_node/markers', MarkerArray)
        await_true(lambda: markers.messages and len(markers.messages[-1].markers) == 1 + 3 * (2 * 17 - 2), 'markers')
        markers.close()
        self.assertEqual(markers.messages[-1].markers[-1].header.frame_id, 'world')
        scene = PlanningScene('/planning_scene', self.kind, 'world')
        self.addCleanup(scene.close)
        await_true(lambda: scene.people() == ['person_5', 'person_6'], 'both')
        await_true(lambda: scene.operations[0] > 200, 'they move')
        # the forearm and the hand of one are those of the robot
        self.assertEqual({f'person_{number}_left_{part}' for number in (5, 6) for part in ('forearm', 'hand')}
                         & set(scene.names), {'person_5_left_forearm', 'person_5_left_hand'})
        turn, move = rotation_and_translation(self.frames.lookup_transform('world', 'room', rospy.Time()))
        compared = set()

        def holds_joints():
            """Tell whether ten scenes had all joints of their stamps within people; one without them fails."""
            stamp, _ = scene.distances(np.zeros((1, 3)))
            joints = joints_of(self.room.poses(stamp.to_sec())[5]) @ turn.T + move
            then, distances = scene.distances(joints)
            if then == stamp:
                self.assertLess(distances.max(), 0.0)
                compared.add(stamp)
            return len(compared) >= 10
        await_true(holds_joints, lambda: f'ten scenes compared; {len(compared)} were')
        self.room.ids = (5,)
        await_true(lambda: scene.people() == ['person_5'], 'one has left')
        self.room.sends = False
        await_true(lambda: scene.names == [], 'no people come any more')
        self.room.sends = True
        await_true(lambda: scene.people() == ['person_5'], 'one is there again')
        self.stop(node)
        await_true(lambda: scene.names == [], 'the node has ended')
        self.assertEqual(scene.faults, [])
        self.assertFalse(scene.touched)

    def test_obstacles_move_and_a_costmap_is_cleared_behind_them(self):
        kind = importlib.import_module('costmap_converter.msg').ObstacleArrayMsg
        arrays = Recorder('/obstacles_node/obstacles', kind, connect=False)
        layer = ObstacleLayer('/obstacles_node/footprints', '/obstacles_node/clearing', 'odom', self.frames)
        node = self.start('obstacles_node')
        self.addCleanup(self.stop, node)
        self.room.ids = (5,)
        message = await_true(lambda: next((each for each in arrays.messages[::-1] if each.obstacles and abs(
            each.obstacles[0].velocities.twist.linear.x) > 0.9), None), 'a person that walks')
        self.assertEqual(message.header.frame_id, 'odom')
        (told,) = message.obstacles
        self.assertEqual(told.id, 5)
        # place and velocity in odom, which is turned against the room
        y = self.room.poses(message.header.stamp.to_sec())[5].place[1]
        (point,) = told.polygon.points
        np.testing.assert_allclose([point.x, point.y, point.z], [0.5 - y, 2.0, 0.0], atol=0.1)
        np.testing.assert_allclose(told.velocities.twist.linear.y, 0.0, atol=0.15)
        self.assertTrue(0.3 < told.radius < 0.7)
        await_true(lambda: layer.cloud is not None and layer.scan is not None, 'inputs of a costmap')
        marked = set()

        def is_cleared():
            """Tell whether half of what was marked once is free again, and the way ahead of the person is marked."""
            now = layer.update()
            marked.update(map(tuple, now))
            return len(marked) > 2 * len(now) and self.is_ahead(now, layer.cloud.header.stamp.to_sec()).any()
        await_true(is_cleared, lambda: f'{len(marked)} cells of which {len(layer.update())} are still obstacles')
        self.room.sends = False
        await_true(lambda: arrays.messages[-1].obstacles == [], 'no obstacle without input')
        await_true(lambda: len(layer.update()) == 0, 'a free costmap')
        self.room.sends = True
        await_true(lambda: len(layer.update()) > 0, 'people again')
        self.stop(node)
        await_true(lambda: arrays.messages[-1].obstacles == [] and len(layer.update()) == 0, 'none after the node')

    def is_ahead(self, places, stamp):
        """Return which obstacles are in front of the person, by more than the body and less than two seconds."""
        now, soon = (self.room.poses(time)[5].place[1] for time in (stamp, stamp + 0.1))
        way = (places[:, 0] - (0.5 - now)) * -np.sign(soon - now)
        return (way > 1.2) & (way < 2.0) & (np.abs(places[:, 1] - 2.0) < 0.2)


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_bridges', 'check_planners', PlannersTest)
