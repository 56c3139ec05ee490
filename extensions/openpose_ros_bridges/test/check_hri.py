#!/usr/bin/python3
"""Two people are seen, and leave: what hri_node publishes of them, and what hri_rviz makes of it."""
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rosgraph
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import PointStamped, Quaternion, TransformStamped, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from sensor_msgs.msg import CameraInfo, JointState
from std_msgs.msg import Bool, Header, String

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from animated_skeleton import Limb, Pose, joints_of, people_of, without
from foreign_packages import DEFINITIONS, write_packages
from hri_readers import BODIES, RvizSkeletons
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.skeletons import COCO_18
from session import Recorder, await_true
from skeleton_extract_3d.ros import convert

INPUT, PERSONS = '/openpose_ros/skeleton_3d', '/humans/persons'
SIZE = (640, 480)
# One raises the left hand, 1 m to the left of the other one.
RAISED = Limb((0.3, 0.0, 1.0), (-0.1, 0.0, 1.0))
POSES = {5: Pose(left=RAISED, place=(2.0, 1.0), facing=180.0), 6: Pose(place=(2.0, 0.0), facing=180.0),
         7: Pose(place=(2.0, -1.0)), 8: Pose(place=(2.0, -2.0))}
TIMEOUT = 30.0


class Scene:
    """Sends what a camera sees, until it is told that a person leaves, or that it is to be silent."""

    def __init__(self):
        self.ids, self.missing, self.sends = [5, 6], (), True
        self._space, self._image, self._info = (
            rospy.Publisher(f'{INPUT}/{topic}', kind, queue_size=5) for topic, kind in (
                ('detected_poses_3d', PersonDetection_3dArray), ('detected_poses', PersonDetectionArray),
                ('camera_info', CameraInfo)))
        self._timer = rospy.Timer(rospy.Duration(0.1), self._send)

    def _send(self, _event):
        if not self.sends:
            return
        ids = self.ids  # the test changes them
        header = Header(stamp=rospy.Time.now(), frame_id='room')
        everywhere = people_of([POSES[name] for name in ids], ids, np.random.RandomState(0))
        people = without(everywhere, self.missing)
        keypoints = np.full((len(ids), 18, 3), (np.nan, np.nan, 0.0), np.float32)
        keypoints[:, COCO_18.index['left_eye']] = (320, 120, 0.5)
        keypoints[:, COCO_18.index['right_eye']] = (304, 120, 0.75)
        in_image = People2D(COCO_18, keypoints, np.ones(len(ids)), people.ids)
        self._info.publish(CameraInfo(header=header, width=2 * SIZE[0], height=2 * SIZE[1], binning_x=2, binning_y=2))
        self._image.publish(convert_2d.people_to_array(in_image, header))
        self._space.publish(convert.people_to_array(people, header))


def newest(topic, kind):
    return rospy.wait_for_message(topic, kind, timeout=TIMEOUT)


def topics_of(body):
    return [topic for topic, _ in rospy.get_published_topics('/humans') if body in topic]


def models():
    """Return the ids of the bodies whose robot models are on the parameter server."""
    names = rosgraph.Master(rospy.get_name()).getParamNames()
    start = '/human_description_'
    return sorted(name[len(start):] for name in names if name.startswith(start))


def place(name, joint):
    return joints_of(POSES[name])[COCO_18.index[joint]]


def numbers(message):
    return [getattr(message, name) for name in message.__slots__]


class HriTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_hri')
        cls.folder = Path(tempfile.mkdtemp())
        write_packages(cls.folder, {'hri_msgs': DEFINITIONS['hri_msgs']})
        sys.path.insert(0, str(cls.folder))
        cls.frames = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.frames)
        cls.robot = tf2_ros.StaticTransformBroadcaster()
        # 1 m in front of the origin of the room
        transform = TransformStamped(header=Header(frame_id='room'), child_frame_id='base_link')
        transform.transform.translation, transform.transform.rotation = Vector3(x=1.0), Quaternion(w=1.0)
        cls.robot.sendTransform(transform)
        cls.scene = Scene()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(str(cls.folder))

    def setUp(self):
        self.scene.ids, self.scene.missing, self.scene.sends = [5, 6], (), True
        self.node = self.start('hri_node', '_persons:=true')

    def tearDown(self):
        self.stop(self.node)

    def start(self, node, *arguments, package='openpose_ros_bridges'):
        environment = {**os.environ, 'PYTHONPATH': f"{self.folder}:{os.environ.get('PYTHONPATH', '')}"}
        return subprocess.Popen(['rosrun', package, node, *arguments], env=environment)

    @staticmethod
    def stop(node):
        node.send_signal(signal.SIGINT)
        node.wait(TIMEOUT)

    def test_topics_of_bodies_and_persons(self):
        from hri_msgs.msg import BodyPosture, Gesture, IdsList, NormalizedRegionOfInterest2D, Skeleton2D
        signals = self.start('people_signals_node', '_fixed_frame:=room', package='openpose_ros_signals')
        self.addCleanup(self.stop, signals)
        ids = newest(f'{BODIES}/tracked', IdsList)
        self.assertEqual((ids.ids, ids.header.frame_id), (['p5', 'p6'], 'room'))
        region = newest(f'{BODIES}/p5/roi', NormalizedRegionOfInterest2D)
        # two points 16 px apart, and a tenth of that on each side
        np.testing.assert_allclose([region.xmin, region.xmax, region.ymin, region.ymax, region.c],
                                   [302.4 / 640, 321.6 / 640, 118.4 / 480, 121.6 / 480, 0.625], rtol=1e-5)
        left = newest(f'{BODIES}/p5/skeleton2d', Skeleton2D).skeleton[Skeleton2D.LEFT_EYE]
        np.testing.assert_allclose([left.x, left.y, left.c], [0.5, 0.25, 0.5], rtol=1e-6)
        await_true(lambda: newest(f'{BODIES}/p5/posture', BodyPosture).posture == BodyPosture.STANDING, 'stands')
        self.assertEqual(newest(f'{BODIES}/p5/gesture', Gesture).gesture, Gesture.LEFT_HAND_RAISED)
        hips = (place(5, 'left_hip') + place(5, 'right_hip')) / 2
        np.testing.assert_allclose(numbers(newest(f'{BODIES}/p5/position', PointStamped).point), hips, atol=0.02)
        joints = newest(f'{BODIES}/p5/joint_states', JointState)
        angles = dict(zip(joints.name, joints.position))
        # the arm is up: turned by nearly half a turn; the other one hangs
        self.assertGreater(angles['l_p_shoulder_p5'], 2.5)
        self.assertLess(angles['r_p_shoulder_p5'], 0.5)
        self.assertEqual(newest(f'{PERSONS}/tracked', IdsList).ids, ['anonymous_p5', 'anonymous_p6'])
        self.assertTrue(newest(f'{PERSONS}/anonymous_p5/anonymous', Bool).data)
        self.assertEqual(newest(f'{PERSONS}/anonymous_p5/body_id', String).data, 'p5')  # latched: said once, before

    def test_a_body_leaves_and_the_input_ends(self):
        from hri_msgs.msg import IdsList
        lists = [Recorder(topic, IdsList) for topic in (f'{BODIES}/tracked', f'{PERSONS}/tracked', f'{PERSONS}/known')]

        def are_last(*ids):
            return all(one.messages and one.messages[-1].ids == wanted for one, wanted in zip(lists, ids))
        await_true(lambda: topics_of('p5') and models() == ['p5', 'p6'], 'two are there')
        self.scene.ids = [6]
        await_true(lambda: are_last(['p6'], ['anonymous_p6'], ['anonymous_p6']), 'one has left')
        await_true(lambda: not topics_of('p5') and models() == ['p6'], 'topics and model of the one that left end')
        self.assertTrue(topics_of('p6'))
        self.scene.sends = False
        await_true(lambda: are_last([], [], []), 'lists are empty when no people come any more')
        await_true(lambda: not topics_of('p6') and not models(), 'all topics and models of bodies and persons end')
        self.assertTrue(all([message.ids for message in one.messages].count([]) == 1 for one in lists))
        self.assertEqual(lists[0].messages[-1].header.frame_id, 'room')
        self.scene.sends = True
        await_true(lambda: are_last(['p6'], ['anonymous_p6'], ['anonymous_p6']), 'one is there again')
        self.assertEqual(newest(f'{PERSONS}/anonymous_p6/body_id', String).data, 'p6')
        self.assertTrue(newest(f'{BODIES}/p6/joint_states', JointState).name)
        self.assertGreater(len(topics_of('p6')), 6)
        self.assertEqual(models(), ['p6'])
        self.stop(self.node)
        self.assertEqual(models(), [])

    def test_hri_rviz_shows_the_bodies(self):
        from hri_msgs.msg import IdsList
        display = RvizSkeletons(IdsList, self.frames)
        await_true(lambda: set(display.models) == {'p5', 'p6'}, 'bodies are shown')
        await_true(lambda: not display.links_without_frame('base_link'), 'every link has a frame')
        self.assertEqual(len(display.models['p5'].links), 27)
        for name, frame, joint in ((5, 'l_wrist_p5', 'left_wrist'), (6, 'r_knee_p6', 'right_knee')):
            transform = self.frames.lookup_transform('base_link', frame, rospy.Time()).transform
            np.testing.assert_allclose(numbers(transform.translation), place(name, joint) - [1.0, 0.0, 0.0], atol=0.03)
        self.scene.ids = [6]
        await_true(lambda: set(display.models) == {'p6'}, 'one has left')
        # another person, whose arm and head are not seen
        self.scene.missing = 'left_elbow', 'left_wrist', 'nose'
        self.scene.ids = [6, 7]
        await_true(lambda: set(display.models) == {'p6', 'p7'}, 'bodies are shown')
        await_true(lambda: not display.links_without_frame('base_link'), 'every link has a frame')
        self.scene.missing = 'left_hip',
        self.scene.ids = [8]
        await_true(lambda: not display.models, 'without hips no body is shown')
        self.assertEqual(display.faults, [])


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_bridges', 'check_hri', HriTest)
