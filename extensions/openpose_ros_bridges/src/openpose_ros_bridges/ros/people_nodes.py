"""People on the floor: people_msgs_node as people_msgs/People, spencer_node as spencer_tracking_msgs/TrackedPersons."""
import math
from typing import Callable, Dict, Optional, Sequence

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion, Twist, TwistWithCovariance, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonSignalsArray
from std_msgs.msg import Header

from openpose_ros_bridges.located import covariance, located, velocity_sigma
from openpose_ros_bridges.ros.bridge import HEADER, PEOPLE, SIGNALS, FieldMap, Output, run_bridge
from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_signals.ros.convert import signals_from_array
from skeleton_extract_3d.ros.convert import people_from_array

PEOPLE_MSGS = ForeignPackage('people_msgs', 'https://github.com/wg-perception/people (branch noetic)')
SPENCER = ForeignPackage('spencer_tracking_msgs', 'https://github.com/spencer-project/spencer_people_tracking (branch '
                                                  'noetic, folder messages)')


def people_msgs(_settings: Optional[DemandParams] = None) -> Sequence[Output]:
    """Return the output of people_msgs_node."""
    person = FieldMap(
        PEOPLE_MSGS, 'Person', name=('string', lambda one: str(one.id)),
        position=('geometry_msgs/Point', lambda one: Point(*one.position)),
        # the message knows no unknown velocity, and its readers no NaN
        velocity=('geometry_msgs/Point', lambda one: Point(*_known(one.velocity))),
        reliability=('float64', lambda one: one.reliability),
        tagnames=('string[]', lambda one: [name for name, _ in one.tags]),
        tags=('string[]', lambda one: [value for _, value in one.tags]))
    people = FieldMap(PEOPLE_MSGS, 'People', header=HEADER,
                      people=('people_msgs/Person[]', lambda _, persons: [person(one) for one in persons]))
    return (_output('people', people),)


class Ages:
    """For how long people have been known; all begin anew where stamps go back."""

    def __init__(self) -> None:
        self._first: Dict[int, float] = {}
        self._newest = -math.inf

    def of(self, person: int, stamp: float) -> float:
        """Return the age [s] of a person of a frame with a stamp [s]."""
        if stamp < self._newest:
            self.clear()
        self._newest = stamp
        return stamp - self._first.setdefault(person, stamp)

    def clear(self) -> None:
        """Forget all: an extractor that is started again counts ids anew."""
        self._first.clear()


def spencer(_settings: Optional[DemandParams] = None) -> Sequence[Output]:
    """Return the output of spencer_node."""
    ages = Ages()
    person = FieldMap(
        SPENCER, 'TrackedPerson', track_id=('uint64', lambda one, _: one.id),
        detection_id=('uint64', lambda one, _: one.id), is_matched=('bool', lambda one, _: one.measured),
        is_occluded=('bool', lambda one, _: not one.measured),
        age=('duration', lambda one, now: rospy.Duration.from_sec(ages.of(one.id, now))),
        pose=('geometry_msgs/PoseWithCovariance', lambda one, _: PoseWithCovariance(
            Pose(Point(*one.position), Quaternion(*one.orientation)), covariance(one.sigma, one.turn_sigma))),
        twist=('geometry_msgs/TwistWithCovariance', lambda one, _: TwistWithCovariance(
            Twist(linear=Vector3(*_known(one.velocity))), covariance(velocity_sigma(one), np.nan))))
    tracks = FieldMap(SPENCER, 'TrackedPersons', header=HEADER, tracks=(
        'spencer_tracking_msgs/TrackedPerson[]',
        lambda header, persons: [person(one, header.stamp.to_sec()) for one in persons]))
    return (_output('tracked_persons', tracks, ages.clear),)


def _known(velocity: Optional[np.ndarray]) -> np.ndarray:
    return np.zeros(3) if velocity is None else velocity


def _output(topic: str, array: FieldMap, forget: Callable[[], None] = lambda: None) -> Output:
    """Return the output of an array of people, in the frame of reference of the signals."""
    def convert(people: PersonDetection_3dArray, signals: PersonSignalsArray) -> genpy.Message:
        return array(signals.header, located(people_from_array(people), signals_from_array(signals)))

    def end(header: Header) -> genpy.Message:
        forget()
        return array(header, [])

    return Output(topic, array.kind, (PEOPLE, SIGNALS), convert, end)


def main_people_msgs() -> None:
    """Run the bridge to people_msgs."""
    run_bridge('people_msgs_node', DemandParams, people_msgs)


def main_spencer() -> None:
    """Run the bridge to spencer_tracking_msgs."""
    run_bridge('spencer_node', DemandParams, spencer)
