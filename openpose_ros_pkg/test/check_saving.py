#!/usr/bin/python3
"""The service node saves what it finds, as OpenPose does: one JSON file per image, and a video."""
import json
import signal
import sys
import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np
import rospy
import rostest
from harness import image, node, picture
from openpose_ros_msgs.srv import GetPersons

from session import PATIENCE, await_true

BLACK = np.zeros((540, 960, 3), np.uint8)


class SavingTest(unittest.TestCase):

    def test_json_and_video(self):
        with tempfile.TemporaryDirectory() as folder:
            results, video = Path(folder) / 'json', Path(folder) / 'people.avi'
            options = ('openpose_ros_node', '_pose_model:=mobilenet_thin', '_net_input_width:=464',
                       '_net_input_height:=256', '_target_rate:=0', f'_write_json:={results}',
                       f'_write_video:={video}')
            with node(*options, name='openpose_ros_service_node') as service:
                rospy.wait_for_service('detect_poses', PATIENCE)
                detect = rospy.ServiceProxy('detect_poses', GetPersons)
                found = [detect(image(bgr, 1.0 + number)).detections
                         for number, bgr in enumerate((picture(0), BLACK, picture(8)))]
                files = [results / f'{number:012d}_keypoints.json' for number in range(3)]
                await_true(lambda: all(file.exists() for file in files),
                           lambda: f'3 files; {sorted(results.iterdir())}')
                service.send_signal(signal.SIGINT)
                service.wait(PATIENCE)
            self.assertEqual([len(people) for people in found], [2, 0, 2])
            for file, people in zip(files, found):
                saved = json.loads(file.read_text())['people']
                self.assertEqual(len(saved), len(people))
                for written, person in zip(saved, people):
                    nose = written['pose_keypoints_2d'][:3]
                    expected = (person.nose.x, person.nose.y, person.nose.confidence)
                    self.assertLess(np.abs(np.subtract(nose, expected)).max(), 0.01)
            before = {path.name: path.read_bytes() for path in (*files, video)}
            with node(*options, name='openpose_ros_service_node') as service:
                rospy.wait_for_service('detect_poses', PATIENCE)
                rospy.ServiceProxy('detect_poses', GetPersons)(image(BLACK, 9.0))
                await_true((results / f'{3:012d}_keypoints.json').exists, 'a file after those of the earlier run')
                service.send_signal(signal.SIGINT)
                service.wait(PATIENCE)
            self.assertEqual({path.name: path.read_bytes() for path in (*files, video)}, before)
            self.assertTrue((Path(folder) / 'people_2.avi').exists())
            frames = cv2.VideoCapture(str(video))
            shapes = [frames.read()[1].shape for _ in range(3)]
            self.assertEqual(shapes, [(540, 960, 3)] * 3)
            self.assertFalse(frames.read()[0])


if __name__ == '__main__':
    rospy.init_node('saving_test')
    rostest.rosrun('openpose_ros_pkg', 'saving', SavingTest, sys.argv)
