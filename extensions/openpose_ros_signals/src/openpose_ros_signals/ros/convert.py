"""Turn signals into messages and back: the only place of this package that knows both."""
import copy
from typing import Any, Optional, Sequence, Tuple

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Vector3
from openpose_ros_msgs import msg
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from openpose_ros_signals import records
from openpose_ros_signals.reader import Present
from openpose_ros_signals.zones import ZoneState
from skeleton_extract_3d.points.transform import rotation_of

_NOWHERE = np.full(3, np.nan)
# What messages have for what is not known.
_NO_FACING, _NO_HIT = records.Facing(_NOWHERE, np.nan), records.Hit(_NOWHERE, '', np.nan)
_NO_WALK, _NO_FALL = records.Walk(False, np.nan, _NOWHERE), records.Fall(np.nan, np.nan, np.nan)
_NO_FLOOR = records.FloorPose(_NOWHERE, np.full(4, np.nan))


def signals_to_array(persons: Sequence[records.PersonSignals], header: Header) -> msg.PersonSignalsArray:
    """Return the message of a frame."""
    return msg.PersonSignalsArray(header=header, persons=[_person_to_message(person, header) for person in persons])


def poses_of(array: msg.PersonSignalsArray) -> PoseArray:
    """Return where on the floor the people of a frame are; those without any known joint are left out."""
    return PoseArray(header=array.header, poses=[person.floor_pose for person in array.persons
                                                 if not np.isnan(person.floor_pose.position.x)])


def summary_to_message(people: Sequence[Present], zones: Sequence[ZoneState], header: Header, robot_frame: str
                       ) -> msg.PeopleSummary:
    """Return the message of the people that are there, and of zones."""
    return msg.PeopleSummary(header=header, robot_frame=robot_frame, persons=[
        msg.PersonSummary(_time(present.since), present.distance, present.bearing,
                          _person_to_message(present.signals, header)) for present in people],
        zones=[msg.ZoneState(zone.name, zone.state, _time(zone.since), zone.probability, max(zone.person, 0), zone.part,
                             [max(name, 0) for name in zone.inside]) for zone in zones])


def signals_from_array(message: msg.PersonSignalsArray) -> Tuple[records.PersonSignals, ...]:
    """Return what the people of one frame do."""
    return tuple(_person_from_message(person) for person in message.persons)


def turned_array(message: msg.PersonSignalsArray, rotation: np.ndarray) -> msg.PersonSignalsArray:
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


def _person_to_message(person: records.PersonSignals, header: Header) -> msg.PersonSignals:
    body, head = person.body or _NO_FACING, person.head or _NO_FACING
    walk, fall, floor = person.walk or _NO_WALK, person.fall or _NO_FALL, person.floor or _NO_FLOOR
    return msg.PersonSignals(
        header=header, person_ID=max(person.id, 0), position=Point(*person.place), posture=person.posture.name,
        posture_since=_time(person.posture.since), posture_confidence=person.posture.confidence,
        gestures=[msg.PersonGesture(gesture.name, gesture.arm, _time(gesture.since), gesture.confidence,
                                    [] if gesture.pointing is None else [_pointing_to_message(gesture.pointing)])
                  for gesture in person.gestures], hidden_arms=list(person.hidden_arms),
        body_facing=Vector3(*body.direction), body_facing_sigma=body.sigma,
        head_facing=Vector3(*head.direction), head_facing_sigma=head.sigma,
        moving=walk.moving, speed=walk.speed, walking_direction=Vector3(*walk.direction),
        fallen=person.fall is not None, fall_stamp=_time(fall.stamp), fall_duration=fall.duration,
        fall_speed=fall.speed, floor_pose=Pose(Point(*floor.position), Quaternion(*floor.orientation)))


def _person_from_message(message: msg.PersonSignals) -> records.PersonSignals:
    walk = records.Walk(message.moving, message.speed, _array(message.walking_direction))
    fall = records.Fall(message.fall_stamp.to_sec(), message.fall_duration, message.fall_speed)
    place, turn = message.floor_pose.position, message.floor_pose.orientation
    floor = records.FloorPose(_array(place), np.array([turn.x, turn.y, turn.z, turn.w]))
    return records.PersonSignals(
        message.person_ID, _array(message.position),
        records.Posture(message.posture, _seconds(message.posture_since), message.posture_confidence),
        tuple(records.Gesture(gesture.name, gesture.arm, _seconds(gesture.since), gesture.confidence,
                              _pointing_from_message(gesture.pointing[0]) if gesture.pointing else None)
              for gesture in message.gestures),
        _facing(message.body_facing, message.body_facing_sigma),
        _facing(message.head_facing, message.head_facing_sigma), None if np.isnan(message.speed) else walk,
        fall if message.fallen else None, tuple(message.hidden_arms), None if np.isnan(place.x) else floor)


def _pointing_to_message(ray: records.Pointing) -> msg.PersonPointing:
    hit = ray.hit or _NO_HIT
    return msg.PersonPointing(
        origin=Point(*ray.origin), direction=Vector3(*ray.direction), sigma=ray.sigma, target=hit.name,
        hit=Point(*hit.position), hit_angle=hit.off, eye_ray=_ray_to_message(ray.eye_ray),
        arm_ray=_ray_to_message(ray.arm_ray), targets=[
            msg.PointingTarget(target.name, Point(*target.position), target.sigmas, target.probability)
            for target in ray.targets])


def _pointing_from_message(message: msg.PersonPointing) -> records.Pointing:
    hit = None if np.isnan(message.hit.x) else records.Hit(_array(message.hit), message.target, message.hit_angle)
    targets = tuple(records.PointedTarget(target.name, _array(target.position), target.sigmas, target.probability)
                    for target in message.targets)
    return records.Pointing(_array(message.origin), _array(message.direction), message.sigma,
                            _ray_from_message(message.eye_ray), _ray_from_message(message.arm_ray), hit, targets)


def _ray_to_message(ray: records.Ray) -> msg.PointingRay:
    return msg.PointingRay(Point(*ray.origin), Vector3(*ray.direction), ray.sigma)


def _ray_from_message(message: msg.PointingRay) -> records.Ray:
    return records.Ray(_array(message.origin), _array(message.direction), message.sigma)


def _facing(direction: Vector3, sigma: float) -> Optional[records.Facing]:
    return None if np.isnan(direction.x) else records.Facing(_array(direction), sigma)


def _array(vector: Vector3) -> np.ndarray:
    return np.array([vector.x, vector.y, vector.z])


def _time(stamp: float) -> rospy.Time:
    """Return a stamp [s] as a time; 0 where it is NaN."""
    return rospy.Time() if np.isnan(stamp) else rospy.Time.from_sec(max(stamp, 0.0))


def _seconds(time: rospy.Time) -> float:
    return time.to_sec() if time else np.nan
