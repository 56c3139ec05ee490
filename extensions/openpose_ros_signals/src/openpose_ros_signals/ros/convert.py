"""Turn signals into messages and back: the only place of this package that knows both."""
import copy
from typing import Any, Optional, Sequence, Tuple

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Vector3
from openpose_ros_msgs.msg import (
    PeopleSummary,
    PersonGesture,
    PersonPointing,
    PersonSignals,
    PersonSignalsArray,
    PersonSummary,
    PointingRay,
    PointingTarget,
)
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from openpose_ros_signals import records
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
from skeleton_extract_3d.points.transform import rotation_of

_NOWHERE = (np.nan, np.nan, np.nan)


def signals_to_array(persons: Sequence[records.PersonSignals], header: Header) -> PersonSignalsArray:
    """Return the message of a frame."""
    return PersonSignalsArray(header=header, persons=[_person_to_message(person, header) for person in persons])


def poses_of(array: PersonSignalsArray) -> PoseArray:
    """Return where on the floor the people of a frame are; those without any known joint are left out."""
    return PoseArray(header=array.header, poses=[person.floor_pose for person in array.persons
                                                 if not np.isnan(person.floor_pose.position.x)])


def summary_to_message(people: Sequence[Present], header: Header) -> PeopleSummary:
    """Return the message of the people that are there."""
    return PeopleSummary(header=header, persons=[
        PersonSummary(since=_time(present.since), signals=_person_to_message(present.signals, header))
        for present in people])


def signals_from_array(message: PersonSignalsArray) -> Tuple[records.PersonSignals, ...]:
    """Return what the people of one frame do."""
    return tuple(_person_from_message(person) for person in message.persons)


def turned_array(message: PersonSignalsArray, rotation: np.ndarray) -> PersonSignalsArray:
    """Return a message whose positions and directions are turned about the origin, x' = R x."""
    def turn(value: Any) -> None:
        for name in value.__slots__ if isinstance(value, genpy.Message) else ():
            part = getattr(value, name)
            for each in part if isinstance(part, list) else [part]:
                turn(each)
        if isinstance(value, (Point, Vector3)):
            value.x, value.y, value.z = rotation @ _array(value)
        elif isinstance(value, Quaternion) and np.isfinite(value.x):
            turned = rotation_of(rotation) * Rotation.from_quat([value.x, value.y, value.z, value.w])
            value.x, value.y, value.z, value.w = turned.as_quat()

    message = copy.deepcopy(message)
    turn(message)
    return message


def _person_to_message(person: records.PersonSignals, header: Header) -> PersonSignals:
    message = PersonSignals(
        header=header, person_ID=max(person.id, 0), position=Point(*person.place), posture=person.posture.name,
        posture_since=_time(person.posture.since), posture_confidence=person.posture.confidence,
        gestures=[_gesture_to_message(gesture) for gesture in person.gestures], hidden_arms=list(person.hidden_arms))
    message.body_facing, message.body_facing_sigma = _facing_values(person.body)
    message.head_facing, message.head_facing_sigma = _facing_values(person.head)
    walk, fall = person.walk, person.fall
    message.moving, message.speed = walk is not None and walk.moving, np.nan if walk is None else walk.speed
    message.walking_direction = Vector3(*(_NOWHERE if walk is None else walk.direction))
    message.fallen, message.fall_stamp = fall is not None, _time(np.nan if fall is None else fall.stamp)
    message.fall_duration, message.fall_speed = (np.nan, np.nan) if fall is None else (fall.duration, fall.speed)
    message.floor_pose = Pose(Point(*_NOWHERE), Quaternion(*_NOWHERE, np.nan)) if person.floor is None else Pose(
        Point(*person.floor.position), Quaternion(*person.floor.orientation))
    return message


def _person_from_message(message: PersonSignals) -> records.PersonSignals:
    walk = None if np.isnan(message.speed) else Walk(message.moving, message.speed, _array(message.walking_direction))
    fall = Fall(message.fall_stamp.to_sec(), message.fall_duration, message.fall_speed) if message.fallen else None
    return records.PersonSignals(
        message.person_ID, _array(message.position),
        Posture(message.posture, _seconds(message.posture_since), message.posture_confidence),
        tuple(_gesture_from_message(gesture) for gesture in message.gestures),
        _facing(message.body_facing, message.body_facing_sigma),
        _facing(message.head_facing, message.head_facing_sigma), walk, fall, tuple(message.hidden_arms),
        _floor_pose(message.floor_pose))


def _gesture_to_message(gesture: Gesture) -> PersonGesture:
    return PersonGesture(name=gesture.name, arm=gesture.arm, since=_time(gesture.since), confidence=gesture.confidence,
                         pointing=[] if gesture.pointing is None else [_pointing_to_message(gesture.pointing)])


def _gesture_from_message(message: PersonGesture) -> Gesture:
    pointing = _pointing_from_message(message.pointing[0]) if message.pointing else None
    return Gesture(message.name, message.arm, _seconds(message.since), message.confidence, pointing)


def _pointing_to_message(ray: Pointing) -> PersonPointing:
    hit = Hit(np.array(_NOWHERE), '', np.nan) if ray.hit is None else ray.hit
    return PersonPointing(origin=Point(*ray.origin), direction=Vector3(*ray.direction), sigma=ray.sigma,
                          target=hit.name, hit=Point(*hit.position), hit_angle=hit.off,
                          eye_ray=_ray_to_message(ray.eye_ray), arm_ray=_ray_to_message(ray.arm_ray),
                          targets=[PointingTarget(target.name, Point(*target.position), target.sigmas,
                                                  target.probability) for target in ray.targets])


def _pointing_from_message(message: PersonPointing) -> Pointing:
    hit = None if np.isnan(message.hit.x) else Hit(_array(message.hit), message.target, message.hit_angle)
    targets = tuple(PointedTarget(target.name, _array(target.position), target.sigmas, target.probability)
                    for target in message.targets)
    return Pointing(_array(message.origin), _array(message.direction), message.sigma, hit,
                    _ray_from_message(message.eye_ray), _ray_from_message(message.arm_ray), targets)


def _ray_to_message(ray: Ray) -> PointingRay:
    return PointingRay(Point(*ray.origin), Vector3(*ray.direction), ray.sigma,
                       Point(*(_NOWHERE if ray.hit is None else ray.hit.position)))


def _ray_from_message(message: PointingRay) -> Ray:
    return Ray(_array(message.origin), _array(message.direction), message.sigma,
               None if np.isnan(message.hit.x) else Hit(_array(message.hit)))


def _facing_values(facing: Optional[Facing]) -> Tuple[Vector3, float]:
    return (Vector3(*_NOWHERE), np.nan) if facing is None else (Vector3(*facing.direction), facing.sigma)


def _facing(direction: Vector3, sigma: float) -> Optional[Facing]:
    return None if np.isnan(direction.x) else Facing(_array(direction), sigma)


def _floor_pose(pose: Pose) -> Optional[FloorPose]:
    turned = pose.orientation
    return None if np.isnan(pose.position.x) else FloorPose(
        _array(pose.position), np.array([turned.x, turned.y, turned.z, turned.w]))


def _array(vector: Vector3) -> np.ndarray:
    return np.array([vector.x, vector.y, vector.z])


def _time(stamp: float) -> rospy.Time:
    """Return a stamp [s] as a time; 0 where it is NaN."""
    return rospy.Time() if np.isnan(stamp) else rospy.Time.from_sec(max(stamp, 0.0))


def _seconds(time: rospy.Time) -> float:
    return time.to_sec() if time else np.nan
