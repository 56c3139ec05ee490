#!/usr/bin/python3
"""With use_sim_time, every round of a bag in a loop gives its people; a clock that stops or jumps holds up nothing."""
import itertools
import sys
import time
import unittest

import rospy
import rostest
from harness import FIRST_Z, OUTPUT, STEP_Z, Camera, FakeDetector, Output, cloud, image, points
from rosgraph_msgs.msg import Clock
from visualization_msgs.msg import Marker

from session import Diagnostics, await_true, is_heard

# Stamps of the bag [s] and its rounds.
BEGIN, PERIOD, FRAMES, ROUNDS = 1000.0, 1 / 30, 30, 3


class SimTimeTest(unittest.TestCase):
    def test_a_bag_in_a_loop(self):
        rospy.init_node('check_sim_time')
        detector = FakeDetector('detect_poses_3d')
        clock = rospy.Publisher('/clock', Clock, queue_size=1)
        output, diagnostics, camera, markers = Output(), Diagnostics(), Camera(), []
        rospy.Subscriber(f'{OUTPUT}/visualization_markers', Marker, markers.append)
        await_true(lambda: is_heard(f'{OUTPUT}/visualization_markers'), 'the visualization is there')
        self.assertTrue(rospy.get_param('/use_sim_time'))

        # the static transform is there when a frame comes out
        early = itertools.count()

        def one_came():
            seconds = BEGIN - 100 + PERIOD * next(early)
            self.tick(clock, seconds)
            camera.send_frame(0, rospy.Time.from_sec(seconds))
            return output.arrays

        await_true(one_came, 'a first frame')
        for number in range(ROUNDS):
            output.arrays.clear()
            markers.clear()
            self.play(clock, camera, output, number)
            # an id holds the number of the round
            await_true(lambda number=number: any(marker.id // 100 == number for marker in list(markers)),
                       'markers in each round')
        diagnostics.await_event('extractor', 'time jumped back', ROUNDS - 1)
        self.assertGreaterEqual(detector.answered, ROUNDS * FRAMES)

        for number, jump in enumerate((0.0, -50.0)):  # the clock stands still, or is reset, while a frame waits
            before = diagnostics.count('extractor', 'no transform')
            stamp = rospy.Time.from_sec(BEGIN + (FRAMES + number) * PERIOD)
            camera.send(image(0, stamp), cloud(points(0), stamp, 'elsewhere'))
            self.tick(clock, rospy.get_time() + jump)
            diagnostics.await_event('extractor', 'no transform', before + 1, ['elsewhere'])
        output.arrays.clear()
        self.play(clock, camera, output, ROUNDS)
        self.assertEqual(diagnostics.count('extractor', 'frame failed'), 0)
        # the bag is paused
        diagnostics.await_text('extractor', 'no message on /image: simulated time stands still at')

    def play(self, clock, camera, output, number):
        for i in range(FRAMES):
            seconds = BEGIN + i * PERIOD
            self.tick(clock, seconds)
            frame = 100 * number + i
            array = output.frame(camera.send_frame(frame, rospy.Time.from_sec(seconds)))
            self.assertEqual(array.persons[0].person_ID, frame)
            self.assertAlmostEqual(array.persons[0].nose.z, FIRST_Z + STEP_Z * frame + 2, places=4)

    def tick(self, clock, seconds):
        clock.publish(Clock(rospy.Time.from_sec(seconds)))
        time.sleep(0.005)


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_sim_time', SimTimeTest, sys.argv)
