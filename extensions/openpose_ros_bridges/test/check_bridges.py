#!/usr/bin/python3
"""A person walks: messages of other packages say where; without these packages the nodes end."""
import importlib
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np
import rospy
import rostest
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from std_msgs.msg import Header

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from animated_skeleton import STANDING, held, people_of
from foreign_packages import DEFINITIONS, write_packages
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.skeletons import COCO_18
from session import Diagnostics, Recorder, await_true
from skeleton_extract_3d.ros import convert

RATE = 15.0
INPUT = '/openpose_ros/skeleton_3d'
START = 'roslaunch openpose_ros_bringup people.launch chain:=false'
# To and fro along y, at 1 m/s, for as long as the test takes.
WALK = held(*((4.0 * leg, replace(STANDING, facing=90.0, place=(2.0, (-2.0, 2.0)[leg % 2]))) for leg in range(60)))


class Player(threading.Thread):
    """Sends what a camera sees of a person that walks."""

    def __init__(self):
        super().__init__(name='player', daemon=True)
        self.space = rospy.Publisher(f'{INPUT}/detected_poses_3d', PersonDetection_3dArray, queue_size=5)
        self.image = rospy.Publisher(f'{INPUT}/detected_poses', PersonDetectionArray, queue_size=5)
        self.sends = True

    def run(self):
        rate, random, begin = rospy.Rate(RATE), np.random.RandomState(1), rospy.get_time()
        keypoints = np.full((1, 18, 3), (np.nan, np.nan, 0.0), np.float32)
        keypoints[0, :2] = [[100.0, 50.0, 0.75], [140.0, 250.0, 0.25]]
        while not rospy.is_shutdown():
            now = rospy.get_time()
            header = Header(stamp=rospy.Time.from_sec(now), frame_id='room')
            people = people_of([WALK(now - begin)], [5], random)
            in_image = People2D(COCO_18, keypoints, np.ones(1), people.ids)
            try:
                if self.sends:
                    self.image.publish(convert_2d.people_to_array(in_image, header))
                    self.space.publish(convert.people_to_array(people, header))
                rate.sleep()
            except rospy.ROSException:
                return  # the test has ended


class BridgesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_bridges')
        cls.folder = Path(tempfile.mkdtemp())
        write_packages(cls.folder)
        cls.environment = {**os.environ, 'PYTHONPATH': f"{cls.folder}:{os.environ.get('PYTHONPATH', '')}"}
        sys.path.insert(0, str(cls.folder))
        cls.launched = subprocess.Popen(
            ['roslaunch', str(Path(__file__).with_name('bridges.xml'))], env=cls.environment)
        # without signals: its namespace has none
        cls.alone = [subprocess.Popen(['rosrun', 'openpose_ros_bridges', node, '__ns:=alone'], env=cls.environment)
                     for node in ('people_msgs_node', 'hri_node')]
        cls.player = Player()
        cls.diagnostics = Diagnostics('people_msgs_node', 'spencer_node', 'vision_msgs_node', 'jsk_node')
        cls.people, cls.tracks, cls.images, cls.space, cls.poses_2d, cls.poses, cls.skeletons = (
            Recorder(topic, getattr(importlib.import_module(f'{package}.msg'), name)) for topic, package, name in (
                ('/people', 'people_msgs', 'People'),
                ('/spencer/perception/tracked_persons', 'spencer_tracking_msgs', 'TrackedPersons'),
                (f'{INPUT}/detections_2d', 'vision_msgs', 'Detection2DArray'),
                (f'{INPUT}/detections_3d', 'vision_msgs', 'Detection3DArray'),
                ('/jsk_node/pose_2d', 'jsk_recognition_msgs', 'PeoplePoseArray'),
                ('/jsk_node/pose', 'jsk_recognition_msgs', 'PeoplePoseArray'),
                ('/jsk_node/skeleton', 'jsk_recognition_msgs', 'HumanSkeletonArray')))
        cls.player.start()

    @classmethod
    def tearDownClass(cls):
        for process in (cls.launched, *cls.alone):
            process.terminate()
            process.wait()
        shutil.rmtree(str(cls.folder))

    def test_a_person_walks(self):
        people, tracks = self.people.wait(20)[10:], self.tracks.wait(20)[10:]
        for message, found in ((people[0], people[0].people[0].position),
                               (tracks[0], tracks[0].tracks[0].pose.pose.position)):
            self.assertEqual(message.header.frame_id, 'room')
            np.testing.assert_allclose([found.x, found.z], [2.0, 0.0], atol=0.05)
        self.assertTrue(any(abs(abs(message.people[0].velocity.y) - 1.0) < 0.15 for message in people))
        self.assertIn(('posture', 'standing'), zip(people[-1].people[0].tagnames, people[-1].people[0].tags))
        ages = {message.header.stamp: message.tracks[0].age.to_sec() for message in tracks}
        for stamp, age in ages.items():
            self.assertAlmostEqual(age, (stamp - min(ages)).to_sec() + ages[min(ages)], delta=1e-3)

    def test_one_message_of_each_kind(self):
        center = self.images.wait(1)[0].detections[0].bbox.center
        self.assertEqual((center.x, center.y), (120.0, 150.0))
        self.assertAlmostEqual(self.space.wait(1)[0].detections[0].bbox.center.position.x, 2.0, delta=0.1)
        self.assertEqual(self.poses_2d.wait(1)[0].poses[0].limb_names, ['Nose', 'Neck'])
        self.assertEqual(len(self.poses.wait(1)[0].poses[0].limb_names), 18)
        self.assertIn('Neck->RShoulder', self.skeletons.wait(1)[0].skeletons[0].bone_names)

    def test_missing_signals_are_named(self):
        Recorder('/alone/people', importlib.import_module('people_msgs.msg').People)
        for node in ('/alone/people_msgs_node', '/alone/hri_node'):
            self.diagnostics.await_text(node, f'no message on /alone{INPUT}/people_signals: no node publishes it',
                                        f'to start one: {START} ns:=alone')
        self.assertFalse([text for text in self.diagnostics.texts('people_msgs_node') if START in text])

    def test_the_input_ends(self):
        def last():
            return len(self.people.messages[-1].people), len(self.tracks.messages[-1].tracks)
        self.people.wait(1), self.tracks.wait(1)
        self.player.sends = False
        await_true(lambda: last() == (0, 0), 'lists without people')
        self.assertEqual(self.people.messages[-1].header.frame_id, 'room')
        self.player.sends = True
        await_true(lambda: last() == (1, 1), 'people again')
        self.assertEqual([len(message.people) for message in self.people.messages].count(0), 1)
        self.assertEqual([len(message.tracks) for message in self.tracks.messages].count(0), 1)
        # an image without detections would say that no person was seen in it
        self.assertTrue(all(message.detections for message in self.images.messages))

    def test_nodes_end_where_the_packages_are_missing(self):
        with tempfile.TemporaryDirectory() as folder:
            for package in DEFINITIONS:
                (Path(folder) / package).mkdir()
                (Path(folder) / package / '__init__.py').touch()
            environment = {**os.environ, 'PYTHONPATH': f"{folder}:{os.environ.get('PYTHONPATH', '')}"}
            ended = subprocess.run(['rosrun', 'openpose_ros_bridges', 'vision_msgs_node', '__name:=lone'],
                                   env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   text=True, timeout=60, check=False)
            self.assertEqual(ended.returncode, 1, ended.stdout)
            for text in ('the messages of the package vision_msgs are not found', 'sudo apt install', 'github.com'):
                self.assertIn(text, ended.stdout)
            # costmap_2d needs no messages but those of ROS
            diagnostics = Diagnostics()
            one = subprocess.Popen(['rosrun', 'openpose_ros_bridges', 'obstacles_node'], env=environment,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            diagnostics.await_state('obstacles_node', 'idle: no subscriber')
            one.terminate()
            self.assertIn('no obstacles for teb_local_planner: the messages of the package costmap_converter are not '
                          'found', one.communicate(timeout=60)[0])


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_bridges', 'check_bridges', BridgesTest)
