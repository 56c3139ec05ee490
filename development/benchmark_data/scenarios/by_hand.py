"""Scenarios by hand: the sequence of the demo, and hands before the camera."""
import zlib
from typing import Any, Dict, List, Tuple

import numpy as np

from ..people.actor import Actor, ActorKeys, Place
from ..people.geometry import heading
from ..people.motion import Motion, MotionKeys, track
from ..people.rig import Pose, Rig
from ..rendering.camera import Camera
from ..rendering.depth_sensors import KinectV2
from ..rendering.renderer import Light
from ..rendering.room import Room
from ..sequence import Scene, fixed
from .cast import rig


def scene(name: str, room: Room, people: Tuple[List[Any], List[Any]], view: Camera, towards_light: Tuple[float, ...],
          **options: Any) -> Scene:
    """Return a scene of rigs and movers, seen by a camera that stays where it is."""
    return Scene(name, zlib.crc32(name.encode()) >> 4, room, *people, [fixed(view)], light=Light(towards_light),
                 **options)


def cross() -> Scene:
    """Two people walk past each other, at full resolution."""
    rigs = [rig('bea'), rig('ed')]
    keys = [MotionKeys([(0, (-1.85, 3.75)), (1.2, (-0.16, 3.68)), (1.75, (0.0, 3.67)), (2.8, (1.5, 3.6))],
                       [(0, heading(3.6, -0.2))], head_yaw=[(0, 0), (1, -25), (2, 0)]),
            MotionKeys([(0, (1.05, 2.55)), (1.0, (0.08, 1.98)), (1.7, (-0.08, 1.9)), (2.7, (-1.1, 2.25))],
                       [(0, -52), (0.8, -18), (1.6, -22), (2.2, heading(-1, 0.3))])]
    movers = [Motion(person, motion, seed) for person, motion, seed in zip(rigs, keys, (5, 6))]
    return scene('cross', Room(13, 5.6), (rigs, movers), Camera(KinectV2.intrinsics, 1.35, 5), (-0.2, -0.8, 0.9))


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
    return scene('hands', Room(37, 4.4), ([person], [actor]), Camera(KinectV2.intrinsics, 1.3, 2),
                 (-0.3, -0.8, 0.8), frames=44, hands=True)


SCENARIOS = {'cross': cross, 'hands': hands}
