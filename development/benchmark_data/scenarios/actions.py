"""What people do in random scenes: a stage that is filled with places, movers and furniture."""
from functools import partial
from types import SimpleNamespace
from typing import Any, Callable, Dict, FrozenSet, List, Sequence, Set, Tuple

import numpy as np

from ..people import acts
from ..people.actor import Place
from ..people.geometry import heading
from ..people.motion import Motion, MotionKeys, walk
from ..people.rig import Rig
from ..rendering.room import Room
from ..sequence import FPS
from .plan import Plan

FRAMES = 40
DURATION = FRAMES / FPS  # [s]
IDLE_ARMS = ('down', 'down', 'down2', 'bent', 'bent_up', 'open', 'chest', 'chest_low', 'hip', 'phone', 'chin', 'cross',
             'point_fwd', 'point_fwdside', 'lowwave_in', 'lowwave_out', 'reach', 'side_up')
NEAREST, FARTHEST = 1.9, 5.0  # [m] of people from the camera


class Stage:
    """A room that is being filled: places that are taken, people and what they do."""

    def __init__(self, plan: Plan, rigs: Sequence[Rig], rng: np.random.Generator) -> None:
        self.plan, self.rng, self.rigs = plan, rng, list(rigs)
        self.room = Room(plan.room_seed, rng.uniform(5.6, 7.0), -rng.uniform(3.2, 4.2), rng.uniform(3.2, 4.2))
        self.taken: List[Tuple[float, float]] = []
        self.movers: List[Any] = []
        self.touching: Set[FrozenSet[int]] = set()

    def next_rig(self) -> Rig:
        return self.rigs[len(self.movers)]

    def seed(self) -> int:
        return int(self.rng.integers(1 << 20))

    def place(self, nearest: float = NEAREST, farthest: float = FARTHEST, gap: float = 0.85, spread: float = 0.78
              ) -> Tuple[float, float]:
        """Take a place in the view that is free; raises ValueError where there is none."""
        for _ in range(40):
            y = self.rng.uniform(nearest, farthest)
            wide = min(spread * self.plan.view.tangent * y, self.room.right - 0.6, -self.room.left - 0.6)
            x = self.rng.uniform(-wide, wide)
            if all(np.hypot(x - a, y - b) > gap for a, b in self.taken) and \
                    all(box.distance(x, y) > 0.45 for box in self.room.boxes):
                self.taken.append((x, y))
                return x, y
        raise ValueError('no free place')

    def idle_arms(self) -> Dict[str, List[Tuple[float, str]]]:
        """Return arm key frames that change every 0.6 to 1.3 s."""
        arms = {}
        for side in 'LR':
            times = np.cumsum(np.r_[0, self.rng.uniform(0.6, 1.3, 6)])
            poses = self.rng.choice(IDLE_ARMS, len(times))
            keep = self.rng.random(len(times)) < 0.4  # a pose that is held
            arms[side] = [(float(t), str(poses[k - 1] if keep[k] and k else poses[k])) for k, t in enumerate(times)]
        return arms

    def glances(self) -> List[Tuple[float, float]]:
        return [(t, self.rng.uniform(-35, 35)) for t in (0, 0.9, 1.8, 2.7)]


# ---- what single people do ------------------------------------------------------------------------------------------

def stand(stage: Stage, turning: bool = False) -> None:
    x, y = stage.place()
    rng, yaw = stage.rng, stage.rng.normal(0, 60)
    keys = [(0, yaw), (1.4, yaw + rng.uniform(-15, 15)), (2.7, yaw + rng.uniform(-25, 25))]
    if turning:
        turn = rng.choice([-1, 1]) * rng.uniform(150, 400)
        keys = [(0, yaw), (DURATION / 2, yaw + turn * rng.uniform(0.4, 0.6)), (DURATION, yaw + turn)]
    stage.movers.append(Motion(stage.next_rig(), MotionKeys(
        [(0, (x, y))], keys, stage.idle_arms(), lean=[(0, rng.uniform(0, 5)), (1.5, rng.uniform(0, 12))],
        head_yaw=stage.glances(), stance=rng.uniform(0.04, 0.10)), stage.seed()))


turn = partial(stand, turning=True)


def walk_along(stage: Stage, start: Tuple[float, float], end: Tuple[float, float], speed: float) -> None:
    """Walk from start to end, then stand."""
    yaw = heading(end[0] - start[0], end[1] - start[1])
    arms = stage.idle_arms() if stage.rng.random() < 0.3 else {}
    stage.movers.append(Motion(stage.next_rig(), MotionKeys(
        walk([start, end], speed), [(0, yaw)], arms, head_yaw=stage.glances()), stage.seed()))


def walk_somewhere(stage: Stage) -> None:
    """Walk 1.5 to 3.5 m across the view, towards the camera or away."""
    rng = stage.rng
    x, y = stage.place(2.2, FARTHEST)
    for _ in range(40):
        angle, length = rng.uniform(0, 2 * np.pi), rng.uniform(1.5, 3.5)
        a, b = (np.array([x, y]) + sign * length / 2 * np.array([np.cos(angle), 0.8 * np.sin(angle)])
                for sign in (-1, 1))
        room = stage.room
        if all(NEAREST - 0.3 < end[1] < room.depth - 0.9 and room.left + 0.5 < end[0] < room.right - 0.5
               for end in (a, b)):
            walk_along(stage, (float(a[0]), float(a[1])), (float(b[0]), float(b[1])), length / DURATION + 0.1)
            return
    raise ValueError('no way to walk')


def sit_down(stage: Stage) -> None:
    """Sit on a chair all the time, or sit down, or rise."""
    rng = stage.rng
    x, y = stage.place(2.2, FARTHEST - 0.4, 1.1)
    yaw = rng.normal(0, 55)
    style = int(rng.integers(0, 4))
    when = rng.uniform(0.9, 1.6)
    intervals = [[(-1.0, 60.0)], [(-1.0, 60.0)], [(when + 0.3, 60.0)], [(-1.0, when)]][style]
    arms = {side: [(0, str(rng.choice(['lap', 'lap', 'phone', 'bent', 'chest_low', 'cross']))),
                   (1.4, str(rng.choice(['lap', 'bent', 'chin', 'open'])))] for side in 'LR'}
    actor = acts.sit(stage.next_rig(), Place(x, y, yaw), stage.seed(), intervals, arms=arms, head_yaw=stage.glances())
    stage.movers.append(actor)
    stage.room.chair(*acts.seat_of(actor), yaw)


def work_at_table(stage: Stage) -> None:
    """Sit or stand at a table, on its far side or at its end."""
    rng, sitting = stage.rng, bool(stage.rng.random() < 0.6)
    x, y = stage.place(2.7, FARTHEST - 0.6, 1.4, 0.6)
    yaw = rng.choice([0.0, rng.uniform(-80, 80), rng.uniform(150, 210)])
    height = 0.74 if sitting else rng.uniform(0.88, 0.98)
    edge = -0.12 if sitting else 0.24  # of the table, forward of the feet
    size = (rng.uniform(1.0, 1.7), rng.uniform(0.55, 0.8), height)
    actor = acts.work(stage.next_rig(), Place(x, y, yaw), stage.seed(), height, sitting, edge)
    table = actor.world(0, edge + size[1] / 2, 0)
    stage.room.table(table[0], table[1], size, yaw, solid=not sitting)
    stage.room.things_on_table(table[0], table[1], size, yaw, int(rng.integers(1, 5)))
    if sitting:
        stage.room.chair(*acts.seat_of(actor), yaw)
    stage.movers.append(actor)


def kneel(stage: Stage) -> None:
    rng = stage.rng
    x, y = stage.place(2.2, FARTHEST, 1.1)
    start = rng.choice([-3.0, rng.uniform(0.2, 0.8)])
    stage.movers.append(acts.kneel(
        stage.next_rig(), Place(x, y, rng.uniform(-180, 180)), stage.seed(), (start, start + rng.uniform(0.8, 1.1)),
        bool(rng.random() < 0.4), bool(rng.random() < 0.4)))


def lie(stage: Stage) -> None:
    """Lie down, lie, or get up from lying."""
    rng = stage.rng
    x, y = stage.place(2.4, FARTHEST - 0.4, 1.5, 0.6)
    actor = acts.lie_down(stage.next_rig(), Place(x, y, rng.uniform(-180, 180)), stage.seed(),
                          int(rng.choice([-1, 1])), rng.uniform(0.9, 1.2))
    start, rate = ((0.0, 0.62), (1.35, 0.08), (1.4, 0.65), (0.0, 1.0))[int(rng.integers(0, 4))]
    stage.movers.append(SimpleNamespace(at=lambda t: actor.at(start + rate * t)))


# ---- what people do with each other --------------------------------------------------------------------------------

def cross(stage: Stage) -> None:
    """Two walk past each other, so that one hides the other."""
    rng = stage.rng
    near, far = rng.uniform(2.0, 2.8), rng.uniform(3.4, 4.6)
    middle, direction = rng.uniform(-0.3, 0.3), rng.choice([-1, 1])
    for y, sign in ((near, direction), (far, -direction)):
        reach = min(rng.uniform(1.2, 1.7), 0.9 * stage.plan.view.tangent * y + 0.3)
        slant = rng.uniform(-0.3, 0.3)
        walk_along(stage, (middle - sign * reach, y - slant), (middle + sign * reach, y + slant),
                   2 * reach / DURATION + 0.05)
        stage.taken.append((middle, y))


def meet(stage: Stage) -> None:
    """Two walk up to each other and talk."""
    rng = stage.rng
    x, y = stage.place(2.4, 4.2, 1.6, 0.5)
    angle, apart, start = rng.uniform(-0.6, 0.6), rng.uniform(0.45, 0.6), rng.uniform(0.9, 1.5)
    axis = np.array([np.cos(angle), np.sin(angle)])
    for sign in (-1, 1):
        begin, end = np.array([x, y]) + sign * (apart + start) * axis, np.array([x, y]) + sign * apart * axis
        yaw = heading(*(-sign * axis))
        arms = {side: [(0, 'down'), (1.4, 'down'), (2.0, str(rng.choice(IDLE_ARMS[3:11])))] for side in 'LR'}
        stage.movers.append(Motion(stage.next_rig(), MotionKeys(
            [(0, tuple(begin)), (0.3, tuple(begin + (end - begin) * 0.15)), (1.5, tuple(end - (end - begin) * 0.06)),
             (1.8, tuple(end))], [(0, yaw)], arms, head_yaw=[(0, 0), (1.5, 0)]), stage.seed()))


def hand_over(stage: Stage) -> None:
    x, y = stage.place(2.2, 4.2, 1.5, 0.5)
    stage.touching.add(frozenset((len(stage.movers), len(stage.movers) + 1)))
    stage.movers.extend(acts.hand_over((stage.rigs[0], stage.rigs[1]), (x, y, stage.rng.uniform(40, 140)), stage.seed(),
                                       stage.rng.uniform(0.9, 1.5)))


def hug(stage: Stage) -> None:
    x, y = stage.place(2.2, 4.2, 1.5, 0.5)
    stage.touching.add(frozenset((len(stage.movers), len(stage.movers) + 1)))
    stage.movers.extend(acts.shake_and_hug((stage.rigs[0], stage.rigs[1]), (x, y), stage.seed()))


def group(stage: Stage) -> None:
    """Four to six people who stand, turn, walk and sit."""
    while len(stage.movers) < len(stage.rigs):
        action = (stand, stand, turn, walk_somewhere, sit_down)[int(stage.rng.integers(0, 5))]
        action(stage)


ACTIONS: Dict[str, Callable[[Stage], None]] = {
    'stand': stand, 'turn': turn, 'walk': walk_somewhere, 'cross': cross, 'meet': meet, 'hand_over': hand_over,
    'hug': hug,
    'sit': sit_down, 'table': work_at_table, 'kneel': kneel, 'lie': lie, 'group': group}
OTHERS = (stand, stand, walk_somewhere, turn, sit_down)
