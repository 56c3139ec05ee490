#!/usr/bin/python3
"""When frames are lost, an image waits in vain rather than take its neighbour's cloud."""
import sys
import time
import unittest

import numpy as np
import rospy
import rostest
from harness import FIRST_Z, STEP_Z, Camera, FakeDetector, Output, cloud, image, person, points

from session import Diagnostics, await_true

RATE, FRAMES, DROPS = 30, 300, 0.2
# Stamp of the cloud minus that of the image: a third of the period with jitter, as of two unsynchronised cameras [s].
OFFSET, JITTER = 0.010, 0.002
# Of the pairs that both streams still hold: a few are lost until the offset is learnt.
LEAST_SHARE = 0.9
# A machine that is busy gets so much more time for a frame [s]: what is to be shown is which messages are paired.
LENIENCE = 0.5


class PairingTest(unittest.TestCase):
    def test_dropped_frames_make_no_wrong_pair(self):
        rospy.init_node('check_pairing')
        detector = FakeDetector('detect_poses_3d')
        failed = []

        def fail_now_and_then(number):
            if number % 50 == 49:
                failed.append(number)
                raise RuntimeError('the service fails')
            return [person(number, {'nose': (20, 30)})]

        detector.answer = fail_now_and_then
        output, diagnostics, camera = Output(), Diagnostics(), Camera()
        possible = self.play(camera, lambda number: number in failed or any(
            array.persons[0].person_ID == number for array in list(output.arrays)))
        await_true(lambda: output.arrays and output.arrays[-1].persons[0].person_ID >= FRAMES, 'a last frame')

        arrays = list(output.arrays)
        images = np.array([array.persons[0].person_ID for array in arrays])
        clouds = np.array([round((array.persons[0].nose.z - FIRST_Z) / STEP_Z) for array in arrays])
        np.testing.assert_array_equal(images, clouds)
        self.assertEqual(len(set(images)), len(images), 'a frame came twice')
        answered = [number for number in possible if number not in failed]
        share = len(set(images) & set(answered)) / len(answered)
        rospy.loginfo('%d pairs, %.0f %% of the possible ones', len(images), 100 * share)
        self.assertGreater(share, LEAST_SHARE)
        self.assertTrue(failed)
        diagnostics.await_event('extractor', 'service call failed', len(failed))

    def play(self, camera, is_done):
        """Send the frames; return the numbers of which both messages were sent.

        Two whole frames at the end show that the chain still runs, and that nothing sent before is under way.
        """
        random = np.random.default_rng(1)
        possible, began, following = [], time.time(), time.monotonic()
        for number in range(FRAMES + 2):
            time.sleep(max(0.0, following - time.monotonic()))
            following = time.monotonic() + 1 / RATE
            stamp = rospy.Time.from_sec(began + number / RATE)
            with_image, with_cloud = (random.random(2) >= DROPS) | (number >= FRAMES)
            if with_image:
                camera.images.publish(image(number, stamp))
            if with_cloud:
                shift = rospy.Duration(OFFSET + random.uniform(-JITTER, JITTER))
                camera.points.publish(cloud(points(number), stamp + shift))
            if with_image and with_cloud:
                possible.append(number)
                while not is_done(number) and time.monotonic() < following + LENIENCE:
                    time.sleep(0.002)
        return possible


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_pairing', PairingTest, sys.argv)
