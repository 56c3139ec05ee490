#!/usr/bin/python3
"""Mistakes are planted one by one in a stand-in of a RealSense: the doctor names the check and the line to type."""
import os
import re
import socket
import subprocess
import sys
import threading
import time
import unittest
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rosgraph
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Quaternion, TransformStamped
from openpose_ros_msgs.msg import PersonDetection_3dArray
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[3] / 'skeleton_extract_3d/test'))
from harness import FakeDetector

from openpose_ros_pkg.ros.convert import pixels_to_image
from session import Diagnostics, await_true
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.ros.convert import camera_to_message

IMAGE = '/camera/color/image_raw'
DEPTH, INFO = '/camera/aligned_depth_to_color/image_raw', '/camera/aligned_depth_to_color/camera_info'
RAW_DEPTH, COLOUR_INFO = '/camera/depth/image_rect_raw', '/camera/color/camera_info'
OPTICAL, RATE = 'camera_color_optical_frame', 20.0
COLOUR = CameraModel(160, 120, np.array([[140, 0, 79.5], [0, 140, 59.5], [0, 0, 1]]))
V, U = np.mgrid[:120, :160]
METRES = (2 + 0.004 * U + 0.3 * np.sin(V / 20)).astype(np.float32)
BGR = np.full((120, 160, 3), 90, np.uint8)


def header(stamp, frame=OPTICAL):
    return Header(stamp=stamp, frame_id=frame)


def image(stamp):
    return pixels_to_image(BGR, 'bgr8', header(stamp))


def depth(stamp, frame=OPTICAL):
    return pixels_to_image((1000 * METRES).astype(np.uint16), '16UC1', header(stamp, frame))


def info(stamp):
    return camera_to_message(COLOUR, header(stamp))


# What a driver publishes that is started as the preset says.
GOOD = {IMAGE: (Image, image), DEPTH: (Image, depth), INFO: (CameraInfo, info), COLOUR_INFO: (CameraInfo, info)}


@contextmanager
def camera(topics, rate=RATE):
    """Publish what the topics hold: a type and what makes a message of its stamp."""
    publishers = {topic: rospy.Publisher(topic, kind, queue_size=2) for topic, (kind, _) in topics.items()}
    ended = threading.Event()

    def publish():
        while not ended.wait(1 / rate):
            stamp = rospy.Time.from_sec(time.time())
            for topic, (_, make) in topics.items():
                publishers[topic].publish(make(stamp))

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        for publisher in publishers.values():
            publisher.unregister()


@contextmanager
def extractor():
    """Run the extractor on the topics of the stand-in."""
    command = ['rosrun', 'skeleton_extract_3d', 'skeleton_extract_3d_node', '__name:=skeleton_extract_3d_node',
               f'~image:={IMAGE}', f'~depth_image:={DEPTH}', f'~camera_info:={INFO}', '_points_source:=depth_image',
               '~skeleton_2d_detector:=detect_poses_3d']
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL)
    try:
        Diagnostics('/skeleton_extract_3d_node')
        yield
    finally:
        process.terminate()
        process.wait()


@contextmanager
def transform(parent, child, quaternion):
    """Publish a static transform."""
    broadcaster = tf2_ros.StaticTransformBroadcaster()
    message = TransformStamped(header=Header(stamp=rospy.Time.from_sec(time.time()), frame_id=parent),
                               child_frame_id=child)
    message.transform.rotation = Quaternion(*quaternion)
    broadcaster.sendTransform(message)
    try:
        yield
    finally:
        broadcaster.pub_tf.unregister()


def doctor(*options, **variables):
    """Return the exit status of the doctor and its output: state, text and line of each finding by check."""
    done = subprocess.run(['rosrun', 'openpose_ros_bringup', 'doctor', '--seconds', '3', *options], text=True,
                          stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, env={**os.environ, **variables},
                          timeout=60, check=False)
    found, name = {}, ''
    for line in done.stdout.splitlines()[:-1]:
        begin = re.match(r'(?:[ \d]\d (\w+)|) +(right|WRONG|-) {3,}(.*)', line)
        if begin:
            name = begin[1] or name
            found.setdefault(name, []).append([*begin.groups()[1:], ''])
        elif line.strip().startswith('-> '):
            found[name][-1][2] = line.strip()[3:]
        else:
            found[name][-1][1] += f' {line.strip()}'
    return done.returncode, found, done.stdout


class DoctorTest(unittest.TestCase):
    def check(self, mistake, name, text, line, *options, **variables):
        """Check that a mistake is found by one check, with words of its text and the line to type."""
        with self.subTest(mistake):
            status, found, output = doctor(*options, **variables)
            wrong = [each for each in found[name] if each[0] == 'WRONG']
            self.assertTrue(any(text in each[1] and line in each[2] for each in wrong), output)
            self.assertEqual(status, 1, output)

    def test_a_camera_alone(self):
        with camera(GOOD):
            status, found, output = doctor()
        wrong = {name for name, each in found.items() if any(state == 'WRONG' for state, *_ in each)}
        self.assertEqual((status, wrong), (1, {'subscribers'}), output)
        self.assertEqual(found['subscribers'], [[
            'WRONG', 'no node finds people: the chain does not run',
            'roslaunch openpose_ros_bringup people.launch camera:=realsense rviz:=true']])

    def test_a_driver_without_its_arguments(self):
        topics = {topic: value for topic, value in GOOD.items() if topic not in (DEPTH, INFO)}
        topics[RAW_DEPTH] = Image, lambda stamp: depth(stamp, 'camera_depth')
        with camera(topics):
            self.check('no align_depth', 'topics', f'{DEPTH}: no node', 'rs_camera.launch align_depth:=true')

    def test_mistakes_of_the_system(self):
        with camera(GOOD), transform('base_link', OPTICAL, (0, 0, 0, 1)):
            self.check('tf without the optical rotation', 'frames', 'the camera looks straight up',
                       f'-1.5708 0 -1.5708 base_link {OPTICAL}', '--fixed-frame', 'base_link')
        master = rosgraph.Master('/dead_driver')
        master.registerPublisher(IMAGE, 'sensor_msgs/Image', 'http://localhost:9')
        with camera(GOOD):
            self.check('a driver that died', 'master', '/dead_driver is registered', 'rosnode cleanup')
        master.unregisterPublisher(IMAGE, 'http://localhost:9')
        with socket.create_server(('localhost', 0)) as silent:  # takes connections, and answers nothing
            uri = f'http://localhost:{silent.getsockname()[1]}'
            self.check('a master that hangs', 'master', 'does not answer', 'roscore', ROS_MASTER_URI=uri)

    def test_the_chain(self):
        detector = FakeDetector('detect_poses_3d')
        with extractor():
            self.check('no camera', 'topics', 'no node publishes it', 'align_depth:=true')
            with camera(GOOD), transform('base_link', OPTICAL, (-0.5, 0.5, -0.5, 0.5)):
                self.check('no subscriber', 'subscribers', 'rests', 'rostopic hz /openpose_ros/skeleton_3d/')
                self.check('another camera', 'subscribers', 'reads other topics', 'camera:=kinect2', '--camera',
                           'kinect2')
                frames = []
                subscriber = rospy.Subscriber('/openpose_ros/skeleton_3d/detected_poses_3d', PersonDetection_3dArray,
                                              frames.append)
                await_true(lambda: len(frames) > 100, 'results')
                status, found, output = doctor('--fixed-frame', 'base_link')
                states = {name: {state for state, *_ in each} for name, each in found.items()}
                self.assertEqual((status, set.union(*states.values()), len(states)), (0, {'right'}, 10), output)
                self.assertIn('1 person in', output)
                subscriber.unregister()
        detector.shutdown()


if __name__ == '__main__':
    rospy.init_node('check_doctor')
    rostest.rosrun('openpose_ros_bringup', 'check_doctor', DoctorTest, sys.argv)
