#!/usr/bin/python3
"""People, signals, images and states come to a page as the topics have them; without a page nothing is read."""
import socket
import subprocess
import sys
import threading
import unittest
from pathlib import Path

import cv2
import numpy as np
import rosgraph
import rospy
import rostest
from geometry_msgs.msg import Point, Quaternion, Transform, TransformStamped, Vector3
from openpose_ros_msgs.msg import (
    HandDetection_3dArray,
    PersonDetection_3dArray,
    PersonSignals,
    PersonSignalsArray,
)
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header
from tf2_ros import StaticTransformBroadcaster

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.skeletons import COCO_18
from page_client import PageClient
from session import await_true
from skeleton_extract_3d.landmarks import Hands3D, Points3D
from skeleton_extract_3d.people import INFERRED, MEASURED, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.ros import convert

SPACE = '/openpose_ros/skeleton_3d'
PORT = 18080
CAMERA = CameraModel(64, 48, np.array([[60.0, 0, 31.5], [0, 60.0, 23.5], [0, 0, 1]]))
FRAME = 'camera_rgb_optical_frame'


def people():
    """Return a person with its joints 2 m before the camera, the last one INFERRED and moving, one of them MISSING."""
    xyz = np.array([[[0.1 * (joint % 5 - 2), 0.1 * (joint // 5 - 1), 2.0] for joint in range(18)]])
    status, velocity = np.full((1, 18), MEASURED), np.full((1, 18, 3), (0.0, 0.0, -1.0))
    xyz[0, 3], status[0, 3], status[0, 17] = np.nan, 0, INFERRED
    velocity[0, 3] = np.nan
    sigma = np.where(status > 0, 0.03, np.nan)
    return People3D(COCO_18, xyz, (status == MEASURED) * 0.9, status, sigma, np.array([7]), velocity)


class Camera(threading.Thread):
    """Publishes a frame after the other, to those who listen."""

    def __init__(self):
        super().__init__(name='camera', daemon=True)
        self.topics = {'people': ('detected_poses_3d', PersonDetection_3dArray),
                       'signals': ('people_signals', PersonSignalsArray),
                       'hands': ('detected_hands_3d', HandDetection_3dArray), 'info': ('camera_info', CameraInfo),
                       'image': ('detected_poses_image', Image)}
        self.publishers = {name: rospy.Publisher(f'{SPACE}/{topic}', kind, queue_size=2)
                           for name, (topic, kind) in self.topics.items()}
        self.image = np.full((48, 64, 3), (200, 100, 50), np.uint8)

    def listeners(self):
        return {name for name, publisher in self.publishers.items() if publisher.get_num_connections()}

    def run(self):
        rate = rospy.Rate(15)
        points = Points3D(np.full((1, 21, 3), 2.0), np.ones((1, 21)), np.full((1, 21), MEASURED), np.ones((1, 21)))
        hands = Hands3D(points, np.ones(1), np.array([7]), np.array([True]))
        while not rospy.is_shutdown():
            header = Header(stamp=rospy.get_rostime(), frame_id=FRAME)
            signals = PersonSignals(header=header, person_ID=7, position=Point(0, 0, 2), posture='standing')
            frame = {'people': convert.people_to_array(people(), header),
                     'signals': PersonSignalsArray(header=header, persons=[signals]),
                     'hands': convert.hands_to_array(hands, header), 'info': convert.camera_to_message(CAMERA, header),
                     'image': bgr_to_image(self.image, header)}
            for name, publisher in self.publishers.items():
                publisher.publish(frame[name])
            rate.sleep()


class WebTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_web')
        cls.node = cls.start()
        cls.camera = Camera()
        cls.camera.start()

    @classmethod
    def start(cls):
        return subprocess.Popen(['rosrun', 'openpose_ros_web', 'people_web_node', f'_port:={PORT}'])

    @classmethod
    def tearDownClass(cls):
        cls.node.terminate()
        cls.node.wait()

    def open(self, **want):
        await_true(self.is_served, 'the server')
        page = PageClient(PORT, want or None)
        self.addCleanup(page.close)
        return page

    def is_served(self):
        with socket.socket() as probe:
            return probe.connect_ex(('localhost', PORT)) == 0

    def test_1_nothing_is_read_without_a_page(self):
        await_true(self.is_served, 'the server')
        self.assertEqual(self.camera.listeners(), set())
        subscribed = [topic for topic, nodes in rosgraph.Master('/check_web').getSystemState()[1]
                      if '/people_web_node' in nodes]
        self.assertLessEqual(set(subscribed), {'/clock'})
        page = self.open()
        await_true(lambda: self.camera.listeners() == {'people', 'signals', 'hands', 'info'}, 'a page reads')
        page.send('{"want": {"image": {"width": 320}}}')
        await_true(lambda: self.camera.listeners() == set(self.camera.topics), 'images are read')
        page.send('{"want": {}}')
        await_true(lambda: 'image' not in self.camera.listeners(), 'these are not read any more')
        page.close()
        await_true(lambda: not self.camera.listeners(), 'nothing is read')

    def test_2_an_optical_frame_is_turned_upright(self):
        page = self.open()
        hello = page.wait('hello')
        self.assertEqual((hello['version'], hello['cameras']), (1, ['camera']))
        message = page.wait('people')
        self.assertEqual((message['frame'], message['skeleton']), (f'{FRAME}_upright', 'COCO_18'))
        (person,) = message['people']
        truth = people()
        self.assertEqual((person['id'], person['status']), (7, truth.status[0].tolist()))
        known = truth.status[0] > 0
        upright = truth.xyz[0][:, [2, 0, 1]] * (1, -1, -1)
        found = np.array(person['xyz']).reshape(-1, 3)
        np.testing.assert_array_equal(found[known], np.rint(1000 * upright[known]))
        np.testing.assert_array_equal(found[~known], 0)
        self.assertTrue(0 <= message['age'] < 5)
        self.assertAlmostEqual(message['time'], message['stamp'] + message['age'], delta=0.01)

    def test_3_signals_hands_and_cameras(self):
        page = self.open()
        (person,) = page.wait('signals')['people']
        self.assertEqual((person['id'], person['posture']), (7, 'standing'))
        (hand,) = page.wait('hands')['hands']
        self.assertEqual((hand['id'], hand['side'], len(hand['xyz'])), (7, 'left', 63))
        (camera,) = page.wait('cameras', lambda message: message['cameras'])['cameras']
        self.assertEqual((camera['size'], camera['K']), ([64, 48], [60.0, 60.0, 31.5, 23.5]))
        self.assertEqual(camera['position'], [0, 0, 0])
        nodes = page.wait('state', lambda state: state['rate'] > 5)['nodes']
        self.assertIn('people_web_node', [node['name'] for node in nodes])

    def test_4_images(self):
        page = self.open(image={'width': 320, 'rate': 5})
        image = await_true(lambda: page.binary(1), 'an image')[0]
        bgr = cv2.imdecode(np.frombuffer(image[16:], np.uint8), cv2.IMREAD_COLOR)
        self.assertEqual(bgr.shape, (48, 64, 3))
        np.testing.assert_allclose(bgr, self.camera.image, atol=5)

    def test_5_world_is_shown_where_tf_knows_it(self):
        page = self.open()
        page.wait('people')
        broadcaster = StaticTransformBroadcaster()
        turn = Quaternion(-0.5, 0.5, -0.5, 0.5)  # optical axes in a level camera's
        broadcaster.sendTransform(TransformStamped(Header(frame_id='world'), FRAME,
                                                   Transform(Vector3(1, 0, 1.5), turn)))
        message = page.wait('people', lambda each: each['frame'] == 'world')
        np.testing.assert_allclose(message['people'][0]['xyz'][:3], (3000, 200, 1600), atol=1)
        (camera,) = page.wait('cameras', lambda each: each['frame'] == 'world')['cameras']
        self.assertEqual(camera['position'], [1000, 0, 1500])
        np.testing.assert_allclose(camera['rotation'], (0, 0, 1, -1, 0, 0, 0, -1, 0), atol=1e-6)
        later = self.open()
        self.assertEqual(later.wait('cameras')['frame'], 'world')


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_web', 'check_web', WebTest, sys.argv)
