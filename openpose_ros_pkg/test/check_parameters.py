#!/usr/bin/python3
"""What nodes say that refuse to start with wrong parameters or flags; all cases of these: tests/unit/params."""
import itertools
import os
import subprocess
import sys
import unittest
from pathlib import Path

import rospy
import rostest
from harness import SEQUENCE  # noqa: F401 - it adds the folder of session

from session import PATIENCE

CLIENT = 'openpose_ros_node_firephinx'
# The master keeps the parameters of a node that has ended.
NUMBERS = itertools.count()


def ended(executable, *arguments, name=None, **environment):
    """Start a node, which has to end by itself; return its exit status and what it says."""
    name = name or f'refused_{next(NUMBERS)}'
    done = subprocess.run(['rosrun', 'openpose_ros_pkg', executable, f'__name:={name}', *arguments],
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=PATIENCE, check=False, env={**os.environ, **environment})
    return done.returncode, done.stdout


class ParametersTest(unittest.TestCase):

    def assert_refused(self, executable, argument, *words, **environment):
        """Start the node with an argument; it has to end with all the words."""
        status, text = ended(executable, argument, **environment)
        self.assertEqual(status, 1, text)
        for word in words:
            self.assertIn(word, text)
        self.assertNotIn('Traceback', text)

    def test_wrong_flags_are_refused_and_help_is_given_without_a_master(self):
        no_master = {'ROS_MASTER_URI': 'http://localhost:9'}
        self.assert_refused(CLIENT, '--camera_topics=/x', "unknown flag '--camera_topics'", "'--camera_topic'?",
                            '--help', 'openpose_ros_node: ', **no_master)
        status, text = ended(CLIENT, '--help', **no_master)
        self.assertEqual(status, 0, text)
        for word in ('The client node', '--NAME=VALUE', 'camera_topic: "/usb_cam/image_raw"'):
            self.assertIn(word, text)

    def test_each_node_names_key_value_and_what_is_allowed(self):
        for executable, argument, *words in (
                ('openpose_ros_node', '_net_input_hight:=256',
                 "unknown parameter 'net_input_hight' = 256", "did you mean 'net_input_height'?", 'allowed:'),
                ('openpose_ros_node_3d', '_backend:=abacus', "'backend' = 'abacus'", "'opencv_dnn'"),
                (CLIENT, '_service_timeout:=0.0', "'service_timeout' = 0.0", 'float in 0.1 .. 600 [s]'),
                ('camera_node', '_source:=/no/such/folder', "'source' = '/no/such/folder'"),
                ('camera_node', '_source:=~/no_such', f"{Path('~/no_such').expanduser()} is neither")):
            self.assert_refused(executable, argument, 'FATAL', *words)

    def test_what_an_earlier_start_left(self):
        """The next start says how to delete all of it at once."""
        ended('camera_node', '_rates:=-1.0', '_old:=true', name='twice')
        status, text = ended('camera_node', name='twice')
        self.assertEqual((status, text.count('rosparam delete /twice\n')), (1, 1), text)


if __name__ == '__main__':
    rospy.init_node('check_parameters')
    rostest.rosrun('openpose_ros_pkg', 'parameters', ParametersTest, sys.argv)
