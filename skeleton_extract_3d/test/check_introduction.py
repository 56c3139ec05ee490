#!/usr/bin/python3
"""The first screen of a node's log says what is at work: mode, networks, runtime, rate and topics."""
import os
import subprocess
import sys
import unittest
from concurrent.futures import ThreadPoolExecutor

import rostest

NODES = {
    ('openpose_ros_pkg', 'openpose_ros_node', '_mode:=fast', '_image_topic:=/cam/image', '_target_rate:=0.1'): (
        'mode: fast, pose_model auto, joints COCO_18',
        'networks: movenet_multipose 384x384 + 1 crop refinement by movenet_',  # Thunder is optional
        'runtime: movenet_multipose on ', '(precision auto', 'target_rate: 0.1 Hz', 'subscribes to: /cam/image',
        '/openpose_ros/detected_poses_keypoints', 'serves: /detect_poses, ', '/openpose_ros_service_node/enable'),
    ('openpose_ros_pkg', 'openpose_ros_node_firephinx', '_camera_topic:=/cam/image', '_image_transport:=compressed'): (
        'detection: by /detect_poses, joints COCO_18', 'subscribes to: /cam/image/compressed',
        'publishes: /openpose_ros/input_image'),
    ('skeleton_extract_3d', 'skeleton_extract_3d_node', '_points_source:=depth_image', '_smoothing:=false',
     '~skeleton_2d_detector:=/detect_poses', '~depth_image:=/cam/depth', '_tracking_frame:=map'): (
        'detection: by /detect_poses, joints COCO_18',
        'lifting: robust from depth_image, occlusion on, tracking on, smoothing off',
        'frames: joints in the frame of the points, people followed in map',
        '/skeleton_extract_3d_node/image, /cam/depth', '/openpose_ros/skeleton_3d/detected_poses_3d'),
    ('skeleton_extract_3d', 'skeleton_extract_3d_visualization_node', '_lifetime:=2.0'): (
        'lifetime 2 s', 'subscribes to: /openpose_ros/skeleton_3d/detected_poses_3d',
        '/openpose_ros/skeleton_3d/visualization_markers'),
}


def introduction(command):
    """Start a node, end it as soon as it has introduced itself, and return its log until then."""
    # rospy does not flush what it writes to a pipe
    process = subprocess.Popen(['rosrun', *command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True, env={**os.environ, 'PYTHONUNBUFFERED': '1'})
    lines = []
    try:
        for line in process.stdout:
            lines.append(line)
            if line.startswith('  serves: '):  # the last one
                break
    finally:
        process.kill()
        process.communicate()
    return ''.join(lines)


class IntroductionTest(unittest.TestCase):

    def test_all_nodes(self):
        with ThreadPoolExecutor(len(NODES)) as pool:
            logs = list(pool.map(introduction, NODES))
        for (command, words), log in zip(NODES.items(), logs):
            with self.subTest(node=command[1]):
                for word in words:
                    self.assertIn(word, log)
                self.assertLess(len(log.splitlines()), 24, 'one screen')


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'introduction', IntroductionTest, sys.argv)
