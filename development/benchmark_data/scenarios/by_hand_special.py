"""Scenarios by hand of other kinds: floor, close contact, moving camera, several cameras, gestures, hands."""
from typing import Any, Dict, List, Tuple

import numpy as np

from ..people import acts
from ..people.actor import Actor, ActorKeys, Place
from ..people.geometry import heading
from ..people.gestures import Gesture
from ..people.motion import Motion, MotionKeys, track
from ..people.rig import Pose, Rig
from ..rendering.camera import Camera
from ..rendering.depth_sensors import KinectV2
from ..rendering.room import Room
from ..sequence import Scene, fixed
from . import by_hand
from .by_hand import camera, members, scene
from .cast import rig


def floor() -> Scene:
    """A person sits down on the floor, lies and gets up to kneeling; a second one comes and bends over."""
    patient, helper = rig('carl'), rig('dora')
    arms = {'R': [(0, 'down'), (1.0, 'bent'), (1.7, 'reach_down'), (2.6, 'reach_down'), (3.1, 'bent')],
                'L': [(0, 'down'), (1.1, 'open'), (1.8, 'reach_down'), (3.1, 'open')]}
    comes = Motion(helper, MotionKeys(
        [(0, (1.25, 4.15)), (1.0, (0.72, 3.52)), (3.1, (0.62, 3.45))],
        [(0, heading(-0.5, -0.6)), (1.1, -48), (3.1, -42)],
        arms, lean=[(0, 2), (1.1, 6), (1.8, 48), (2.6, 52), (3.1, 28)]), 62)
    lies = acts.lie_down(patient, Place(0.38, 2.75, 78), 61, -1)
    return scene('floor', Room(32, 5.6), ([patient, helper], [lies, comes]), camera(1.45, 15), frames=47,
                 towards_light=(-0.3, -0.7, 0.9))


def close() -> Scene:
    """Five people at 1.6 to 2.5 m: a hug, one behind a shoulder, one cut by the border, one who leaves and returns."""
    pair = rig('adam'), rig('bea')
    rigs, movers = members([
        ('hana', [(0, (-0.98, 2.45)), (3.2, (-0.92, 2.45))], [(0, 12), (1.6, 30), (3.2, 20)], 73,
         {'arms': {'R': [(0, 'cross')], 'L': [(0, 'cross')]}, 'head_yaw': [(0, 15), (1.5, -10), (3, 20)]}),
        ('gil', [(0, (-1.6, 1.72)), (3.2, (-1.52, 1.72))], [(0, 40), (3.2, 62)], 74,
         {'arms': {'L': [(0, 'bent'), (1.0, 'bent_up'), (2.2, 'open')], 'R': [(0, 'hip')]}}),
        ('ed', [(0, (1.6, 2.35)), (0.12, (1.69, 2.35)), (0.65, (2.55, 2.4)), (0.95, (2.78, 2.4)), (1.85, (2.78, 2.35)),
                (2.2, (2.58, 2.3)), (2.95, (1.5, 2.15)), (3.15, (1.36, 2.14))],
         [(0, 75), (0.2, 88), (1.1, 90), (1.7, -86), (2.8, -83), (3.2, -60)], 75, {})])
    return scene('close', Room(33, 5.0), ([*pair, *rigs], [*acts.shake_and_hug(pair, (-0.25, 1.95), 71), *movers]),
                 camera(1.45, 8), frames=46, towards_light=(-0.2, -0.8, 0.9))


def robot() -> Scene:
    """The camera moves about 1 m and turns 26 degrees; one person stands, one walks past behind."""
    frames = 37

    def at(i: int) -> Camera:
        share = i / (frames - 1)
        share = share * share * (3 - 2 * share)
        return camera(1.08 + 0.004 * np.sin(i * 1.1), 3 + 0.35 * np.sin(i * 0.9 + 0.5), x=0.1 - 0.42 * share,
                      y=-0.45 + 0.95 * share, yaw=11 - 26 * share + 0.25 * np.sin(i * 0.7))

    people = members([
        ('dora', [(0, (0.55, 3.35))], [(0, -10), (2.7, 8)], 81, {'arms': {
            'R': [(0, 'bent'), (0.9, 'lowwave_out'), (1.3, 'lowwave_in'), (1.8, 'bent_up')], 'L': [(0, 'hip')]}}),
        ('gil', [(0, (-1.9, 4.3)), (2.7, (1.35, 4.15))], [(0, heading(3.2, -0.15))], 82, {})])
    return scene('robot', Room(34, 6.2, -3.8, 3.8), people, cameras=[at], moving=True, frames=frames,
                 towards_light=(-0.3, -0.7, 0.9))


def stage() -> Scene:
    """Three people who cross each other, seen from the front and from both sides."""
    def around(degrees: float, distance: float, view: Tuple[float, float], model: Any = KinectV2.intrinsics) -> Camera:
        angle = np.deg2rad(degrees)
        return Camera(model, *view, -distance * np.sin(angle), 3.1 - distance * np.cos(angle), -degrees)

    people = members([
        ('adam', [(0, (-1.25, 3.75)), (1.3, (-0.1, 2.95)), (2.6, (1.05, 2.35))], [(0, heading(1.2, -0.75))], 91, {}),
        ('dora', [(0, (1.2, 3.5)), (1.3, (0.15, 3.65)), (2.6, (-1.15, 3.0))],
         [(0, heading(-1.05, 0.1)), (1.3, heading(-1.2, -0.3)), (2.6, heading(-1.2, -0.6))], 92,
         {'arms': {'R': [(0, 'down'), (1.3, 'bent_up'), (2.2, 'down')], 'L': [(0, 'phone')]}}),
        ('carl', [(0, (-0.55, 2.25))], [(0, 150), (1.3, 185), (2.6, 215)], 93, {'arms': {
            'R': [(0, 'bent'), (1.0, 'point_fwd'), (1.8, 'open')], 'L': [(0, 'hip'), (1.6, 'hip'), (2.3, 'bent')]}})])
    model = KinectV2.intrinsics
    cameras = [around(0, 3.1, (1.7, 9)),
               around(70, 3.3, (1.25, 4), model._replace(fx=545.1, fy=545.1, cx=477.2, cy=271.4)),
               around(-70, 3.25, (2.15, 17), model._replace(fx=536.9, fy=536.9, cx=482.6, cy=266.8))]
    room = Room(35, 6.2, -4.1, 4.1)
    room.front_wall()
    return scene('stage', room, people, cameras=[fixed(view) for view in cameras], frames=22, fps=10.0,
                 towards_light=(-0.2, -0.7, 1.0))


def signals() -> Scene:
    """Two people with labelled gestures: wave, point at five targets, raise_hand, arms_crossed, beckon, sit, stand."""
    room, targets = Room(36, 5.2, -3.2, 3.2), {}
    for name, place, size, color in (
            ('red', (-2.08, 2.55, 1.15), 0.16, (220, 40, 36)), ('yellow', (0.12, 2.3, 0.8), 0.15, (236, 206, 40)),
            ('blue', (1.92, 2.3, 1.25), 0.16, (40, 70, 220)), ('green', (0.05, 1.95, 0.1), 0.18, (50, 190, 70)),
            ('white', (2.1, 2.85, 2.1), 0.17, (240, 240, 240))):
        room.target(place, size, color)
        targets[name] = np.array(place)

    def point(start: float, end: float, arm: str, name: str, style: str) -> Gesture:
        return Gesture(start, end, 'point', arm, target=tuple(targets[name]), target_name=name, style=style)

    def person(name: str, place: Place, sits: List[Tuple[float, float]], arms: Any, gestures: List[Gesture]
               ) -> Tuple[Rig, Actor]:
        body = rig(name)
        actor = acts.sit(body, place, 101 + len(name), sits, arms={'R': arms, 'L': arms}, gestures=gestures)
        room.chair(*acts.seat_of(actor), place.yaw)
        return body, actor

    people = [
        person('adam', Place(-1.05, 2.75, 8), [(5.15, 60)], [(0, 'down'), (4.6, 'down'), (5.2, 'lap')], [
            Gesture(0.3, 1.05, 'wave', 'R', 2.2), point(1.5, 2.1, 'R', 'red', 'eye'),
            point(2.55, 3.15, 'L', 'blue', 'eye'),
            Gesture(3.55, 4.3, 'arms_crossed'), point(5.3, 5.9, 'L', 'green', 'eye')]),
        person('dora', Place(1.1, 2.85, -12), [(-1, 1.3)], [(0, 'lap'), (1.3, 'lap'), (1.8, 'down')], [
            Gesture(0.35, 0.95, 'raise_hand', 'L'), point(2.05, 2.65, 'R', 'yellow', 'shoulder'),
            Gesture(3.05, 3.85, 'beckon', 'R', 2.2), point(4.3, 4.85, 'L', 'white', 'shoulder'),
            Gesture(5.25, 5.95, 'wave', 'L', 2.4)])]
    return scene('signals', room, ([body for body, _ in people], [actor for _, actor in people]), camera(1.35, 7),
                 frames=61, fps=10.0, targets=targets, towards_light=(-0.25, -0.8, 0.9))


class HandActor(Actor):
    """Holds both hands at places with orientations: keys (t, place, finger direction, palm normal) in the world."""

    def __init__(self, person: Rig, place: Place, keys: Dict[str, List[Tuple[Any, ...]]], actor: ActorKeys, seed: int,
                 **motion: Any) -> None:
        super().__init__(person, place, actor, seed, **motion)
        self.keys = {side: [track([(key[0], key[j]) for key in keys[side]]) for j in (1, 2, 3)] for side in 'LR'}

    def at(self, t: float) -> Pose:
        pose, sway = super().at(t), self.motion.sway
        wrists, hands = {}, {}
        for side in 'LR':
            place, fingers, palm = (key(t) for key in self.keys[side])
            jitter = np.array([sway(2 + (side == 'L'), t, 0.006), sway(4, t, 0.006), sway(6 + (side == 'L'), t, 0.005)])
            wrists[side] = (place + jitter, np.array([0.75, -0.15, -1.0]), 1.0)
            hands[side] = (fingers, palm, 1.0)
        return pose._replace(wrists=wrists, hands=hands)


def hands() -> Scene:
    """One person at 1.3 m: both hands open, fist, pinch, counting, thumb up, one before the other."""
    up, front = (0, -0.15, 1), (0, -1, 0.05)
    keys = {
        'R': [(0, (-0.25, 0.93, 1.17), up, front), (0.75, (-0.22, 0.92, 1.18), (0.1, -0.2, 1), front),
           (1.05, (-0.23, 0.94, 1.16), (0.85, -0.6, 0.35), (0.25, -0.1, -1)),
           (1.3, (-0.21, 0.93, 1.18), (0.1, -0.15, 1), front), (2.05, (-0.2, 0.92, 1.17), (0.05, -0.15, 1), front),
           (2.2, (-0.2, 0.92, 1.16), (0.8, -0.5, 0.1), (0.5, 0.8, 0)),
           (2.5, (-0.06, 0.95, 1.18), (0.35, -0.2, 1), (0.3, -1, 0.1)),
           (2.8, (0.01, 0.96, 1.18), (0.2, -0.15, 1), front)],
        'L': [(0, (0.23, 0.95, 1.16), up, front), (0.9, (0.21, 0.93, 1.18), (-0.1, -0.2, 1), front),
           (1.25, (0.22, 0.93, 1.14), (-0.8, -0.5, 0.1), (-0.5, 0.8, 0)),
           (1.6, (0.21, 0.92, 1.14), (-0.8, -0.5, 0.1), (-0.5, 0.8, 0)),
           (1.9, (0.2, 0.93, 1.17), (-0.6, -0.5, 0.7), (-0.6, -0.2, -0.6)),
           (2.1, (0.2, 0.9, 1.16), (-0.1, -0.2, 1), (0.1, 1, 0.1)),
           (2.42, (0.05, 0.85, 1.15), (-0.35, -0.15, 1), (0.1, 1, 0.1)),
           (2.8, (0.0, 0.85, 1.16), (-0.1, -0.15, 1), (0.0, 1, 0.15))]}
    fingers = {
        'R': [(0, 'open'), (0.45, 'fist'), (0.75, 'fist'), (0.95, 'pinch'), (1.2, 'count1'), (1.4, 'count2'),
              (1.6, 'count3'),
           (1.8, 'count4'), (2.0, 'count5'), (2.2, 'thumb_up'), (2.5, 'open')],
        'L': [(0, 'fist'), (0.4, 'open'), (0.8, 'count2'), (1.1, 'fist'), (1.25, 'thumb_up'), (1.75, 'relax'),
              (1.85, 'pinch'),
           (2.1, 'open'), (2.5, 'count5')]}
    person = rig('bea')
    actor = HandActor(person, Place(0, 1.32, 0), keys, ActorKeys(hands=fingers), 111,
                      head_pitch=[(0, 4), (1.5, 10), (2.8, 2)], head_yaw=[(0, 0), (1.0, -12), (1.9, 12), (2.8, 0)])
    return scene('hands', Room(37, 4.4), ([person], [actor]), camera(1.3, 2), frames=44, hands=True,
                 towards_light=(-0.3, -0.8, 0.8))


SCENARIOS = {build.__name__: build for build in (
    by_hand.wave, by_hand.turn, by_hand.cross, by_hand.group, by_hand.furniture, by_hand.crowd, floor, close, robot,
    stage,
    signals, hands)}
