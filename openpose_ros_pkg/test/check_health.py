#!/usr/bin/python3
"""Diagnostics go on whatever is raised while they are gathered, and so do other threads of a node."""
import sys
import threading
import unittest

import rospy
import rostest

from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.threads import repeat
from session import PATIENCE, Diagnostics, await_true

NODE = 'health'  # as the test is called
FAILED = 'report failed'


def fails(text):
    """Return a function that raises."""
    def fail():
        raise RuntimeError(text)
    return fail


class HealthTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.health = Health()
        cls.diagnostics = Diagnostics(NODE)

    def await_reports(self, number):
        before = len(self.diagnostics.reports(NODE))
        await_true(lambda: len(self.diagnostics.reports(NODE)) >= before + number, f'{number} more reports')

    def test_what_a_part_raises_is_counted_and_the_other_parts_are_shown(self):
        self.health.show(fails('deque mutated during iteration'))
        self.health.show_lasting(fails('no fault is known'))
        self.health.explain_rest(fails('no reason is known'))
        self.health.show(lambda: {'after it': 'is shown'})
        self.diagnostics.await_count(NODE, FAILED, 6)  # three in each report
        self.assertEqual(self.diagnostics.value(NODE, 'after it'), 'is shown')
        self.assertEqual(self.diagnostics.reports(NODE)[-1].level, 'WARN')

    def test_an_error_of_the_updater_ends_nothing(self):
        updater = self.health._updater
        publish, failed = updater.publish, threading.Event()

        def fail(message):
            failed.set()
            raise OSError('no route to host')

        updater.publish = fail
        self.assertTrue(failed.wait(PATIENCE))
        updater.publish = publish
        self.await_reports(2)

    def test_a_thread_goes_on_after_an_error(self):
        done, went_on = [], threading.Event()

        def work():
            done.append(len(done))
            if len(done) == 1:
                raise ValueError('the first time')
            went_on.set()

        repeat(work, 'test', period=0.01)
        self.assertTrue(went_on.wait(PATIENCE))


if __name__ == '__main__':
    rospy.init_node(NODE)
    rostest.rosrun('openpose_ros_pkg', 'health', HealthTest, sys.argv)
