#!/usr/bin/python3
"""A person waves, points at a lamp and falls: messages and markers say so, in the frame in which the room stands."""
import sys
import threading
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import PoseArray
from openpose_ros_msgs.msg import PeopleSummary, PersonDetection_3dArray, PersonSignalsArray, ZoneState
from openpose_ros_msgs.srv import GetPeople
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from animated_skeleton import LYING, STANDING, Limb, held, people_of, swinging, then
from openpose_ros_signals.ros.convert import signals_from_array
from session import Diagnostics, Recorder, await_true
from skeleton_extract_3d.points.transform import transform_people
from skeleton_extract_3d.ros import convert

RATE = 15.0
OUTPUT = '/openpose_ros/skeleton_3d'
NODE = 'people_signals_node'
WAVE_IN, WAVE_OUT = (STANDING.with_arm('right', Limb((0.4, 0.5, -0.5), fore))
                     for fore in ((-0.35, 0.2, 1.0), (0.6, 0.2, 1.0)))
# The line from the right shoulder to a lamp at 3.0, -0.5, 1.2 m.
AT_LAMP = STANDING.with_arm('right', Limb((0.11, 1.0, -0.06), (0.11, 1.0, -0.06)))
MOTION = then((0.0, held((0, STANDING))), (1.0, swinging(WAVE_IN, WAVE_OUT, 1.5, 1.0)), (3.0, held((0, STANDING))),
              (4.0, held((4.0, STANDING), (4.4, AT_LAMP))), (6.0, held((6.0, STANDING), (7.0, STANDING), (7.5, LYING))))
LENGTH = 10.0
# From the camera's optical axes (x right, y down, z forward) to the room's; it stands 5 m before the person, 1 m high.
CAMERA = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([5.0, 0.0, 1.0])


def still(frame, pose):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose
    return convert.transform_from_matrix(matrix, Header(frame_id='room'), frame)


class Player(threading.Thread):
    """Sends what a camera sees of a person that does all that in turn."""

    def __init__(self):
        super().__init__(name='player', daemon=True)
        self.broadcaster = tf2_ros.StaticTransformBroadcaster()
        table = np.eye(3), np.array([1.0, 2.0, 0.7])
        self.broadcaster.sendTransform([still('camera', CAMERA), still('table', table)])
        self.topic = rospy.Publisher(f'{OUTPUT}/detected_poses_3d', PersonDetection_3dArray, queue_size=5)
        self.sends = True

    def run(self):
        rate, random, begin = rospy.Rate(RATE), np.random.RandomState(1), rospy.get_time()
        rotation, translation = CAMERA
        while not rospy.is_shutdown():
            now = rospy.get_time()
            round_number, time = divmod(now - begin, LENGTH)
            people = people_of([MOTION(time)], [1 + int(round_number)], random)
            seen = transform_people(people, rotation.T, -rotation.T @ translation)
            try:
                if self.sends:
                    self.topic.publish(convert.people_to_array(seen, Header(stamp=rospy.Time.from_sec(now),
                                                                            frame_id='camera')))
                rate.sleep()
            except rospy.ROSException:
                return  # the test has ended


def failure_of(call):
    """Return the text of the exception of a service; empty: there is none."""
    try:
        call()
    except rospy.ServiceException as error:
        return str(error)
    return ''


class PeopleSignalsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_people_signals')
        cls.diagnostics = Diagnostics(NODE)
        cls.player = Player()
        cls.signals = Recorder(f'{OUTPUT}/people_signals', PersonSignalsArray)
        cls.poses = Recorder(f'{OUTPUT}/people_poses', PoseArray)
        cls.summaries = Recorder(f'{OUTPUT}/people_summary', PeopleSummary)
        cls.markers = Recorder(f'{OUTPUT}/visualization_signals', Marker)
        cls.player.start()

    def await_person(self, found, what):
        """Return the first message of a person, and the signals in it, for which something holds."""
        def messages():
            return [(person, signals) for array in list(self.signals.messages)
                    for person, signals in zip(array.persons, signals_from_array(array)) if found(signals)]
        await_true(messages, what)
        return messages()[0]

    def await_marker(self, found, what):
        def markers():
            return [marker for marker in list(self.markers.messages) if found(marker)]
        await_true(markers, what)
        return markers()[0]

    def test_signals(self):
        message, person = self.await_person(lambda one: one.posture.name == 'standing', 'a standing person')
        self.assertEqual(message.header.frame_id, 'room')
        np.testing.assert_allclose(person.place, [0.0, 0.0, 1.1], atol=0.15)
        np.testing.assert_allclose(person.body.direction, [1.0, 0.0, 0.0], atol=0.3)
        np.testing.assert_allclose(person.floor.position, [*person.place[:2], 0.0], atol=1e-5)
        await_true(lambda: any(message.floor_pose in array.poses for array in self.poses.messages.copy()),
                   'the place of the person as a pose')

        self.await_person(lambda one: one.gesture('wave') and one.gesture('wave').arm == 'right', 'waving')

        message, person = self.await_person(lambda one: one.gesture('point') and one.gesture('point').pointing.hit,
                                            'pointing at a target')
        self.assertEqual(person.gesture('point').pointing.hit.name, 'lamp')
        np.testing.assert_allclose(person.gesture('point').pointing.hit.position, [3.0, -0.5, 1.2], atol=1e-3)

        message, person = self.await_person(lambda one: one.fall, 'a fall')
        self.assertEqual(person.posture.name, 'lying')
        self.assertGreater(person.fall.speed, 1.0)
        name = person.id
        self.await_person(lambda one: one.id == name + 1, 'the next person')
        falls = {one.fall.stamp for array in self.signals.messages for one in signals_from_array(array)
                 if one.id == name and one.fall}
        self.assertEqual(len(falls), 1, 'a fall is told once')

        # the markers, and the target that tf does not know
        text = self.await_marker(lambda one: one.ns == 'signals' and 'wave' in one.text, 'text of waving')
        self.assertEqual((text.header.frame_id, text.text), ('room', 'standing\nwave (right)'))
        self.await_marker(lambda one: one.ns == 'signals' and one.text.endswith('point (right) -> lamp'), 'target')
        arrow = self.await_marker(lambda one: one.ns == 'pointing' and one.points, 'pointing arrow')
        self.assertEqual(arrow.type, Marker.ARROW)
        self.await_marker(lambda one: one.ns == 'pointing' and one.action == Marker.DELETE, 'arrow is deleted')
        self.diagnostics.await_text(NODE, 'ghost')

        # for state machines: a service
        get_people = rospy.ServiceProxy('/get_people', GetPeople)
        await_true(lambda: [one.signals.person_ID for one in get_people().people.persons] == [name + 1], 'one person')
        answer = get_people().people
        self.assertEqual(answer.persons[0].signals.header.stamp, answer.header.stamp)
        self.assertLess(abs((answer.header.stamp - answer.persons[0].since).to_sec()), LENGTH)
        # the table, which is the robot here, is at 1, 2 m and looks as the room's x does
        self.assertEqual(answer.robot_frame, 'table')
        np.testing.assert_allclose([answer.persons[0].distance, answer.persons[0].bearing],
                                   [5 ** 0.5, np.arctan2(-2.0, -1.0)], atol=0.2)

        # zones in other frames, one of which tf does not know
        summary = self.summaries.wait(1)[-1]
        self.assertEqual([(zone.name, zone.state, bool(zone.person_IDs)) for zone in summary.zones], [
            ('cell', ZoneState.OCCUPIED, True), ('door', ZoneState.EMPTY, False), ('lift', ZoneState.UNKNOWN, False)])
        self.diagnostics.await_text(NODE, 'lift')

        # when no people come any more, the answer is an error; when they come again, they are told
        self.player.sends = False
        await_true(lambda: 'no people come:' in failure_of(get_people), 'an error')
        self.player.sends = True
        await_true(lambda: not failure_of(get_people) and get_people().people.persons, 'people again')


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_signals', 'check_people_signals', PeopleSignalsTest)
