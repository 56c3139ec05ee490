"""One person over time: from joints to signals."""
from collections import deque
from typing import Deque, List, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_signals import motion
from openpose_ros_signals.constants import SIGNALS, SignalConstants
from openpose_ros_signals.geometry import Body, body_of, least, ramp, stature_of, unit, unless_hidden
from openpose_ros_signals.gestures import ARM_GESTURES, Arm, Palm, View, arm_degrees, arm_of, crossed_degree
from openpose_ros_signals.holding import Held
from openpose_ros_signals.pointing import pointing_of, with_targets
from openpose_ros_signals.postures import posture_degrees
from openpose_ros_signals.records import (
    BOTH,
    LEFT,
    POSTURES,
    RIGHT,
    UNKNOWN,
    Facing,
    Gesture,
    PersonSignals,
    Pointing,
    Posture,
    Target,
    Walk,
)

SIDES = (LEFT, RIGHT)


class Surroundings(NamedTuple):
    """What is around people."""

    targets: Tuple[Target, ...] = ()  # of pointing
    floor: Optional[np.ndarray] = None  # (4,) plane a, b, c, d: a x + b y + c z + d = 0; (a, b, c) of length 1, upwards


class BodyObservation(NamedTuple):
    """A person of a frame."""

    joints: Tuple[np.ndarray, np.ndarray, np.ndarray]  # of one person, see `geometry.told_joints`
    trunk: np.ndarray  # (3, 3) axes of the neck, see `joint_frames`
    head: np.ndarray  # (3, 3) axes of the nose
    palms: Tuple[Optional[Palm], Optional[Palm]] = (None, None)  # of the left and the right hand
    face: Optional[Facing] = None  # where the head faces by its face


class Person:
    """A person over time; `since` and `stamp`: when it was seen first and last [s]."""

    def __init__(self, since: float, constants: SignalConstants = SIGNALS) -> None:
        self._constants = constants
        self.since = self.stamp = since
        self._stature = constants.body.adult_stature
        self._statures: Deque[float] = deque(maxlen=constants.person.statures)
        self._bodies: Deque[Body] = deque()
        self._arms: Tuple[Deque[Arm], Deque[Arm]] = (deque(), deque())
        hold = constants.hold
        # no other posture is like lying
        self._postures = {name: Held(hold, at_once=name == 'lying') for name in POSTURES}
        # all of them look back: at a motion to and fro, or at a tenth of a second
        self._gestures = [{one.name: Held(hold, 0.0) if one.is_swing else Held(hold, at_once=True)
                           for one in ARM_GESTURES} for _ in SIDES]
        self._crossed = Held(hold, constants.gesture.cross_time, at_once=True)
        self._moving, self._falls = Held(hold), motion.FallWatch(constants.motion)
        self._rays: List[Tuple[float, Optional[Pointing]]] = [(-np.inf, None)] * 2

    def read(self, name: int, stamp: float, seen: BodyObservation, up: np.ndarray, around: Surroundings
             ) -> PersonSignals:
        """Return what the person with an id does at a time [s]; `up` (3,) is a unit vector."""
        body = self._body(stamp, seen, up)
        posture = self._posture(body)
        self._falls.watch(body, posture.name, posture.since)
        gestures = self._all_gestures(body, seen, around)
        trunk = motion.facing_of(body, seen.trunk, head=False)
        head = seen.face or motion.facing_of(body, seen.head, head=True)
        hidden = tuple(side for side, arms in zip(SIDES, self._arms) if not arms[-1].known)
        walk = self._walk(body)
        forward = motion.level_direction(body, trunk, walk, self._constants.floor)
        place = motion.place_of(body, seen.joints[0])
        floor = None if place is None else motion.floor_pose(place, motion.height_over_floor(
            body, place, posture.name == 'lying', around.floor, self._constants), forward, body.up)
        position = body.place if place is None else place
        return PersonSignals(name, position, posture, gestures, trunk, head, walk, self._falls.fall, hidden, floor)

    def _body(self, stamp: float, seen: BodyObservation, up: np.ndarray) -> Body:
        constants = self._constants.person
        stature = stature_of(*seen.joints[:2], constants, self._constants.body)
        if np.isfinite(stature):
            self._statures.append(stature)
            self._stature = float(np.median(np.array(self._statures)))
        body = body_of(stamp, seen.joints, up, self._stature, constants)
        self.stamp = stamp
        self._bodies.append(body)
        for side, arms in enumerate(self._arms):
            arms.append(arm_of(body, side))
        while self._bodies[0].stamp < stamp - 2 * self._constants.swing.pause:
            self._bodies.popleft()
            for arms in self._arms:
                arms.popleft()
        return body

    def _posture(self, body: Body) -> Posture:
        degrees = posture_degrees(body, self._constants.posture)
        for name, held in self._postures.items():
            held.take(body.stamp, degrees[name])
        on = [name for name, held in self._postures.items() if held.on]
        if not on:
            return Posture(UNKNOWN)
        name = max(on, key=lambda one: self._postures[one].since)
        return Posture(name, self._postures[name].since, self._postures[name].confidence)

    def _all_gestures(self, body: Body, seen: BodyObservation, around: Surroundings) -> Tuple[Gesture, ...]:
        constants = self._constants
        crossed = crossed_degree(self._arms[0][-1], self._arms[1][-1], body, constants.gesture)
        sure = all(arms[-1].sure for arms in self._arms)
        self._crossed.take(body.stamp, crossed if sure else least(crossed, constants.hold.sure))
        free, up = unless_hidden(1 - crossed), 0.0 if self._postures['lying'].on else 1.0
        found = []
        for side, arm in enumerate(SIDES):
            degrees = arm_degrees(View(list(self._arms[side]), self._arms[1 - side][-1], seen.palms[side], body,
                                       constants.gesture, constants.swing))
            for one in ARM_GESTURES:
                self._gestures[side][one.name].take(
                    body.stamp, least(degrees[one.name], free, 1.0 if one.also_lying else up))
            found += [Gesture(name, arm, held.since, held.confidence,
                              self._pointing(side, body, degrees['point'], around) if name == 'point' else None)
                      for name, held in self._gestures[side].items() if held.on]
        if self._crossed.on:
            found.append(Gesture('arms_crossed', BOTH, self._crossed.since, self._crossed.confidence))
        return tuple(found)

    def _pointing(self, side: int, body: Body, degree: float, around: Surroundings) -> Optional[Pointing]:
        """Return the ray; for a moment after arm or head are hidden or the arm leaves, the last one of the gesture."""
        constants, hold = self._constants.pointing, self._constants.hold
        ray = pointing_of(body, side, constants)
        if ray is None or not degree >= hold.unsure:
            stamp, last = self._rays[side]
            return last if stamp >= max(self._gestures[side]['point'].since, body.stamp - hold.hidden) else None
        pointing = with_targets(ray, around.targets, constants)
        self._rays[side] = body.stamp, pointing
        return pointing

    def _walk(self, body: Body) -> Optional[Walk]:
        velocity = motion.floor_velocity(self._bodies, self._constants.motion)
        if velocity is None:
            self._moving.take(body.stamp, np.nan)
            return None
        speed = float(np.linalg.norm(velocity))
        self._moving.take(body.stamp, ramp(speed / body.stature, self._constants.motion.moving))
        moving = self._moving.on
        return Walk(moving, speed, unit(velocity) if moving else np.zeros(3))
