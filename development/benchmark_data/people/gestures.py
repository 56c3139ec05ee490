"""Labelled gestures: what they do to a pose, and pointing at a target."""
from typing import Any, NamedTuple, Tuple

import numpy as np

from .body import COCO18
from .geometry import heading, rotation, unit
from .hand_poses import hand_angles
from .rig import Pose, Rig

RAMP = 0.3  # [s] into and out of a gesture, which its label does not cover


class Gesture(NamedTuple):
    """A gesture held from start to end [s]. Labels sit and stand only name what the body does.

    arm: L or R; rate: of waving and beckoning [Hz]; size: amplitude, 1 is usual; target (3,) [m] world with its name;
    style: the wrist is held on the line from the shoulder, or from the eye, to the target.
    """

    start: float
    end: float
    label: str
    arm: str = 'R'
    rate: float = 2.0
    size: float = 1.0
    target: Tuple[float, float, float] = (0, 0, 0)
    target_name: str = ''
    style: str = 'shoulder'


def smooth_step(share: float) -> float:
    share = float(np.clip(share, 0, 1))
    return share * share * (3 - 2 * share)


def strength(gesture: Gesture, t: float) -> float:
    """Return 0..1: how far the gesture is made at t."""
    return min(smooth_step((t - gesture.start + RAMP) / RAMP), smooth_step((gesture.end + RAMP - t) / RAMP))


def make_gesture(rig: Rig, pose: Pose, gesture: Gesture, t: float) -> Pose:
    """Return the pose with a gesture made in it."""
    weight = strength(gesture, t)
    if weight <= 0 or gesture.label in ('sit', 'stand'):
        return pose
    if gesture.label == 'point':
        return _point(rig, pose, gesture, weight)
    if gesture.label == 'arms_crossed':
        for side, forward in (('R', 0.02), ('L', -0.05)):
            pose = _with_arm(pose, side, weight, (
                (0.20, 0.34 + forward, -1), (-0.95, 0.42 + 2 * forward, 0.16 + forward)))
        return pose
    phase = 2 * np.pi * gesture.rate * (t - gesture.start)
    share = 0.5 + 0.5 * gesture.size * np.sin(phase)
    directions, hand, fingers = _GESTURES[gesture.label](share)
    pose = _with_arm(pose, gesture.arm, weight, directions)
    to_world, sign = rotation('z', pose.yaw), 1 if gesture.arm == 'L' else -1
    finger_direction, palm = (to_world @ [sign * v[0], -v[1], v[2]] for v in hand)
    return _with_hand(pose, gesture.arm, (finger_direction, palm, weight), fingers)


def _wave(share: float) -> Tuple[Any, Any, np.ndarray]:
    low, high = np.array([[0.80, 0.30, -0.30], [-0.22, 0.35, 1]]), np.array([[0.85, 0.25, -0.22], [0.55, 0.30, 1]])
    upper, fore = (1 - share) * low + share * high
    return (upper, fore), (np.add(fore, (0.15 * (2 * share - 1), 0, 0.2)), (0, 1, 0)), hand_angles('open')


def _raise_hand(_share: float) -> Tuple[Any, Any, np.ndarray]:
    return ((0.38, 0.22, 0.9), (0.05, 0.12, 1)), ((0, 0.05, 1), (0, 1, 0.1)), hand_angles('flat')


def _beckon(share: float) -> Tuple[Any, Any, np.ndarray]:
    palm = (0, -0.75, 1) if share < 0.5 else (0, -1, 0.55)
    return (((0.25, 0.35, -0.9), (0.02, 0.92 - 0.35 * share, 0.25 + 0.65 * share)),
            ((0, 0.8 - 1.1 * share, 0.55 + 0.5 * share), palm),
            (1 - share) * hand_angles('flat') + share * hand_angles('hook'))


_GESTURES = {'wave': _wave, 'raise_hand': _raise_hand, 'beckon': _beckon}


def _with_arm(pose: Pose, side: str, weight: float, directions: Any) -> Pose:
    """Return the pose with an arm brought near to directions, passing outward and forward of the body."""
    detour = weight * (1 - weight) * np.array([0.5, 0.6, 0])
    upper, fore = (unit((1 - weight) * unit(before) + weight * unit(after) + detour)
                   for before, after in zip(pose.arms[side], directions))
    return pose._replace(arms={**pose.arms, side: (upper, fore)})


def _with_hand(pose: Pose, side: str, hand: Tuple[np.ndarray, np.ndarray, float], fingers: np.ndarray) -> Pose:
    now = pose.fingers.get(side, hand_angles('relax'))
    return pose._replace(hands={**pose.hands, side: hand},
                         fingers={**pose.fingers, side: (1 - hand[2]) * now + hand[2] * fingers})


def _point(rig: Rig, pose: Pose, gesture: Gesture, weight: float) -> Pose:
    """Turn the head to the target, then bring the wrist on the line from shoulder or eye to it."""
    side, target, free = gesture.arm, np.array(gesture.target, float), {'wrists': {}, 'hands': {}}
    to_target = target - eye_of(rig.pose(pose._replace(**free)).joints)
    yaw = (heading(*to_target[:2]) - pose.yaw + 180) % 360 - 180
    yaw = float(np.clip(yaw, -60, 60))
    pitch = float(np.clip(-np.rad2deg(np.arctan2(to_target[2], np.linalg.norm(to_target[:2]))), -25, 30))
    pose = pose._replace(head_yaw=pose.head_yaw + weight * yaw * 0.75, twist=pose.twist + weight * yaw * 0.25,
                         head_pitch=pose.head_pitch + weight * pitch * 0.8)
    posed = rig.pose(pose._replace(**free))
    name = 'left_shoulder' if side == 'L' else 'right_shoulder'
    origin = eye_of(posed.joints) if gesture.style == 'eye' else posed.joints[COCO18.index(name)]
    line, shoulder = unit(target - origin), posed.shoulders[side]
    reach = 0.975 * (rig.lengths[side]['upper_arm'] + rig.lengths[side]['forearm'])
    along, from_shoulder = (origin - shoulder) @ line, origin - shoulder
    wrist = origin + (-along + np.sqrt(max(along ** 2 - from_shoulder @ from_shoulder + reach ** 2, 0))) * line
    sign = 1 if side == 'L' else -1
    palm = np.array([0, 0, -1.0]) + 0.6 * (rotation('z', pose.yaw) @ [-sign, 0, 0])
    pose = pose._replace(wrists={**pose.wrists, side: (wrist, np.array([0.6, -0.3, -1.0]), weight)})
    return _with_hand(pose, side, (unit(target - wrist), palm, weight), hand_angles('point'))


def eye_of(joints: np.ndarray) -> np.ndarray:
    """Return the middle between the eyes (3,)."""
    return 0.5 * (joints[COCO18.index('right_eye')] + joints[COCO18.index('left_eye')])
