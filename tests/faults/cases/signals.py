"""People and hands that no signals can be read of, and settings that the node of signals refuses."""
from typing import Any, List

from faults.cases.fused_people import HOUR, a_thousand, every_joint, later
from faults.fault import Fault, Scenario
from faults.injectors import NAN, altered, changed, refused

SIGNALS = 'signals/people'


def exchanged(persons: List[Any]) -> List[Any]:
    ids = [person.person_ID for person in persons]
    for person, name in zip(persons, reversed(ids)):
        person.person_ID = name
    return persons


def back_and_forth(chain: Any) -> None:
    for seconds in (HOUR, -HOUR, 2**32 - 1 - 1_800_000_000, 0) * 3:
        later(seconds, 'people')(chain)


def half_a_hand(frame: Any) -> None:
    from openpose_ros_msgs.msg import HandDetection_3d
    frame.hands.hands = [HandDetection_3d(person_ID=2**32 - 1, side=9)]


PROGRAM = 'extensions/openpose_ros_signals/scripts/people_signals_node'
LAMP = '{name: lamp, frame_id: room, position: %s}'
ENDS = 'ends with 1 and names it'
NODE = 'people_signals_node'
FAULTS = [
    Fault('people of an unknown joint set', changed('people', pose_model='none_such'), SIGNALS,
          words=("pose_model 'none_such' is unknown",)),
    Fault('measured joints without positions', every_joint('people', x=NAN), SIGNALS,
          words=('status must be MISSING',)),
    Fault('joints a thousand kilometres away', every_joint('people', z=1e6), SIGNALS, event=''),
    Fault('all joints in one point', every_joint('people', x=1.0, y=1.0, z=3.0), SIGNALS, event=''),
    Fault('sigma of NaN', every_joint('people', sigma=NAN), SIGNALS, event=''),
    Fault('a thousand people', changed('people', persons=a_thousand), SIGNALS, event=''),
    Fault('two ids exchanged', changed('people', persons=exchanged), SIGNALS, event=''),
    Fault('no person', changed('people', persons=[], velocities=[]), SIGNALS, event=''),
    Fault('frame that tf does not know', changed('people.header', frame_id='none_such'), SIGNALS, 'no transform',
          ('none_such',)),
    Fault('people without a stamp', changed('people.header.stamp', secs=0, nsecs=0), SIGNALS, event=''),
    Fault('stamps an hour forth and back, and after 2038, three times', back_and_forth, SIGNALS, 'no transform',
          ('2038',)),
    Fault('hand of no person, of no side, without points', altered(half_a_hand), SIGNALS),
    Scenario('targets that are no YAML', refused(PROGRAM, {'targets': '{file}'}, 'settings.yaml', text='{'), NODE,
             ENDS),
    Scenario('target at NaN', refused(
        PROGRAM, {'targets': '{file}'}, 'settings.yaml', 'is no target', text=f"[{LAMP % '[.nan, 0, 0]'}]"), NODE,
        ENDS),
    Scenario('zone of two corners', refused(
        PROGRAM, {'zones': '{file}'}, 'settings.yaml', 'three or more corners',
        text='[{name: a, frame_id: room, polygon: [[0, 0], [1, 1]], z: [0, 1]}]'), NODE, ENDS),
    Scenario('no direction is up', refused(PROGRAM, {'up': "'0 0 0'"}, "'up'"), NODE, ENDS),
]
