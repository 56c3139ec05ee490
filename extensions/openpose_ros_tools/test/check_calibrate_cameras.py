#!/usr/bin/python3
"""calibrate_cameras listens to running cameras, one of them without depth."""
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
from camera_messages import frames

from openpose_ros_fusion.rig import read_rig
from session import PATIENCE, await_true
from simulated_room import around, record_all, rig_errors


class CalibrateCamerasTest(unittest.TestCase):

    def test_running_cameras(self):
        cameras = around(2)
        cameras[1].depth = False
        sent = [(time, f'{recording.name}/{topic}', message) for recording in record_all(cameras, seconds=8)
                for time, messages in frames(recording) for topic, message in messages.items()]
        publishers = {topic: rospy.Publisher(topic, type(message), queue_size=1000) for _, topic, message in sent}
        with tempfile.TemporaryDirectory() as folder:
            command = ['rosrun', 'openpose_ros_tools', 'calibrate_cameras', '--seconds', '3', '-o', f'{folder}/rig',
                       '--clocks-agree']
            child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
            try:
                await_true(lambda: all(one.get_num_connections() for one in publishers.values()), 'it listens')
                for _, topic, message in sorted(sent, key=lambda one: one[0]):
                    publishers[topic].publish(message)
                self.assertEqual(child.wait(PATIENCE), 0)
            finally:
                child.kill()
                child.wait()
            rig = read_rig(Path(folder) / 'rig' / 'rig.yaml')
        self.assertEqual([camera.name for camera in rig.cameras], ['camera_0', 'camera_1'])
        self.assertTrue(np.all(rig_errors(rig, cameras) < (0.5, 0.03, 1e-4)), rig_errors(rig, cameras))


if __name__ == '__main__':
    rospy.init_node('check_calibrate_cameras')
    rostest.rosrun('openpose_ros_tools', 'calibrate_cameras', CalibrateCamerasTest)
