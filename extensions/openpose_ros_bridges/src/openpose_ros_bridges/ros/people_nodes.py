"""People on the floor: people_msgs_node as people_msgs/People, spencer_node as spencer_tracking_msgs/TrackedPersons."""
from typing import Type, Union

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion, Twist, TwistWithCovariance, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonSignalsArray
from std_msgs.msg import Header

from openpose_ros_bridges.located import Ages, Located, covariance, located, velocity_sigma
from openpose_ros_bridges.node_params import BridgeSettings
from openpose_ros_bridges.ros.bridge import PEOPLE, SIGNALS, Bridge, Output
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_signals.ros.convert import signals_from_array
from skeleton_extract_3d.ros.convert import people_from_array

PEOPLE_MSGS = ForeignPackage('people_msgs', 'https://github.com/wg-perception/people (branch noetic)')
SPENCER = ForeignPackage('spencer_tracking_msgs', 'https://github.com/spencer-project/spencer_people_tracking (branch '
                                                  'noetic, folder messages)')


class PeopleMessages:
    """Makes messages of people.

    Attributes:
        kind: class of people_msgs/People.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
    """

    def __init__(self) -> None:
        self._person = PEOPLE_MSGS.message('Person', {
            'name': 'string', 'position': 'geometry_msgs/Point', 'velocity': 'geometry_msgs/Point',
            'reliability': 'float64', 'tagnames': 'string[]', 'tags': 'string[]'})
        self.kind = PEOPLE_MSGS.message('People', {'header': 'std_msgs/Header', 'people': 'people_msgs/Person[]'})

    def convert(self, people: PersonDetection_3dArray, signals: PersonSignalsArray) -> genpy.Message:
        """Return the message of one frame, in the frame of reference of the signals."""
        persons = located(people_from_array(people), signals_from_array(signals))
        return self.kind(header=signals.header, people=[self._of(person) for person in persons])

    def end(self, header: Header) -> genpy.Message:
        """Return the message without people."""
        return self.kind(header=header)

    def _of(self, person: Located) -> genpy.Message:
        # the message knows no unknown velocity, and its readers no NaN
        velocity = (0.0, 0.0, 0.0) if person.velocity is None else person.velocity
        return self._person(name=str(person.id), position=Point(*person.position), velocity=Point(*velocity),
                            reliability=person.reliability, tagnames=[name for name, _ in person.tags],
                            tags=[value for _, value in person.tags])


class SpencerMessages:
    """Makes messages of tracked persons; remembers since when they are there.

    Attributes:
        kind: class of spencer_tracking_msgs/TrackedPersons.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
    """

    def __init__(self) -> None:
        self._person = SPENCER.message('TrackedPerson', {
            'track_id': 'uint64', 'is_occluded': 'bool', 'is_matched': 'bool', 'detection_id': 'uint64',
            'age': 'duration', 'pose': 'geometry_msgs/PoseWithCovariance',
            'twist': 'geometry_msgs/TwistWithCovariance'})
        self.kind = SPENCER.message('TrackedPersons', {'header': 'std_msgs/Header',
                                                       'tracks': 'spencer_tracking_msgs/TrackedPerson[]'})
        self._ages = Ages()

    def convert(self, people: PersonDetection_3dArray, signals: PersonSignalsArray) -> genpy.Message:
        """Return the message of one frame, in the frame of reference of the signals."""
        persons = located(people_from_array(people), signals_from_array(signals))
        ages = self._ages.of([person.id for person in persons], signals.header.stamp.to_sec())
        return self.kind(header=signals.header, tracks=[self._of(person, age) for person, age in zip(persons, ages)])

    def end(self, header: Header) -> genpy.Message:
        """Return the message without people, and forget all: an extractor that is started again counts ids anew."""
        self._ages = Ages()
        return self.kind(header=header)

    def _of(self, person: Located, age: float) -> genpy.Message:
        pose = PoseWithCovariance(Pose(Point(*person.position), Quaternion(*person.orientation)),
                                  covariance(person.sigma, person.turn_sigma))
        return self._person(track_id=person.id, detection_id=person.id, is_matched=person.measured,
                            is_occluded=not person.measured, age=rospy.Duration.from_sec(age), pose=pose,
                            twist=self._twist(person))

    def _twist(self, person: Located) -> TwistWithCovariance:
        if person.velocity is None:
            return TwistWithCovariance(Twist(), covariance(np.nan, np.nan))
        return TwistWithCovariance(Twist(linear=Vector3(*person.velocity)),
                                   covariance(velocity_sigma(person), np.nan))


def _run(name: str, topic: str, kind: Type[Union[PeopleMessages, SpencerMessages]]) -> None:
    def make(settings: BridgeSettings) -> Bridge:
        messages = kind()
        return Bridge(settings.demand, Output(topic, messages.kind, (PEOPLE, SIGNALS), messages.convert, messages.end))

    run_node(name, BridgeSettings, make)


def main_people_msgs() -> None:
    """Run the bridge to people_msgs."""
    _run('people_msgs_node', 'people', PeopleMessages)


def main_spencer() -> None:
    """Run the bridge to spencer_tracking_msgs."""
    _run('spencer_node', 'tracked_persons', SpencerMessages)
