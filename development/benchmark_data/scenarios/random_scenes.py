"""Random scenes from a plan: people are arranged, furniture and cameras placed, until nothing is in each other."""
from typing import Callable, Dict, List, Sequence, Tuple

import numpy as np

from ..people import acts
from ..people.actor import Actor, Place
from ..people.body import Body
from ..people.contact import bone_points, check_contact
from ..people.geometry import heading
from ..people.gestures import RAMP, Gesture
from ..people.rig import Rig
from ..rendering.camera import Camera
from ..sequence import FPS, Scene, fixed
from .actions import ACTIONS, DURATION, FRAMES, OTHERS, Stage, stand, walk_somewhere
from .plan import Plan, describe, own_intrinsics

ATTEMPTS = 60
NEAREST_JOINT = 0.9  # [m] from the camera
# Frames, rate [Hz] and checked times of special kinds of scenes; of others.
RATE, SIGNAL_FRAMES = 10.0, 61
LENGTHS = {'signals': (SIGNAL_FRAMES, RATE, 25), 'stage': (30, RATE, 12)}
LENGTH = (FRAMES, FPS, 12)
SIGNAL_TIME = (SIGNAL_FRAMES - 1) / RATE  # [s]
ONE_HANDED = ('wave', 'beckon', 'point', 'raise_hand')
TARGET_COLORS = {'red': (220, 40, 36), 'yellow': (236, 206, 40), 'blue': (40, 70, 220), 'green': (50, 190, 70),
                 'white': (240, 240, 240)}
POINTING_ANGLES = (-15.0, 70.0)  # [deg] of a target from straight ahead, outward


class ArrangementError(RuntimeError):
    """No attempt gave a scene."""


def build_scene(plan: Plan) -> Scene:
    """Return the first scene in which no two people, and no person and furniture, are in each other, and all are seen.

    Raises:
        ArrangementError: no arrangement was found.
    """
    rigs = [Rig(Body(person)) for person in plan.people]
    problem = ''
    for attempt in range(ATTEMPTS):
        try:
            return _scene(Stage(plan, rigs, np.random.default_rng((*plan.seed, 1, attempt))))
        except ValueError as error:
            problem = str(error)
    raise ArrangementError(f'{plan.name}: no arrangement in {ATTEMPTS} attempts; the last: {problem}')


def _scene(stage: Stage) -> Scene:
    """Arrange people, furniture and cameras; ValueError: that is no scene."""
    plan, targets = stage.plan, None
    frames, fps, count = LENGTHS.get(plan.kind, LENGTH)
    # nearly the last of 40 frames, as the seeds of the sets were drawn
    times = np.linspace(0, DURATION if plan.kind not in LENGTHS else (frames - 1) / fps, count).tolist()
    if plan.kind == 'signals':
        targets = _arrange_signallers(stage)
    elif plan.kind == 'stage':
        for k in range(len(stage.rigs)):
            (walk_somewhere if k < 2 else stand)(stage)
    else:
        ACTIONS[plan.kind](stage)
        while len(stage.movers) < len(stage.rigs):
            OTHERS[int(stage.rng.integers(0, len(OTHERS)))](stage)
        _add_furniture(stage)
    check_contact(stage.rigs, stage.movers, stage.room.boxes, times, stage.touching)
    cameras = _cameras_around(stage) if plan.kind == 'stage' else cameras_of(stage, times)
    check_seen(stage, cameras, times)
    return Scene(plan.name, plan.seed[0] * 1000 + plan.seed[1], stage.room, stage.rigs, stage.movers, cameras,
                 moving=plan.view.moving, sensor=plan.view.sensor, frames=frames, fps=fps, light=plan.light,
                 exposure=plan.exposure, targets=targets, description=describe(plan))


def _add_furniture(stage: Stage) -> None:
    """In half of the scenes, put a table, counter, chair or box somewhere, often before people."""
    rng = stage.rng
    for _ in range(int(rng.choice([0, 0, 1, 2]))):
        y = rng.uniform(1.6, 3.4)
        x = rng.uniform(-0.7, 0.7) * stage.plan.view.tangent * y
        if stage.plan.kind in ('lie', 'kneel') and any(y < b and abs(x / y - a / b) < 0.3 for a, b in stage.taken):
            continue  # it would hide a person on the floor
        style = int(rng.integers(0, 3))
        if style == 0:
            stage.room.table(x, y, (rng.uniform(0.8, 1.6), rng.uniform(0.5, 0.7), rng.uniform(0.7, 0.95)),
                             rng.uniform(-30, 30), solid=bool(rng.random() < 0.5))
        elif style == 1:
            stage.room.chair(x, y, rng.uniform(-180, 180))
        else:
            stage.room.box((x, y, 0), rng.uniform([0.3, 0.3, 0.4], [0.8, 0.6, 1.2]),
                           stage.room.plain(rng.uniform(40, 200, 3)), rng.uniform(-45, 45))
            stage.room.notes.append(f'box at ({x:.2f},{y:.2f})')


def cameras_of(stage: Stage, times: Sequence[float]) -> List[Callable[[int], Camera]]:
    """Return the camera, which looks at the people; a moving one goes sideways and turns, with the shake of a hand."""
    rng, view = stage.rng, stage.plan.view
    joints = np.array([rig.pose(mover.at(t)).joints for rig,
                       mover in zip(stage.rigs, stage.movers) for t in times[::4]])
    x, y, z = np.median(joints.reshape(-1, 3), axis=0)
    pitch = np.rad2deg(np.arctan2(view.height - 0.5 * (z + 0.85), max(y, 1.5))) + rng.normal(0, 2.5)
    yaw = -np.rad2deg(np.arctan2(x, y)) * 0.7 + rng.normal(0, 3)
    if not view.moving:
        return [fixed(Camera(view.intrinsics, view.height, pitch, 0, 0, yaw))]
    shift, turn, shake = rng.uniform(-0.35, 0.35, 2), rng.uniform(-12, 12), rng.uniform(0, 0.5)
    phases = rng.uniform(0, 2 * np.pi, 3)

    def at(i: int) -> Camera:
        share = i / FRAMES
        share = share * share * (3 - 2 * share) - 0.5
        waves = shake * np.sin(i * np.array([1.1, 0.9, 0.7]) + phases)
        return Camera(view.intrinsics, view.height + 0.008 * waves[0], pitch + waves[1],
                      shift[0] * share, shift[1] * share, yaw + turn * share + waves[2])

    return [at]


def check_seen(stage: Stage, cameras: Sequence[Callable[[int], Camera]], times: Sequence[float]) -> None:
    """Raise ValueError where a person is too near to a camera, or hardly seen by one."""
    for camera_at in cameras:
        seen = np.zeros(len(stage.rigs))
        for t in times:
            camera = camera_at(int(t * FPS))
            joints = [rig.pose(mover.at(t)).joints for rig, mover in zip(stage.rigs, stage.movers)]
            if min(camera.to_camera(points)[:, 2].min() for points in joints) < NEAREST_JOINT:
                raise ValueError('a person is too near')
            bodies = [bone_points(points, rig.body.stature) for points, rig in zip(joints, stage.rigs)]
            for k, points in enumerate(joints):
                seen[k] += shown(camera, points, [*bodies[:k], *bodies[k + 1:]]).mean() / len(times)
        for k, share in enumerate(seen):
            if share < (0.5 if k == 0 else 0.3):
                raise ValueError(f'person {k + 1} is hardly seen')


def shown(camera: Camera, points: np.ndarray, others: Sequence[Tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Return for (N, 3) points whether they are in the image and not behind the bones of other people."""
    model, local = camera.intrinsics, camera.to_camera(points)
    pixels = camera.project(local)
    visible = ((pixels > 0) & (pixels < [model.width, model.height])).all(1)
    for bones, radii in others:
        bones = camera.to_camera(bones)
        reach = radii / bones[:, 2] * model.fx
        beside = np.linalg.norm(pixels[:, None] - camera.project(bones)[None], axis=2)
        visible &= ~((beside < reach) & (bones[None, :, 2] < local[:, None, 2] - 0.2)).any(1)
    return visible


# ---- gestures ------------------------------------------------------------------------------------------------------

def _arrange_signallers(stage: Stage) -> Dict[str, np.ndarray]:
    """Let people make gestures for six seconds, stand and sit; return the targets of pointing."""
    rng, people, targets = stage.rng, [], {}
    for _ in stage.rigs:
        x, y = stage.place(2.4, 3.4, 1.5, 0.6)
        facing = float(np.clip(rng.normal(-15 * np.sign(x), 18), -45, 45))
        people.append((Place(x, y, facing), str(rng.choice(['shoulder', 'eye']))))
    for name, color in TARGET_COLORS.items():
        for _ in range(100):
            place = rng.uniform([-2.3, 1.5, 0.1], [2.3, 3.3, 2.1])
            if all(np.hypot(*(place[:2] - person[:2])) > 0.95 for person, _ in people) and \
                    all(np.hypot(*(place[:2] - other[:2])) > 0.5 for other in targets.values()):
                break
        else:
            raise ValueError('no place for a target')
        targets[name] = np.round(place, 3)
        stage.room.target(targets[name], rng.uniform(0.13, 0.18), color)
    for place, style in people:
        stage.movers.append(_signal(stage, place, style, targets))
    return targets


def _signal(stage: Stage, place: Place, style: str, targets: Dict[str, np.ndarray]) -> Actor:
    """Return a person who makes gestures one after the other; two thirds also sit down or rise.

    style: of pointing, see `Gesture`.
    """
    rng, rig = stage.rng, stage.next_rig()
    when, rise = rng.uniform(1.3, 4.8), acts.RISE
    # when a person sits, when that changes, and the arms at rest: of those who stand, rise, sit down
    intervals, busy, arms = (
        ([], [], [(0, 'down')]),
        ([(-1.0, when)], [(when - RAMP, when + rise + RAMP)], [(0, 'lap'), (when, 'lap'), (when + rise, 'down')]),
        ([(when, 60.0)], [(when - rise - RAMP, when + RAMP)], [(0, 'down'), (when - rise, 'down'), (when, 'lap')]),
    )[int(rng.integers(0, 3))]
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
        gestures.append(_gesture(rng, place, targets, Gesture(start, end, deck.pop(), style=style)))
        start = end + rng.uniform(0.65, 0.95)
    actor = acts.sit(rig, place, stage.seed(), intervals, arms={'R': arms, 'L': arms}, gestures=gestures)
    if intervals:
        stage.room.chair(*acts.seat_of(actor), place.yaw)
    return actor


def _gesture(rng: np.random.Generator, place: Place, targets: Dict[str, np.ndarray], gesture: Gesture) -> Gesture:
    """Return a gesture with what is drawn for it."""
    arm = str(rng.choice(['R', 'R', 'L']))
    if gesture.label != 'point':
        return gesture._replace(arm=arm, rate=rng.uniform(1.6, 2.6), size=rng.uniform(0.8, 1.1))
    able = [(name, side) for name in targets for side in 'LR'
            if POINTING_ANGLES[0] < _outward_angle(place, targets[name], side) < POINTING_ANGLES[1]]
    if not able:
        raise ValueError('no target in reach')
    name, arm = able[int(rng.integers(0, len(able)))]
    return gesture._replace(arm=arm, target=tuple(targets[name].tolist()), target_name=name)


def _outward_angle(place: Place, target: np.ndarray, side: str) -> float:
    """Return the angle of a target from straight ahead, positive on that side [deg]."""
    angle = (heading(target[0] - place.x, target[1] - place.y) - place.yaw + 180) % 360 - 180
    return float(angle if side == 'L' else -angle)


# ---- several cameras -----------------------------------------------------------------------------------------------

def _cameras_around(stage: Stage) -> List[Callable[[int], Camera]]:
    """Return three cameras, each with intrinsics of its own, that look at (0, 3.1) from the front and both sides."""
    stage.room.front_wall()
    rng, cameras = stage.rng, []
    for degrees in (0.0, 70.0, -70.0):
        bearing, distance = degrees + rng.uniform(-12, 12), rng.uniform(3.1, 3.6)
        height = rng.uniform(0.9, 2.2)
        intrinsics, angle = own_intrinsics(rng, stage.plan.view.sensor), np.deg2rad(bearing)
        cameras.append(Camera(intrinsics, height, float(np.rad2deg(np.arctan2(height - 0.9, distance))),
                              -distance * np.sin(angle), 3.1 - distance * np.cos(angle), -bearing))
    if not all(stage.room.contains(camera.origin, 0.1) for camera in cameras):
        raise ValueError('a camera is outside')
    return [fixed(camera) for camera in cameras]
