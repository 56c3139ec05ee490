#!/usr/bin/python3
"""Arguments of the command line, in the notation of gflags, are private parameters; unknown ones are refused."""
import os
import subprocess
import sys
import unittest

import rospy
import rostest
from harness import node, publisher
from sensor_msgs.msg import Image

from session import PATIENCE, await_true

CLIENT = 'openpose_ros_node_firephinx'


def without_a_master(*arguments):
    """Run the client where no master is; return its exit status, stdout and stderr."""
    done = subprocess.run(['rosrun', 'openpose_ros_pkg', CLIENT, *arguments], stdin=subprocess.DEVNULL, text=True,
                          capture_output=True, timeout=PATIENCE, check=False,
                          env={**os.environ, 'ROS_MASTER_URI': 'http://localhost:9'})
    return done.returncode, done.stdout, done.stderr


class ArgumentsTest(unittest.TestCase):

    def test_flags_win_over_the_parameter_server(self):
        """Remappings and names of roslaunch pass through; flags of the original without effect are told."""
        rospy.set_param('/flagged', {'camera_topic': '/of_the_server', 'alpha_pose': 0.3, 'image_transport': 'raw'})
        arguments = ('--camera_topic=camera', 'camera:=renamed', '--net_input_width', '656', '-alpha_pose', '1',
                     '--disable_blending', '--nodisplay')
        with node(CLIENT, *arguments, name='flagged'):
            publisher('/renamed', Image)
            self.assertEqual(rospy.get_param('/flagged'), {
                'camera_topic': 'camera', 'alpha_pose': 1.0, 'image_transport': 'raw', 'disable_blending': True,
                'display': False})

    def test_what_is_unknown_or_not_allowed_is_refused(self):
        for arguments, words in (
                (['--camera_topics=/x'], ("unknown flag '--camera_topics'", "'--camera_topic'?", '--help')),
                (['--alpha_pose=1.5'], ("'alpha_pose' = 1.5", 'float in 0 .. 1'))):
            status, _, errors = without_a_master(*arguments)
            self.assertEqual(status, 1, errors)
            for word in (*words, 'openpose_ros_node: '):
                self.assertIn(word, errors)
            self.assertNotIn('Traceback', errors)

    def test_help(self):
        status, text, errors = without_a_master('--help', '__name:=helped', '__log:=/tmp/none.log')
        self.assertEqual((status, errors), (0, ''))
        for word in ('The client node', '--NAME=VALUE', 'camera_topic: "/usb_cam/image_raw"'):
            self.assertIn(word, text)

    def test_the_parameter_server_never_gets_a_value_that_is_not_allowed(self):
        with node(CLIENT, '--alpha_pose=1.5', name='spared') as process:
            await_true(lambda: process.poll() is not None, 'the end of the node')
            self.assertEqual(process.returncode, 1)
        self.assertFalse(rospy.has_param('/spared'))


if __name__ == '__main__':
    rospy.init_node('arguments_test')
    rostest.rosrun('openpose_ros_pkg', 'arguments', ArgumentsTest, sys.argv)
