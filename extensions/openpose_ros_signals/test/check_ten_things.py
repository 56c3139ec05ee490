#!/usr/bin/python3
"""The programs in examples/ do what docs/signals.md says of them, on messages that a test makes by hand."""
import subprocess
import sys
import unittest
from operator import attrgetter
from pathlib import Path

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import Point, PointStamped, PoseStamped, Quaternion, Twist, Vector3
from openpose_ros_msgs.msg import (
    BodypartDetection_3d,
    FaceDetection_3d,
    FaceDetection_3dArray,
    PeopleSummary,
    PersonDetection_3d,
    PersonDetection_3dArray,
    PersonGesture,
    PersonPointing,
    PersonSignalsArray,
    PersonSummary,
    PersonVelocity_3d,
    PointingTarget,
    ZoneState,
)
from openpose_ros_msgs.srv import GetPeople, GetPeopleResponse
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Bool, Header, Int32, String

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from session import PATIENCE, Recorder, await_true
from signal_feed import NAN, Feed, does, signals, told

ROOT = Path(__file__).resolve().parents[3]
# approach_person.py has a test of its own
PROGRAMS = {path.stem: path for path in (ROOT / 'examples').glob('*.py')
            if 'rospy.init_node' in path.read_text() and path.stem != 'approach_person'}
PEOPLE, SIGNALS, FACES, SUMMARY = (f'openpose_ros/skeleton_3d/{name}'
                          for name in ('detected_poses_3d', 'people_signals', 'detected_faces_3d', 'people_summary'))
PARTS = PersonDetection_3d.__slots__[3:]
EMPTY, OCCUPIED, UNKNOWN = ZoneState.EMPTY, ZoneState.OCCUPIED, ZoneState.UNKNOWN
MEASURED, INFERRED = BodypartDetection_3d.MEASURED, BodypartDetection_3d.INFERRED


def part(x, y, z, status=MEASURED, sigma=0.02):
    """Return a joint in the camera's frame that is at x, y, z of base_link."""
    return BodypartDetection_3d(x=-y, y=1.2 - z, z=x, confidence=0.9, status=status, sigma=sigma)


def joints(number, speed=0.0, **parts):
    """Return a person with some joints, the others are missing; and their velocities."""
    missing = BodypartDetection_3d(x=NAN, y=NAN, z=NAN, sigma=NAN)
    return (PersonDetection_3d(person_ID=number, **{name: parts.get(name, missing) for name in PARTS}),
            PersonVelocity_3d(person_ID=number, **{name: Vector3(speed, 0.0, 0.0) for name in PARTS}))


def people(*persons):
    return lambda header: PersonDetection_3dArray(
        header=Header(stamp=header.stamp, frame_id='camera'), pose_model='COCO_18',
        persons=[person for person, _ in persons], velocities=[velocity for _, velocity in persons])


def zone_message(*states, inside=()):
    return lambda header: PeopleSummary(header=header,
                                        zones=[ZoneState(state=state, person_IDs=inside) for state in states])


def awaits(output, *fields):
    """Return what waits until these fields of the last message have some values."""
    def wait(*values):
        await_true(lambda: output.messages and np.allclose(
            [attrgetter(field)(output.messages[-1]) for field in fields], values, atol=0.01),
            lambda: f'{values}, not {output.messages[-1:]}')
    return wait


class TenThingsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_ten_things')
        cls.children = [subprocess.Popen([str(program), f'__ns:=/{name}']) for name, program in PROGRAMS.items()]

    @classmethod
    def tearDownClass(cls):
        for child in cls.children:
            child.terminate()
        for child in cls.children:
            child.wait(PATIENCE)

    def test_stop_near_people(self):
        ns = '/stop_near_people'
        output = Recorder(f'{ns}/cmd_vel', Twist)
        forwards = Twist(linear=Vector3(0.3, 0.0, 0.0))

        def newest(speed):
            await_true(lambda: [each.linear.x for each in output.messages[-3:]] == 3 * [speed], f'{ns}: {speed} m/s')

        newest(0.0)  # no people yet
        with Feed(f'{ns}/cmd_vel_in', Twist, lambda _: forwards), \
                Feed(f'{ns}/{SUMMARY}', PeopleSummary, zone_message()) as feed:
            newest(0.0)  # no zones
            for states, speed in (([EMPTY, EMPTY], 0.3), ([EMPTY, OCCUPIED], 0.0), ([EMPTY], 0.3), ([UNKNOWN], 0.0),
                                  ([EMPTY], 0.3)):
                feed.send(zone_message(*states))
                newest(speed)
            feed.__exit__()
            newest(0.0)  # no people any more

    def test_follow_who_waved(self):
        ns = '/follow_who_waved'
        drives = awaits(Recorder(f'{ns}/cmd_vel', Twist), 'linear.x', 'angular.z')
        others = does(1, 1.0, -2.0)
        with Feed(f'{ns}/{SIGNALS}', PersonSignalsArray, signals(others, does(2, 3.0, 0.3))) as feed:
            drives(0.0, 0.0)
            feed.send(signals(others, does(2, 3.0, 0.3, 1.1, told(PersonGesture.WAVE))))
            drives(0.5, 1.5 * np.arctan2(0.3, 3.0))
            feed.send(signals(others, does(9, 1.4, 0.0)))  # another person
            drives(0.0, 0.0)
            feed.send(signals(others, does(2, 1.4, 0.0), does(9, 1.4, 0.5)))
            drives(0.2, 0.0)
            feed.send(signals(others, does(2, 3.0, 0.0, 1.1, told(PersonGesture.STOP))))
            drives(0.0, 0.0)

    def test_look_at_who_faces_me(self):
        ns = '/look_at_who_faces_me'
        output = Recorder(f'{ns}/look_at', PointStamped)
        looks_at = awaits(output, 'point.x', 'point.y', 'point.z')

        def face(number, x, turn):
            """Return a face 2 m before the camera that is turned from it by an angle [deg]."""
            half = np.radians(turn + 90.0) / 2  # x of the camera, turned about y by 90 degrees, is -z
            keypoints = [BodypartDetection_3d(x=x + dx, y=-0.3, z=2.0, status=MEASURED) for dx in (-0.03, 0.03)]
            return FaceDetection_3d(person_ID=number, orientation=Quaternion(0.0, np.sin(half), 0.0, np.cos(half)),
                                    keypoints=(keypoints + 68 * [BodypartDetection_3d(x=NAN, y=NAN, z=NAN)]))

        def faces(*found):
            return lambda header: FaceDetection_3dArray(header=Header(stamp=header.stamp, frame_id='camera'),
                                                        faces=list(found))

        hidden = face(3, 0.0, 0.0)
        hidden.orientation = Quaternion(NAN, NAN, NAN, NAN)
        with Feed(f'{ns}/{FACES}', FaceDetection_3dArray, faces(hidden, face(1, 0.5, 60.0))) as feed:
            feed.send(faces(hidden, face(2, 0.1, 0.0), face(1, 0.5, 60.0)))
            looks_at(0.1, -0.3, 2.0)
            feed.send(faces(face(2, 0.1, 20.0), face(1, 0.0, 0.0)))
            looks_at(0.0, -0.3, 2.0)

    def test_count_in_zone(self):
        ns = '/count_in_zone'
        counts = awaits(Recorder(f'{ns}/people_in_zone', Int32), 'data')
        counts(-1)

        with Feed(f'{ns}/{SUMMARY}', PeopleSummary, zone_message(EMPTY)) as feed:
            counts(0)
            for state, inside, number in ((OCCUPIED, (3, 7), 2), (UNKNOWN, (), -1), (EMPTY, (), 0)):
                feed.send(zone_message(state, inside=inside))
                counts(number)
        counts(-1)

    def test_say_who_is_near(self):
        ns, persons = '/say_who_is_near', []

        def answer(_):
            if persons == [None]:
                raise rospy.ServiceException('no people come')
            return GetPeopleResponse(PeopleSummary(persons=persons))

        def says(text):
            await_true(lambda: [each.data for each in output.messages[-1:]] == [text], text)

        output = Recorder(f'{ns}/say', String)
        service = rospy.Service(f'{ns}/get_people', GetPeople, answer)
        says('no person')
        persons[:] = [PersonSummary(distance=1.23, bearing=-0.5), PersonSummary(distance=3.0, bearing=0.5)]
        says('1.2 m, 29 degrees to the right')
        persons[:] = [None]
        says('unknown')
        service.shutdown()

    def test_alarm_on_fall(self):
        ns = '/alarm_on_fall'
        alarms, watches = Recorder(f'{ns}/fall_alarm', PointStamped), awaits(Recorder(f'{ns}/fall_watch', Bool), 'data')

        def fell(number, stamp, *place):
            return does(number, *place, posture='lying', fallen=True, fall_stamp=rospy.Time(stamp), fall_duration=0.8)

        watches(False)
        lies = does(1, 1.0, 1.0, 0.2, posture='lying')  # was found so
        both = fell(2, 200, 2.0, 0.1, 0.2), fell(3, 200, 3.0, 0.0, 0.2)
        with Feed(f'{ns}/{SIGNALS}', PersonSignalsArray, signals(lies, does(2, 2.0, 0.0))) as feed:
            watches(True)
            feed.send(signals(lies, *both), frames=5)
            await_true(lambda: len(alarms.messages) >= 2, 'two alarms')
        watches(False)
        self.assertEqual([(each.header.stamp.secs, each.header.frame_id, each.point.x, each.point.y)
                          for each in alarms.messages], [(200, 'map', 2.0, 0.1), (200, 'map', 3.0, 0.0)])

    def test_hand_over(self):
        ns = '/hand_over'
        output = Recorder(f'{ns}/hand_over', PointStamped)

        def with_wrist(wrist, number=1, speed=0.0):
            return joints(number, speed, right_wrist=wrist, right_shoulder=part(1.3, -0.2, 1.4),
                          right_hip=part(1.3, -0.2, 0.9))

        refused = {'hidden': with_wrist(part(0.8, -0.2, 1.1, INFERRED)),
                   'moves': with_wrist(part(0.8, -0.2, 1.1), speed=0.5), 'hangs': with_wrist(part(1.2, -0.2, 0.8)),
                   'speed not known': with_wrist(part(0.8, -0.2, 1.1), speed=NAN)}
        with Feed(f'{ns}/{PEOPLE}', PersonDetection_3dArray, people()) as feed:
            feed.send(people(*refused.values(), with_wrist(part(0.9, -0.3, 1.1), 2)))
            first = output.wait(1)[0]
        self.assertEqual(first.header.frame_id, 'base_link')
        np.testing.assert_allclose([first.point.x, first.point.y, first.point.z], [0.9, -0.3, 1.1], atol=1e-4)

    def test_go_where_pointed(self):
        ns = '/go_where_pointed'
        output = Recorder(f'{ns}/move_base_simple/goal', PoseStamped)
        nowhere = Point(NAN, NAN, NAN)

        def pointing(number, since, direction, sigma=0.15, hit=nowhere, probabilities=()):
            targets = [PointingTarget(name, hit, 1.0, each) for name, each in zip(('lamp', 'cup'), probabilities)]
            ray = PersonPointing(origin=Point(1.0, 0.0, 1.5), direction=Vector3(*direction), sigma=sigma,
                                 target=targets[0].name if targets else '', hit=hit, targets=targets)
            return does(number, 1.0, 0.0, 1.1, told('point', since=since, ray=[ray]))

        long_ago = rospy.Time.now() - rospy.Duration(2.0)
        down, level = (0.6, 0.0, -0.8), (1.0, 0.0, 0.0)
        refused = [pointing(2, long_ago, level), pointing(3, long_ago, down, sigma=0.6),
                   pointing(7, long_ago, level, hit=Point(4.0, 0.0, 1.2), probabilities=(0.6, 0.4))]
        with Feed(f'{ns}/{SIGNALS}', PersonSignalsArray, signals(*refused)) as feed:
            feed.send(signals(*refused, pointing(5, long_ago, down)), frames=10)
            lamp = pointing(6, long_ago, (0.0, 1.0, 0.0), hit=Point(1.0, 4.0, 1.2), probabilities=(0.8, 0.2))
            feed.send(signals(*refused, pointing(5, long_ago, down), lamp), frames=10)
            output.wait(2)
        self.assertEqual([each.header.frame_id for each in output.messages], ['map', 'map'])  # one goal each
        floor, lamp = (each.pose for each in output.messages)
        np.testing.assert_allclose([floor.position.x, floor.position.y, floor.position.z], [2.125, 0.0, 0.0], atol=1e-5)
        np.testing.assert_allclose([lamp.position.x, lamp.position.y, lamp.position.z], [1.0, 4.0, 0.0], atol=1e-5)

    def test_who_sits_at_the_table(self):
        ns = '/who_sits_at_the_table'
        persons = []

        def answer(_):
            if not persons:
                raise rospy.ServiceException('no people come')
            now = rospy.Time.now()
            summary = PeopleSummary(header=Header(stamp=now, frame_id='map'))
            for person in persons:
                person.posture_since = now - rospy.Duration(person.posture_confidence)
                summary.persons.append(PersonSummary(signals=person))
            return GetPeopleResponse(summary)

        def sits(number, seconds, x=2.5):
            return does(number, x, 0.5, 0.8, posture='sitting', posture_confidence=seconds)

        output = Recorder(f'{ns}/at_table', String)
        service = rospy.Service(f'{ns}/get_people', GetPeople, answer)
        await_true(lambda: [each.data for each in output.messages[-1:]] == ['unknown'], 'it is not known')
        persons += [sits(7, 20.0), sits(3, 9.0, 1.5), sits(4, 1.0), sits(5, 20.0, 4.0), does(6, 2.0, 0.0), does(8)]
        await_true(lambda: [each.data for each in output.messages[-1:]] == ['3 7'], 'two sit there')
        service.shutdown()

    def test_lying_people(self):
        ns = '/lying_people'
        output = Recorder(f'{ns}/lying_people', PointCloud2)

        def newest():
            return [[round(x, 3) for x, _, _ in point_cloud2.read_points(cloud)] for cloud in output.messages[-1:]]

        def shows(*xs):
            await_true(lambda: newest() == [list(xs)], lambda: f'{ns} shows {xs}: {newest()}')

        stamps = rospy.Publisher(f'{ns}/{PEOPLE}', PersonDetection_3dArray, queue_size=5)
        await_true(stamps.get_num_connections, 'a reader of people')
        seen = people(joints(1, nose=part(2.0, -0.5, 0.2), neck=part(2.0, -0.25, 0.2, INFERRED)),
                      joints(2, nose=part(3.0, 1.0, 1.6)))

        def both(*persons):
            def make(header):
                stamps.publish(seen(header))
                return signals(*persons)(header)
            return make

        with Feed(f'{ns}/{SIGNALS}', PersonSignalsArray, both(does(1, posture='unknown'), does(2))) as feed:
            shows()
            feed.send(both(does(1, posture='lying'), does(2)))
            shows(0.5, 0.25)
            self.assertEqual(output.messages[-1].header.frame_id, 'camera')
            feed.send(both(does(1, posture='sitting'), does(2)))
            shows()

    def test_greet_who_comes(self):
        ns = '/greet_who_comes'
        output = Recorder(f'{ns}/say', String)

        def walks(number, x, direction):
            return does(number, x, 0.0, moving=True, speed=1.0, walking_direction=Vector3(direction, 0.0, 0.0))

        refused = [does(1, 2.0, 0.0), walks(2, 2.0, 1.0), walks(3, 4.0, -1.0)]
        with Feed(f'{ns}/{SIGNALS}', PersonSignalsArray, signals(*refused)) as feed:
            feed.send(signals(walks(6, 2.8, -1.0)), frames=10)
            output.wait(1)
            feed.send(signals(walks(6, 2.2, -1.0)), frames=10)
            self.assertEqual(len(output.messages), 1)


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_signals', 'check_ten_things', TenThingsTest)
