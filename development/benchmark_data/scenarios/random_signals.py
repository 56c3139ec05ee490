"""Random scenes with labelled gestures, and random scenes seen by three cameras at once."""
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from ..people import acts
from ..people.actor import Actor, Place
from ..people.contact import sample_times
from ..people.geometry import heading
from ..people.gestures import RAMP, Gesture
from ..rendering.camera import Camera
from ..rendering.depth_sensors import SENSORS
from ..sequence import Scene, fixed
from .actions import Stage, stand, walk_somewhere
from .plan import Plan, describe
from .random_scenes import arranged, cameras_of, check, check_conflict, unseen

RATE = 10.0  # [Hz] of both kinds
SIGNAL_FRAMES, STAGE_FRAMES = 61, 30
SIGNAL_TIME = (SIGNAL_FRAMES - 1) / RATE  # [s]
ONE_HANDED = ('wave', 'beckon', 'point', 'raise_hand')
TARGET_COLORS = {'red': (220, 40, 36), 'yellow': (236, 206, 40), 'blue': (40, 70, 220), 'green': (50, 190, 70),
                     'white': (240, 240, 240)}
POINTING_ANGLES = (-15.0, 70.0)  # [deg] of a target from straight ahead, outward


class Signaller(NamedTuple):
    """A person who makes gestures: where, and which lines the pointing arm is held on."""

    place: Place
    style: str


# ---- gestures ------------------------------------------------------------------------------------------------------

def build_signals(plan: Plan) -> Scene:
    """Build one or two people who make gestures for six seconds, stand and sit; see `arranged`."""
    return arranged(plan, _signals)


def _signals(stage: Stage) -> Scene:
    plan, times = stage.plan, sample_times(SIGNAL_TIME, 25)
    signallers = [Signaller(_facing_camera(stage, k), str(stage.rng.choice(['shoulder', 'eye'])))
                  for k in range(len(stage.rigs))]
    targets = _targets(stage, signallers)
    for signaller in signallers:
        stage.movers.append(_signal(stage, signaller, targets))
    check_conflict(stage, times)
    cameras = cameras_of(stage, times)
    check(unseen(stage, cameras, times))
    return Scene(plan.name, plan.seed[0] * 1000 + plan.seed[1], stage.room, stage.rigs, stage.movers, cameras,
                 sensor=plan.view.sensor, frames=SIGNAL_FRAMES, fps=RATE, light=plan.light, exposure=plan.exposure,
                 targets=targets, description=describe(plan))


def _facing_camera(stage: Stage, k: int) -> Place:
    x, y = stage.place(2.4, 3.4, 1.5, 0.6)
    return Place(x, y, float(np.clip(stage.rng.normal(-15 * np.sign(x), 18), -45, 45)))


def _targets(stage: Stage, signallers: Sequence[Signaller]) -> Dict[str, np.ndarray]:
    """Put five bright boxes into the room, beside the people and before them."""
    rng, targets = stage.rng, {}
    for name, color in TARGET_COLORS.items():
        for _ in range(100):
            place = rng.uniform([-2.3, 1.5, 0.1], [2.3, 3.3, 2.1])
            if all(np.hypot(*(place[:2] - signaller.place[:2])) > 0.95 for signaller in signallers) and \
                    all(np.hypot(*(place[:2] - other[:2])) > 0.5 for other in targets.values()):
                break
        else:
            raise ValueError('no place for a target')
        targets[name] = np.round(place, 3)
        stage.room.target(targets[name], rng.uniform(0.13, 0.18), color)
    return targets


def _signal(stage: Stage, signaller: Signaller, targets: Dict[str, np.ndarray]) -> Actor:
    """Return a person who makes gestures one after the other; two thirds also sit down or rise."""
    rng, place = stage.rng, signaller.place
    rig = stage.rigs[len(stage.movers)]
    when = rng.uniform(1.3, 4.8)
    intervals = [[], [(-1.0, when)], [(when, 60.0)]][int(rng.integers(0, 3))]
    busy = [(when - acts.RISE - RAMP, when + RAMP) if intervals[0][1] > 10 else (when - RAMP, when + acts.RISE + RAMP)
            ] if intervals else []
    gestures: List[Gesture] = []
    deck: List[str] = []
    start = rng.uniform(0.3, 0.6)
    while start < SIGNAL_TIME - 0.5:
        duration = rng.uniform(0.6, 1.1)
        end = min(start + duration, SIGNAL_TIME)
        clash = [stop for begin, stop in busy if start < stop and end > begin]
        if clash:
            start = max(clash)
            continue
        deck = deck or [str(name) for name in rng.permutation([*ONE_HANDED, 'point', 'point', 'arms_crossed'])]
        gestures.append(_gesture(stage, signaller, targets, (start, end, deck.pop())))
        start = end + rng.uniform(0.65, 0.95)
    arms = _rest_of_arms(intervals, when)
    actor = acts.sit(rig, place, stage.seed(), intervals, arms={'R': arms, 'L': arms}, gestures=gestures)
    if intervals:
        stage.room.chair(*acts.seat_of(actor), place.yaw)
    return actor


def _rest_of_arms(intervals: Sequence[Tuple[float, float]], when: float) -> List[Tuple[float, str]]:
    if not intervals:
        return [(0, 'down')]
    if intervals[0][1] > 10:
        return [(0, 'down'), (when - acts.RISE, 'down'), (when, 'lap')]
    return [(0, 'lap'), (when, 'lap'), (when + acts.RISE, 'down')]


def _gesture(stage: Stage, signaller: Signaller, targets: Dict[str, np.ndarray], slot: Tuple[float, float, str]
             ) -> Gesture:
    rng, (start, end, label) = stage.rng, slot
    arm = str(rng.choice(['R', 'R', 'L']))
    if label == 'point':
        able = [(name, side) for name in targets for side in 'LR'
                if POINTING_ANGLES[0] < _outward_angle(signaller.place, targets[name], side) < POINTING_ANGLES[1]]
        if not able:
            raise ValueError('no target in reach')
        name, arm = able[int(rng.integers(0, len(able)))]
        return Gesture(start, end, label, arm, target=tuple(targets[name].tolist()), target_name=name,
                       style=signaller.style)
    return Gesture(start, end, label, arm, rate=rng.uniform(1.6, 2.6), size=rng.uniform(0.8, 1.1))


def _outward_angle(place: Place, target: np.ndarray, side: str) -> float:
    """Return the angle of a target from straight ahead, positive on that side [deg]."""
    angle = (heading(target[0] - place.x, target[1] - place.y) - place.yaw + 180) % 360 - 180
    return float(angle if side == 'L' else -angle)


# ---- several cameras -----------------------------------------------------------------------------------------------

def build_stage(plan: Plan) -> Scene:
    """Build three or four people who walk and stand, seen from the front and from both sides; see `arranged`."""
    return arranged(plan, _stage)


def _stage(stage: Stage) -> Scene:
    plan, times = stage.plan, sample_times((STAGE_FRAMES - 1) / RATE)
    for k in range(len(stage.rigs)):
        (walk_somewhere if k < 2 else stand)(stage)
    check_conflict(stage, times)
    stage.room.front_wall()
    cameras = _around(stage)
    for camera in cameras:
        check('' if stage.room.contains(camera.origin, 0.1) else 'a camera is outside')
        check(unseen(stage, [fixed(camera)], times))
    return Scene(plan.name, plan.seed[0] * 1000 + plan.seed[1], stage.room, stage.rigs, stage.movers,
                 [fixed(camera) for camera in cameras], sensor=plan.view.sensor, frames=STAGE_FRAMES, fps=RATE,
                 light=plan.light, exposure=plan.exposure, description=describe(plan))


def _around(stage: Stage) -> List[Camera]:
    """Return three cameras, each with intrinsics of its own, that look at (0, 3.1)."""
    rng, cameras = stage.rng, []
    base: Any = SENSORS[stage.plan.view.sensor].intrinsics
    for degrees in (0.0, 70.0, -70.0):
        bearing, distance = degrees + rng.uniform(-12, 12), rng.uniform(3.1, 3.6)
        height = rng.uniform(0.9, 2.2)
        focal = base.fx * rng.uniform(0.985, 1.015)
        intrinsics = base._replace(fx=focal, fy=focal, cx=base.cx + rng.uniform(-4, 4), cy=base.cy + rng.uniform(-4, 4))
        angle = np.deg2rad(bearing)
        cameras.append(Camera(intrinsics, height, float(np.rad2deg(np.arctan2(height - 0.9, distance))),
                              -distance * np.sin(angle), 3.1 - distance * np.cos(angle), -bearing))
    return cameras
