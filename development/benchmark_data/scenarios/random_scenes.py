"""Random scenes from a plan: people are arranged, furniture and cameras placed, until nothing is in each other."""
from typing import Callable, List, Sequence, Tuple

import numpy as np

from ..people.body import Body
from ..people.contact import bone_points, conflict, sample_times
from ..people.rig import Rig
from ..rendering.camera import Camera
from ..sequence import FPS, Scene, fixed
from .actions import ACTIONS, DURATION, FRAMES, OTHERS, Stage
from .plan import Plan, describe

ATTEMPTS = 60
NEAREST_JOINT = 0.9  # [m] from the camera


def build_scene(plan: Plan) -> Scene:
    """Build the people of a plan and arrange them; see `arranged`."""
    return arranged(plan, _scene)


def arranged(plan: Plan, scene_of: Callable[[Stage], Scene]) -> Scene:
    """Return the first scene in which no two people, and no person and furniture, are in each other, and all are seen.

    Parameters
    ----------
    scene_of : arranges the people on a stage; ValueError: that is no scene

    Raises
    ------
    RuntimeError
        No arrangement was found.
    """
    rigs = [Rig(Body(person)) for person in plan.people]
    problem = ''
    for attempt in range(ATTEMPTS):
        try:
            return scene_of(Stage(plan, rigs, np.random.default_rng((*plan.seed, 1, attempt))))
        except ValueError as error:
            problem = str(error)
    raise RuntimeError(f'{plan.name}: no arrangement in {ATTEMPTS} attempts; the last: {problem}')


def check(problem: str) -> None:
    """Raise ValueError for what `conflict` or `unseen` tells."""
    if problem:
        raise ValueError(problem)


def check_conflict(stage: Stage, times: Sequence[float]) -> None:
    """Raise ValueError where people, or a person and furniture, are in each other."""
    check(conflict(stage.rigs, stage.movers, stage.room.boxes, times, stage.touching))


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


def unseen(stage: Stage, cameras: Sequence[Callable[[int], Camera]], times: Sequence[float]) -> str:
    """Return who of the people is too near, or hardly seen; '' if all are well placed."""
    seen = np.zeros(len(stage.rigs))
    for t in times:
        camera = cameras[0](int(t * FPS))
        joints = [rig.pose(mover.at(t)).joints for rig, mover in zip(stage.rigs, stage.movers)]
        if min(camera.to_camera(points)[:, 2].min() for points in joints) < NEAREST_JOINT:
            return 'a person is too near'
        bodies = [bone_points(points, rig.body.stature) for points, rig in zip(joints, stage.rigs)]
        for k, points in enumerate(joints):
            others = [body for i, body in enumerate(bodies) if i != k]
            seen[k] += shown(camera, points, others).mean() / len(times)
    for k, share in enumerate(seen):
        if share < (0.5 if k == 0 else 0.3):
            return f'person {k + 1} is hardly seen'
    return ''


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


def _scene(stage: Stage) -> Scene:
    plan, times = stage.plan, sample_times(DURATION)
    ACTIONS[plan.kind](stage)
    while len(stage.movers) < len(stage.rigs):
        OTHERS[int(stage.rng.integers(0, len(OTHERS)))](stage)
    _add_furniture(stage)
    check_conflict(stage, times)
    cameras = cameras_of(stage, times)
    check(unseen(stage, cameras, times))
    return Scene(plan.name, plan.seed[0] * 1000 + plan.seed[1], stage.room, stage.rigs, stage.movers, cameras,
                 moving=plan.view.moving, sensor=plan.view.sensor, frames=FRAMES, light=plan.light,
                 exposure=plan.exposure, description=describe(plan))
