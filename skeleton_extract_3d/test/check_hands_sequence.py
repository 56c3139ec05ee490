#!/usr/bin/python3
"""Hands and face of somebody before the camera, found by the networks themselves; needs a rendered sequence of hands.

It is looked for beside the checkout, in shared/bench/rgbd_dev/hands; without it the test is skipped.
"""
import json
import sys
import unittest
from pathlib import Path

import cv2
import numpy as np
import rospy
import rostest
from harness import FRAME_ID, OUTPUT, VISIBLE, Camera, need_weights, now, position
from openpose_ros_msgs.msg import BodypartDetection_3d, FaceDetection_3dArray, HandDetection, HandDetection_3dArray
from std_msgs.msg import Header

from openpose_ros_pkg.networks.model_registry import FACE_LANDMARK, HAND_LANDMARK
from openpose_ros_pkg.ros.convert import bgr_to_image
from session import Recorder
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.ros.convert import cloud_to_message

FOLDER = Path(__file__).resolve().parents[2].parent / 'shared' / 'bench' / 'rgbd_dev' / 'hands'
FRAMES = range(0, 44, 8)
# Median error of the points that are seen [m]; ./run bench people hands measures them all.
MEDIAN_ERROR = 0.015


class HandsSequenceTest(unittest.TestCase):
    def test_hands_are_where_they_are(self):
        if not (FOLDER / 'gt.json').is_file():
            self.skipTest(f'{FOLDER} is not there')
        need_weights(HAND_LANDMARK), need_weights(FACE_LANDMARK)
        truth, meta = (json.loads((FOLDER / name).read_text()) for name in ('gt.json', 'meta.json'))
        rospy.init_node('check_hands_sequence')
        hands = Recorder(f'{OUTPUT}/detected_hands_3d', HandDetection_3dArray)
        faces = Recorder(f'{OUTPUT}/detected_faces_3d', FaceDetection_3dArray)
        camera = Camera('/image', '/points')
        model = CameraModel(meta['width'], meta['height'], np.reshape(meta['K'], (3, 3)))
        errors, sides = [], []
        for number in FRAMES:
            header = Header(stamp=now(), frame_id=FRAME_ID)
            bgr, depth = (cv2.imread(str(sorted((FOLDER / part).iterdir())[number]), cv2.IMREAD_UNCHANGED)
                          for part in ('rgb', 'depth'))
            cloud = cloud_from_depth(depth * 0.001, model, bgr)
            camera.send(bgr_to_image(bgr, header), cloud_to_message(cloud, header))
            found = {hand.side: hand for hand in hands.wait(1, header.stamp)[0].hands}
            self.assertEqual(len(faces.wait(1, header.stamp)[0].faces), 1)
            for hand in truth['frames'][number]['people'][0]['hands']:
                side = HandDetection.LEFT if hand['side'] == 'left' else HandDetection.RIGHT
                sides.append(side in found)
                if side in found:
                    seen = [k for k, label in enumerate(hand['vis']) if label == VISIBLE and
                            found[side].keypoints[k].status == BodypartDetection_3d.MEASURED]
                    errors += [np.linalg.norm(position(found[side].keypoints[k]) - hand['xyz'][k]) for k in seen]
        self.assertGreaterEqual(np.mean(sides), 0.9)
        self.assertLess(np.median(errors), MEDIAN_ERROR)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_hands_sequence', HandsSequenceTest, sys.argv)
