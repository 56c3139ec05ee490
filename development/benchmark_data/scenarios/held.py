"""Sequences of people who hold something before them: a sheet of cloth, a box, a tray, the handle of a trolley."""
from functools import partial
from typing import Any, Callable, Dict, NamedTuple, Tuple

from ..people.held import Holder
from ..people.motion import Keys, Motion, MotionKeys, walk
from ..rendering.camera import Camera
from ..rendering.depth_sensors import SENSORS
from ..rendering.room import Room
from ..sequence import Scene
from .by_hand import scene
from .cast import rig

FRAMES = 50


class Plan(NamedTuple):
    """Member of the cast, thing, motion, and places of the hands, see `Holder`; sensor and height of the camera [m]."""

    member: str
    thing: str
    motion: MotionKeys
    hands: Tuple[Keys, ...]
    sensor: str
    height: float


def _before(outward: float, forward: float, *ups: float) -> Tuple[Keys, ...]:
    """Return hands that are before the body at heights that follow each other within the sequence."""
    return ([(3.3 * k / max(len(ups) - 1, 1), (outward, forward, up)) for k, up in enumerate(ups)],)


def _stand(x: float, y: float, *yaws: float, **more: Any) -> MotionKeys:
    return MotionKeys([(0, (x, y))], [(3.3 * k / max(len(yaws) - 1, 1), yaw) for k, yaw in enumerate(yaws)], **more)


PLANS: Dict[str, Plan] = {
    'held_shirt': Plan('finn', 'shirt', _stand(0.1, 2.2, 0, 22, -18, 5, head_pitch=[(0, 14), (2, 2)]),
                       _before(0.27, 0.33, 0.76, 0.82, 0.72, 0.79), 'xtion', 1.3),
    'held_shirt_high': Plan('gil', 'shirt', _stand(-0.2, 2.3, 8, -8, 0), _before(0.26, 0.30, 0.78, 0.98, 0.80, 1.0),
                            'kinect_v2', 1.2),
    'held_shirt_beside': Plan(
        'adam', 'shirt', _stand(0.2, 2.1, -10, 10), (
            [(0, (0.55, 0.30, 0.80)), (1.6, (0.27, 0.34, 0.79)), (3.3, (-0.02, 0.36, 0.80))],
            [(0, (-0.02, 0.36, 0.80)), (1.6, (0.27, 0.34, 0.79)), (3.3, (0.55, 0.30, 0.80))]), 'realsense', 1.4),
    'held_towel': Plan('hana', 'towel', MotionKeys(walk([(-0.9, 3.3), (0.2, 2.4)], 0.5),
                                                   [(0, 40), (2.0, 20), (3.3, -30)]),
                       _before(0.36, 0.34, 0.74, 0.80), 'kinect_v2', 1.5),
    'held_box': Plan('ed', 'box', _stand(0.0, 2.4, 0, 75, 0, -75), _before(0.225, 0.34, 0.52, 0.62), 'xtion', 1.1),
    'held_box_walk': Plan('carl', 'box', MotionKeys(walk([(-1.5, 3.4), (1.1, 2.9)], 0.8), [(0, 75), (3.3, 60)]),
                          _before(0.225, 0.32, 0.58), 'realsense', 0.9),
    'held_tray': Plan('bea', 'tray', MotionKeys(walk([(0.4, 4.0), (-0.2, 2.0)], 0.7), [(0, 15), (2.5, 15), (3.3, 50)]),
                      _before(0.225, 0.34, 0.64, 0.66), 'kinect_v2', 1.7),
    'held_trolley': Plan('dora', 'trolley', MotionKeys(walk([(1.3, 4.3), (0.1, 3.1), (-0.6, 2.8)], 0.7),
                                                       [(0, -40), (2.0, -45), (3.3, -80)], lean=[(0, 8)]),
                         _before(0.22, 0.40, 0.58), 'xtion', 1.4)}


def _scene(name: str, plan: Plan) -> Scene:
    person = rig(plan.member)
    number = list(PLANS).index(name)
    holder = Holder(person, Motion(person, plan.motion, 400 + number), plan.thing, *plan.hands)
    view = Camera(SENSORS[plan.sensor].intrinsics, plan.height, 6)
    return scene(name, Room(80 + number, 5.2), ([person], [holder]), view, (-0.3, -0.8, 0.9), sensor=plan.sensor,
                 frames=FRAMES)


SCENARIOS: Dict[str, Callable[[], Scene]] = {name: partial(_scene, name, plan) for name, plan in PLANS.items()}
