"""Signals become messages and come back as they were."""
import numpy as np
import pytest
import rospy
from openpose_ros_msgs.msg import PersonGesture, PersonSignals
from openpose_ros_msgs.msg import ZoneState as MessageOfZone
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from openpose_ros_signals import records
from openpose_ros_signals.gestures import ARM_GESTURES
from openpose_ros_signals.reader import Present
from openpose_ros_signals.records import (
    Facing,
    Fall,
    FloorPose,
    Gesture,
    Hit,
    PointedTarget,
    Pointing,
    Posture,
    Ray,
    Walk,
)
from openpose_ros_signals.ros.convert import (
    poses_of,
    signals_from_array,
    signals_to_array,
    summary_to_message,
    turned_array,
)
from openpose_ros_signals.zones import EMPTY, OCCUPIED, UNKNOWN, ZoneState
from skeleton_extract_3d.points.transform import UPRIGHT, rotation_of

HEADER = Header(stamp=rospy.Time(12, 500000000), frame_id='room')
X, Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
EYE_RAY = Ray(np.array([0.5, 0.0, 1.75]), Y, 0.125)
ARM_RAY = Ray(np.array([0.5, 0.0, 1.25]), X, 0.0625)
LAMP = Pointing(np.array([0.5, 0.0, 1.5]), X, 0.25, EYE_RAY, ARM_RAY, Hit(np.array([3.0, 0.0, 1.5]), 'lamp', 0.125),
                (PointedTarget('lamp', np.array([3.0, 0.0, 1.5]), 0.5, 0.75),
                 PointedTarget('cup', np.array([3.0, 0.5, 1.5]), 1.5, 0.25)))
EVERYTHING = records.PersonSignals(
    7, np.array([0.5, 0.25, 1.0]), Posture('sitting', 11.5, 0.75),
    (Gesture('wave', 'left', 12.25, 0.5), Gesture('point', 'right', 12.0, 1.0, LAMP)),
    Facing(X, 0.125), Facing(Y, 0.25), Walk(True, 1.5, Y), Fall(11.5, 0.75, 2.0), ('left',),
    FloorPose(np.array([0.5, 0.25, 0.0]), np.array([0.0, 0.0, 0.6, 0.8])))
NOTHING = records.PersonSignals(8, np.full(3, np.nan))
SOME = records.PersonSignals(9, np.zeros(3), gestures=(
    Gesture('arms_crossed', 'both', 12.0, 1.0),
    Gesture('point', 'right', 12.0, 1.0, Pointing(LAMP.origin, X, 0.25, ARM_RAY, EYE_RAY))),
    walk=Walk(False, 0.0, np.zeros(3)))


def plain(value):
    """Return a record as nested tuples that compare, with NaN as None."""
    if isinstance(value, np.ndarray):
        value = tuple(value.tolist())
    if isinstance(value, tuple):
        return tuple(plain(each) for each in value)
    if hasattr(value, '__dataclass_fields__'):
        return tuple(plain(getattr(value, name)) for name in value.__dataclass_fields__)
    return None if isinstance(value, float) and np.isnan(value) else value


@pytest.mark.parametrize('person', [EVERYTHING, NOTHING, SOME], ids=['everything', 'nothing', 'some'])
def test_there_and_back_and_turned(person):
    array = signals_to_array([person], HEADER)
    array.persons[0]._check_types()
    assert array.persons[0].header == HEADER
    assert plain(signals_from_array(array)[0]) == plain(person)
    after = signals_from_array(turned_array(array, UPRIGHT))[0]
    np.testing.assert_array_equal(after.place, UPRIGHT @ person.place)
    assert plain(signals_from_array(array)[0]) == plain(person), 'the message is another one'
    for there, here in zip(after.gestures, person.gestures):
        if here.pointing is not None:
            for ray in ('eye_ray', 'arm_ray'):
                np.testing.assert_array_equal(getattr(there.pointing, ray).direction,
                                              UPRIGHT @ getattr(here.pointing, ray).direction)
            assert [each.position.tolist() for each in there.pointing.targets] == [
                (UPRIGHT @ each.position).tolist() for each in here.pointing.targets]
    if person.floor is not None:
        turned = rotation_of(UPRIGHT) * Rotation.from_quat(person.floor.orientation)
        np.testing.assert_allclose(after.floor.orientation, turned.as_quat())
        np.testing.assert_array_equal(after.walk.direction, UPRIGHT @ person.walk.direction)


def test_poses_are_those_of_people_with_known_joints():
    array = poses_of(signals_to_array([NOTHING, EVERYTHING], HEADER))
    assert array.header == HEADER
    (pose,) = array.poses
    assert (pose.position.x, pose.position.y, pose.position.z) == (0.5, 0.25, 0.0)
    assert (pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w) == (0.0, 0.0, 0.6, 0.8)


def test_the_words_of_the_messages_are_those_of_the_records():
    assert {value for name, value in vars(PersonGesture).items() if name.isupper()} == {
        *(gesture.name for gesture in ARM_GESTURES), 'arms_crossed', records.LEFT, records.RIGHT, records.BOTH}
    assert {PersonSignals.STANDING, PersonSignals.SITTING, PersonSignals.CROUCHING, PersonSignals.KNEELING,
            PersonSignals.LYING} == set(records.POSTURES)
    assert PersonSignals.UNKNOWN == records.UNKNOWN
    assert (PersonGesture.LEFT, PersonGesture.RIGHT, PersonGesture.BOTH) == (records.LEFT, records.RIGHT, records.BOTH)


def test_a_summary_says_since_when_each_person_is_there():
    header = Header(stamp=rospy.Time(1700000000, 123456789), frame_id='room')
    now = header.stamp.to_sec()
    zones = (ZoneState('cell', OCCUPIED, now - 1.0, 0.75, 7, 'left_hand', (7, 9)),
             ZoneState('door', UNKNOWN, now, np.nan, 0, '', ()))
    message = summary_to_message((Present(now - 9.0, EVERYTHING, 1.5, -0.5), Present(now - 5.0, SOME)), zones, header,
                                 'base_link')
    message._check_types()
    assert message.robot_frame == 'base_link'
    assert [plain((each.distance, each.bearing)) for each in message.persons] == [(1.5, -0.5), (None, None)]
    assert [(zone.name, zone.state, zone.probability, zone.person_ID, zone.part, zone.person_IDs)
            for zone in message.zones[:1]] == [('cell', MessageOfZone.OCCUPIED, 0.75, 7, 'left_hand', [7, 9])]
    assert message.zones[0].since.to_sec() == pytest.approx(now - 1.0, abs=1e-6)
    assert message.zones[1].state == MessageOfZone.UNKNOWN and (EMPTY, MessageOfZone.EMPTY) == (1, 1)
    assert message.header == header
    assert [(each.signals.header, each.signals.person_ID) for each in message.persons] == [(header, 7), (header, 9)]
    assert [round((header.stamp - person.since).to_sec(), 6) for person in message.persons] == [9.0, 5.0]
