#!/usr/bin/python3
"""Nodes refuse to start with wrong parameters or weights, and say what is wrong and what to do."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rostest
from ros_test_tools import TIMEOUT

WEIGHTS = 'mobilenet_thin/graph_opt.pb'


def refusal(executable, *arguments):
    """Start a node and return its exit status and what it says; it has to end by itself."""
    done = subprocess.run(['rosrun', 'openpose_ros_pkg', executable, '__name:=refused', *arguments],
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=TIMEOUT, check=False)
    return done.returncode, done.stdout


class BadParametersTest(unittest.TestCase):

    def assert_refused(self, executable, *arguments, words):
        status, text = refusal(executable, *arguments)
        self.assertEqual(status, 1, text)
        for word in words:
            self.assertIn(word, text)
        self.assertIn('FATAL', text)
        self.assertNotIn('Traceback', text)

    def test_service(self):
        service = 'openpose_ros_node'
        for arguments, words in (
                (['_net_input_hight:=256'],
                 ["unknown parameter 'net_input_hight' = 256", "did you mean 'net_input_height'?", 'allowed:']),
                (['_net_input_width:=wide'], ["'net_input_width' = 'wide'", 'int in -1 .. 4096 [px]']),
                (['_alpha_pose:=1.5'], ["'alpha_pose' = 1.5", 'float in 0 .. 1']),
                (['_pose_model:=NOBODY'], ["'pose_model' = 'NOBODY'", 'mobilenet_thin'])):
            with self.subTest(arguments):
                self.assert_refused(service, *arguments, words=words)

    def test_service_of_the_3d_chain(self):
        self.assert_refused('openpose_ros_node_3d', '_backend:=abacus',
                            words=["'backend' = 'abacus'", "'auto', 'openvino', 'opencv_dnn'"])

    def test_client(self):
        client = 'openpose_ros_node_firephinx'
        for arguments, words in (
                (['_image_transport:=theora'], ["'image_transport' = 'theora'", "'raw', 'compressed'"]),
                (['_service_timeout:=0.0'], ["'service_timeout' = 0.0", 'float in 0.1 .. 600 [s]']),
                (['_camera_topic:=no topic'], ["'camera_topic' = 'no topic'"])):
            with self.subTest(arguments):
                self.assert_refused(client, *arguments, words=words)

    def test_camera(self):
        camera = 'camera_node'
        for arguments, words in (
                (['_rate:=-1.0'], ["'rate' = -1.0", 'float in 0 .. 1000 [Hz]']),
                (['_source:=/no/such/folder'], ['/no/such/folder']),
                (['_camera_info_file:=/no/such/file'], ["'camera_info_file' = '/no/such/file'"])):
            with self.subTest(arguments):
                self.assert_refused(camera, *arguments, words=words)

    def test_weights(self):
        """Missing or damaged: the text names the file and how to get it."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / WEIGHTS
            self.assert_refused('openpose_ros_node', f'_model_folder:={folder}',
                                words=['weights of mobilenet_thin not found', str(path), './run model get'])
            path.parent.mkdir()
            path.write_bytes(b'no network')
            self.assert_refused('openpose_ros_node', f'_model_folder:={folder}',
                                words=['damaged', str(path), '10 bytes', 'sha256', './run model get'])


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_pkg', 'bad_parameters', BadParametersTest, sys.argv)
