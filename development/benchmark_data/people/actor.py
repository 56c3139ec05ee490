"""Motion by inverse kinematics: planted feet, any orientation of the body, wrists at places, gestures."""
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Tuple, Union

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from .geometry import rotation
from .gestures import Gesture, make_gesture, smooth_step
from .hand_poses import hand_angles
from .motion import Keys, Motion, MotionKeys, track
from .rig import SIDES, Foot, Pose, Rig

ANKLE = 0.085  # [m] height of the ankle of a standing foot in a shoe


class Place(NamedTuple):
    """Where an actor is: the stage frame has its origin there, axes (to the person's left, forward, up)."""

    x: float
    y: float
    yaw: float


class ActorKeys(NamedTuple):
    """Key frames (t [s], value ...) in the stage frame [m]; per side where a mapping.

    hip: (left, forward, height as a share of the standing one); root: pitch forward, roll, spin [deg];
    feet: (outward, forward, up, pitch[, follows, bend]) of the ankles; knee, elbow: poles; wrist: places with weights;
    hands: pose names; hand_direction: (finger direction, palm normal, weight); sole: added to the ankles' height.
    """

    hip: Keys = ((0, (0, 0, 1.0)),)
    root: Keys = ((0, (0, 0, 0)),)
    feet: Mapping[str, Keys] = {}
    knee: Union[Keys, Mapping[str, Keys]] = ((0, (0.15, 1, 0.2)),)
    elbow: Union[Keys, Mapping[str, Keys]] = ((0, (0.7, -0.8, -0.3)),)
    wrist: Mapping[str, Keys] = {}
    wrist_weight: Mapping[str, Keys] = {}
    hands: Mapping[str, Keys] = {}
    hand_direction: Mapping[str, Sequence[Tuple[Any, ...]]] = {}
    turn: Keys = ((0, 0),)
    sole: float = 0.0


class Actor:
    """A person at a place who keeps the feet where they are put, and makes gestures."""

    def __init__(self, rig: Rig, place: Place, keys: ActorKeys, seed: int = 0, gestures: Sequence[Gesture] = (),
                 **motion: Any) -> None:
        """motion: key frames of MotionKeys other than path and yaw."""
        self.rig, self.place, self.sole = rig, place, keys.sole
        self.gestures: List[Gesture] = list(gestures)
        self.motion = Motion(rig, MotionKeys([(0, (place.x, place.y))], [(0, place.yaw)], **motion), seed)
        self.hip, self.turn = track(keys.hip), track(keys.turn)
        self.root_times = [key[0] for key in keys.root]
        self.roots = Rotation.from_matrix(np.stack([
            rotation('x', pitch) @ rotation('y', roll) @ rotation('z', spin) for _, (pitch, roll, spin) in keys.root]))
        self.feet = {side: track([(t, (*value, 0, 0)[:6]) for t, value in keys.feet.get(
            side, [(0, (0.13, 0.0, ANKLE, 0))])]) for side in 'LR'}
        self.knee, self.elbow = ({side: track(poles[side] if isinstance(poles, Mapping) else poles) for side in 'LR'}
                                 for poles in (keys.knee, keys.elbow))
        self.wrist = {side: track(values) for side, values in keys.wrist.items()}
        self.wrist_weight = {side: track(keys.wrist_weight.get(side, [(0, 1.0)])) for side in self.wrist}
        self.hand_keys = {side: [(t, hand_angles(name)) for t, name in keys.hands.get(side, [(0, 'relax')])]
                          for side in 'LR'}
        self.hand_direction = {side: [track([(key[0], key[j]) for key in values]) for j in (1, 2, 3)]
                               for side, values in keys.hand_direction.items()}

    def world(self, left: float, forward: float, up: float) -> np.ndarray:
        """Return a point of the stage frame in the world (3,)."""
        return np.array([self.place.x, self.place.y, 0]) + rotation('z', self.place.yaw) @ [left, -forward, up]

    def _root(self, t: float) -> np.ndarray:
        times = self.root_times
        if len(times) == 1 or t <= times[0]:
            return self.roots[0].as_matrix()
        if t >= times[-1]:
            return self.roots[len(times) - 1].as_matrix()
        i = int(np.searchsorted(times, t, 'right')) - 1
        share = smooth_step((t - times[i]) / (times[i + 1] - times[i]))
        return Slerp([0, 1], self.roots[[i, i + 1]])(share).as_matrix()

    def _fingers(self, side: str, t: float) -> np.ndarray:
        keys = self.hand_keys[side]
        i = max([j for j, (start, _) in enumerate(keys) if start <= t], default=0)
        if i + 1 == len(keys):
            return keys[i][1]
        share = smooth_step((t - keys[i + 1][0] + 0.18) / 0.18)  # the change takes 0.18 s before the next key
        return (1 - share) * keys[i][1] + share * keys[i + 1][1]

    def at(self, t: float) -> Pose:
        """Return the pose at t [s]."""
        pose, sway = self.motion.at(t), self.motion.sway
        left, forward, height = self.hip(t)
        hip = self.world(left + 0.6 * sway(9, t, 0.010), forward + sway(11, t, 0.006), height * self.rig.standing_hip)
        pose = pose._replace(
            x=hip[0], y=hip[1], hip_z=hip[2], root=self._root(t),
            yaw=self.place.yaw + float(self.turn(t)) + sway(10, t, 1.0),
            feet={side: self._foot(side, sign, t) for side, sign in SIDES},
            wrists={side: (self.world(*self.wrist[side](t) * [sign, 1, 1]), self.elbow[side](t),
                           float(self.wrist_weight[side](t))) for side, sign in SIDES if side in self.wrist},
            fingers={side: self._fingers(side, t) for side in 'LR'})
        pose = pose._replace(hands=self._hands(pose.yaw, t))
        for gesture in self.gestures:
            pose = make_gesture(self.rig, pose, gesture, t)
        return pose

    def _foot(self, side: str, sign: float, t: float) -> Foot:
        outward, forward, up, pitch, follows, bend = self.feet[side](t)
        return Foot(self.world(sign * outward, forward, up + self.sole), self.knee[side](t), float(pitch),
                    follows=float(follows), bend=float(bend))

    def _hands(self, yaw: float, t: float) -> Dict[str, Tuple[np.ndarray, np.ndarray, float]]:
        hands = {}
        for side, sign in SIDES:
            if side in self.hand_direction:
                fingers, palm, weight = (key(t) for key in self.hand_direction[side])
                hands[side] = (*(rotation('z', yaw) @ [sign * v[0], -v[1], v[2]] for v in (fingers, palm)),
                               float(weight))
        return hands

    def labels(self, t: float) -> List[Gesture]:
        """Return the gestures that are held at t."""
        return [gesture for gesture in self.gestures if gesture.start <= t <= gesture.end]
