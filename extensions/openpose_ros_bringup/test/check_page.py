#!/usr/bin/python3
"""The demo in a headless Chromium: the page draws the people of the topics where the camera saw them."""
import sys
import unittest
from collections import OrderedDict
from pathlib import Path

import numpy as np
import rospy
import rostest
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonSignalsArray
from sensor_msgs.msg import CameraInfo

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from browser import Browser, chromium
from session import await_true
from skeleton_extract_3d.ros import convert

SPACE = '/openpose_ros/skeleton_3d'
PORT = 18081
KEPT = 600  # frames
# What is drawn, of one moment.
DRAWN = '''({stamp: peopleView.messages.people.stamp, signals_stamp: peopleView.messages.signals.stamp,
            joints: peopleView.joints(), size: peopleView.view.size,
            stage: (r => [r.left, r.top, r.width, r.height])(document.getElementById("scene").getBoundingClientRect()),
            rows: [...document.querySelectorAll("#people tr")].map(
                row => [...row.cells].map(cell => cell.textContent))})'''


class Kept:
    """The newest messages of a topic, by their stamp in milliseconds."""

    def __init__(self, topic, kind):
        self.messages = OrderedDict()
        self.subscriber = rospy.Subscriber(f'{SPACE}/{topic}', kind, self.keep, queue_size=10)

    def keep(self, message):
        self.messages[round(message.header.stamp.to_sec() * 1000)] = message
        while len(self.messages) > KEPT:
            self.messages.popitem(last=False)

    def of(self, stamp):
        return await_true(lambda: self.messages.get(round(stamp * 1000)), f'message of {stamp}')


@unittest.skipIf(chromium() is None, 'chromium is not installed: apt-get install chromium')
class PageTest(unittest.TestCase):
    def test_the_page_draws_what_the_topics_say(self):
        people, signals = Kept('detected_poses_3d', PersonDetection_3dArray), Kept('people_signals', PersonSignalsArray)
        info = rospy.wait_for_message(f'{SPACE}/camera_info', CameraInfo, 60)
        with Browser(900, 500) as browser:  # software draws it, beside the chain
            browser.open(f'http://localhost:{PORT}/')
            browser.wait('window.peopleView?.messages.cameras?.cameras.length === 1')
            browser.wait('peopleView.messages.people?.people.length >= 2 && peopleView.messages.signals')
            browser.wait('document.getElementById("image").width >= 320')  # it changes the layout
            browser.press('1')
            browser.wait('peopleView.view.mode === "camera 0"')
            browser.wait_for_drawing()
            # between a change of the layout and the next drawing the view has another size than its place
            drawn = browser.wait(DRAWN, lambda drawn: len(drawn['rows']) >= 2 and len(drawn['joints']) > 20
                                 and drawn['stamp'] == drawn['signals_stamp']
                                 and np.allclose(drawn['size'], drawn['stage'][2:], atol=1))
            self.check_joints(drawn, convert.people_from_array(people.of(drawn['stamp'])), np.reshape(info.K, (3, 3)),
                              (info.width, info.height))
            self.assertTrue({str(person.person_ID) for person in signals.of(drawn['stamp']).persons}
                            & {row[0] for row in drawn['rows']}, drawn['rows'])
            browser.wait('[...document.querySelectorAll("#nodes li")].some(each => '
                         'each.textContent.startsWith("skeleton_extract_3d_node"))')
            self.assertEqual(browser.errors, [])

    def check_joints(self, drawn, people, matrix, size):
        """The view is from the camera, so that its own matrix tells where joints are, in its frame."""
        left, top, width, height = drawn['stage']
        scale = min(width / size[0], height / size[1])
        rows = {number: row for row, number in enumerate(people.ids.tolist())}
        self.assertGreaterEqual(len({joint['id'] for joint in drawn['joints']}), 2)
        for joint in drawn['joints']:
            place = rows[joint['id']], people.skeleton.index[joint['joint']]
            u, v, depth = matrix @ people.xyz[place]
            self.assertEqual(joint['status'], people.status[place])
            pixel = [left + width / 2 + scale * (u / depth - size[0] / 2),
                     top + height / 2 + scale * (v / depth - size[1] / 2)]
            np.testing.assert_allclose([joint['x'], joint['y']], pixel, atol=1.5, err_msg=str(joint))


if __name__ == '__main__':
    rospy.init_node('check_page')
    rostest.rosrun('openpose_ros_bringup', 'check_page', PageTest)
