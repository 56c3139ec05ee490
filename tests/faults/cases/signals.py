"""People, clouds and hands that no signals can be read of, and settings that the node of signals refuses."""
from typing import Any, Callable

from faults.cases.fused_people import (
    HOUR,
    NAN,
    a_thousand,
    every_joint,
    in_frame,
    later,
    nobody,
    of_an_unknown_joint_set,
    without_stamp,
)
from faults.fault import Fault, Scenario
from faults.injectors import Injector, altered, refused

SIGNALS = 'signals/people'


def people(change: Callable[[Any], None]) -> Injector:
    """Return what sends a frame after a function changed its people."""
    return altered(lambda frame: change(frame.people))


def cloud(**fields: Any) -> Injector:
    """Return what sends a frame whose cloud has other values in these fields."""
    def change(frame: Any) -> None:
        for name, value in fields.items():
            setattr(frame.cloud, name, value)
    return altered(change)


def exchanged(message: Any) -> None:
    ids = [person.person_ID for person in message.persons]
    for person, name in zip(message.persons, reversed(ids)):
        person.person_ID = name


def back_and_forth(chain: Any) -> None:
    for seconds in (HOUR, -HOUR, 2**32 - 1 - 1_800_000_000, 0) * 3:
        frame = chain.frame()
        later(seconds)(frame.people)
        chain.send(frame)


def half_a_hand(frame: Any) -> None:
    from openpose_ros_msgs.msg import HandDetection_3d
    frame.hands.hands = [HandDetection_3d(person_ID=2**32 - 1, side=9)]


PROGRAM = 'extensions/openpose_ros_signals/scripts/people_signals_node'
LAMP = '{name: lamp, frame_id: room, position: %s}'
ENDS = 'ends with 1 and names it'
NODE = 'people_signals_node'
FAULTS = [
    Fault('people of an unknown joint set', people(of_an_unknown_joint_set), SIGNALS,
          words=("pose_model 'none_such' is unknown",)),
    Fault('measured joints without positions', people(every_joint(x=NAN)), SIGNALS, words=('status must be MISSING',)),
    Fault('joints a thousand kilometres away', people(every_joint(z=1e6)), SIGNALS, event=''),
    Fault('all joints in one point', people(every_joint(x=1.0, y=1.0, z=3.0)), SIGNALS, event=''),
    Fault('sigma of NaN', people(every_joint(sigma=NAN)), SIGNALS, event=''),
    Fault('a thousand people', people(a_thousand), SIGNALS, event=''),
    Fault('two ids exchanged', people(exchanged), SIGNALS, event=''),
    Fault('nobody', people(nobody), SIGNALS, event=''),
    Fault('frame that tf does not know', people(in_frame('none_such')), SIGNALS, 'no transform', ('none_such',)),
    Fault('people without a stamp', people(without_stamp), SIGNALS, event=''),
    Fault('stamps an hour forth and back, and after 2038, three times', back_and_forth, SIGNALS, 'no transform',
          ('2038',)),
    Fault('cloud without fields', cloud(fields=[]), SIGNALS, words=('cloud',)),
    Fault('cloud with half of its data', altered(lambda frame: setattr(
        frame.cloud, 'data', frame.cloud.data[:len(frame.cloud.data) // 2])), SIGNALS, words=('cloud',)),
    Fault('hand of nobody, of no side, without points', altered(half_a_hand), SIGNALS),
    Scenario('targets that are no YAML', refused(PROGRAM, {'targets': '{file}'}, 'settings.yaml', text='{'), NODE,
             ENDS),
    Scenario('target at NaN', refused(
        PROGRAM, {'targets': '{file}'}, 'settings.yaml', 'is no target', text=f"[{LAMP % '[.nan, 0, 0]'}]"), NODE,
        ENDS),
    Scenario('no direction is up', refused(PROGRAM, {'up': "'0 0 0'"}, "'up'"), NODE, ENDS),
]
