"""What actors do: sit, kneel, lie down and get up, shake hands, hug, hand over, work at a table.

Each function takes a rig, a place and a seed, with times and sizes as options, and returns an Actor.
"""
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np

from .actor import ANKLE, Actor, ActorKeys, Place
from .gestures import Gesture
from .rig import SIDES, Rig

SEAT = 0.45  # [m] height of a chair
RISE = 0.55  # [s] to sit down or stand up
SEAT_BEHIND_FEET = 0.43  # [m]
_LONG = 60.0  # [s] longer than any sequence


def sitting_hip(rig: Rig) -> float:
    """Return the height of the hip joints on a seat, as a share of the standing one: flesh and clothes are between."""
    weight = rig.body.spec.weight
    flesh = (0.095 + 0.05 * max(weight - 0.45, 0)) * max(rig.body.stature / 1.7, 0.8)
    return (SEAT + flesh) / rig.standing_hip


def sit(rig: Rig, place: Place, seed: int, intervals: Sequence[Tuple[float, float]], **options: Any) -> Actor:
    """Stand before a chair, and sit on it in intervals (settled [s]); labels sit and stand say when."""
    sitting, half = sitting_hip(rig), RISE / 2
    hip: List[Tuple[float, Any]] = []
    lean: List[Tuple[float, float]] = []

    def add(t: float, share: float, angle: float) -> None:
        hip.append((t, (0, -SEAT_BEHIND_FEET * share, 1 + (sitting - 1) * share)))
        lean.append((t, angle))

    add(-1, float(bool(intervals) and intervals[0][0] <= 0), 3)
    labels, standing_since = [], 0.0
    for start, stop in intervals:
        if start > 0:
            labels.append(Gesture(standing_since, start - RISE, 'stand'))
            add(start - RISE, 0, 3)
            add(start - half, 0.48, 32)
            add(start, 1, 3)
        if stop < _LONG:
            add(stop, 1, 3)
            add(stop + half, 0.52, 34)
            add(stop + RISE, 0, 3)
        labels.append(Gesture(max(start, 0), min(stop, _LONG), 'sit'))
        standing_since = stop + RISE
    if standing_since < _LONG:
        labels.append(Gesture(standing_since, _LONG, 'stand'))
    keys = dict(hip=hip, feet={side: [(0, (0.15, 0.02, ANKLE, 0))] for side in 'LR'}, knee=((0, (0.25, 1, 0.3)),),
                **options.pop('keys', {}))
    gestures = labels + list(options.pop('gestures', ()))
    return Actor(rig, place, ActorKeys(**keys), seed, gestures, lean=lean, **options)


def seat_of(actor: Actor) -> Tuple[float, float]:
    """Return where the chair of a sitting actor stands."""
    x, y, _ = actor.world(0, -SEAT_BEHIND_FEET - 0.02, 0)
    return float(x), float(y)


def work(rig: Rig, place: Place, seed: int, height: float, sitting: bool, edge: float) -> Actor:
    """Work with both hands on a table of that height whose edge is at `edge` forward of the feet [m]."""
    rng = np.random.default_rng(seed)
    wrist = {side: [(t, (rng.uniform(0.08, 0.24), edge + rng.uniform(0.10, 0.24), height + 0.05 + rng.uniform(0, 0.10)))
                    for t in np.arange(-0.5, 6, 0.55)] for side in 'LR'}
    direction = {side: [(0, (-0.25, 1, -0.1), (0, 0, -1), 0.8)] for side in 'LR'}
    keys = {'wrist': wrist, 'hand_direction': direction, 'elbow': ((0, (0.8, -0.5, -0.6)),)}
    head_pitch = [(0, 18), (1.2, 24), (2.0, 8), (3.0, 20)]
    if sitting:
        return sit(rig, place, seed, [(-1, _LONG)], keys=keys, head_pitch=head_pitch)
    return Actor(rig, place, ActorKeys(**keys), seed, lean=[(0, 10), (1.5, 16), (3, 9)], head_pitch=head_pitch)


def kneel(rig: Rig, place: Place, seed: int, times: Tuple[float, float], both: bool = False, reach: bool = False
          ) -> Actor:
    """Go down on one knee, or both, between two times; the hands rest on the thighs, or reach to the floor."""
    start, end = times
    middle = (start + end) / 2
    thigh, shin = rig.lengths['L']['thigh'], rig.lengths['L']['shin']
    down = (thigh + 0.06) / rig.standing_hip
    hip = [(start, (0, 0, 1.0)), (middle, (0, 0.02, 0.45 + 0.55 * down)), (end, (0, 0.0, down))]
    feet, knee = {}, {}
    for side, _ in SIDES:
        if both or side == 'R':
            behind = -0.97 * shin
            feet[side] = [(start, (0.13, 0, ANKLE, 0, 0, 0)), (middle, (0.13, behind * 0.6, ANKLE + 0.07, 50, 0.3, 40)),
                          (end, (0.13, behind, ANKLE + 0.03, 60, 1, 68))]
            knee[side] = [(start, (0.15, 1, 0.2)), (end, (0.1, 1, -0.8))]
        else:
            feet[side] = [(start, (0.13, 0, ANKLE, 0, 0, 0)), (middle, (0.13, thigh * 0.6, ANKLE + 0.05, 0, 0, 0)),
                          (end, (0.13, thigh * 0.97, ANKLE, 0, 0, 0))]
            knee[side] = [(start, (0.15, 1, 0.3))]
    forward, height = (0.52, 0.14) if reach else (0.30, thigh + 0.12)
    wrist = {side: [(start, (0.28, 0.02, 0.80 * rig.standing_hip)), (end, (0.17, forward, height)),
                    (end + 0.7, (0.22, forward - 0.05, height + 0.06 * reach)), (end + 1.4, (0.15, forward, height))]
             for side in 'LR'}
    weight = {side: [(start, 0), (end, 1)] for side in 'LR'}
    lean = [(start, 3), (middle, 22), (end, 44 if reach else 8)]
    keys = ActorKeys(hip=hip, feet=feet, knee=knee, wrist=wrist, wrist_weight=weight)
    return Actor(rig, place, keys, seed, lean=lean, head_pitch=[(start, 3), (end, 16)])


def lie_down(rig: Rig, place: Place, seed: int, roll: int = 1, pace: float = 1.0) -> Actor:
    """Stand, sit down on the floor backwards (0.8 s), lie (1.3-1.6 s), roll on hands and knees (2.2 s), kneel (3.1 s).

    roll: 1 to the left, -1 to the right; all times are multiplied by pace.
    """
    share = 1 / rig.standing_hip
    thigh, side_shift = rig.lengths['L']['thigh'] + 0.055, roll * 0.13
    small = rig.body.stature / 1.75  # lengths below were chosen on 1.75 m
    hip = _paced(pace, [
        (0, (0, 0.0, 1.0)), (0.15, (0, -0.02, 0.985)), (0.5, (0, -0.26, 0.52 * small * share)),
        (0.8, (0, -0.44, 0.125 * share)), (0.95, (0, -0.46, 0.11 * share)), (1.3, (0, -0.46, 0.12 * share)),
        (1.62, (0, -0.46, 0.12 * share)), (1.95, (0.4 * side_shift, -0.46, 0.18 * share)),
        (2.22, (side_shift, -0.45, 0.17 * share)), (2.62, (side_shift, -0.44, (thigh - 0.02) * share)),
        (3.1, (side_shift, -0.36, thigh * share))])
    root = _paced(pace, [
        (0, (0, 0, 0)), (0.5, (28, 0, 0)), (0.82, (-12, 0, 0)), (1.0, (-35, 0, 0)), (1.33, (-88, 0, 0)),
        (1.62, (-89, 0, 0)), (1.95, (-88, 0, 92 * roll)), (2.22, (-84, 0, 165 * roll)), (2.62, (-72, 0, 180 * roll)),
        (2.82, (-42, 0, 180 * roll)), (3.12, (-3, 0, 180 * roll))])
    limbs = [_lying_limbs(side, sign, roll, side_shift) for side, sign in SIDES]
    feet, knee, wrist, elbow, hands = ({side: _paced(pace, limb[k]) for (side, _), limb in zip(SIDES, limbs)}
                                       for k in range(5))
    keys = ActorKeys(hip=hip, root=root, feet=feet, wrist=wrist, knee=knee, elbow=elbow, hand_direction=hands,
                     wrist_weight={side: _paced(pace, [(0.05, 0), (0.45, 1)]) for side in 'LR'},
                     sole=rig.sole - ANKLE)
    return Actor(rig, place, keys, seed,
                 lean=_paced(pace,
                             [(0, 2), (0.5, 20), (0.9, 16), (1.33, 0), (2.0, 10), (2.6, 2), (2.85, 10), (3.1, 3)]),
                 head_pitch=_paced(pace, [(0, 4), (0.6, 12), (1.0, 22), (1.4, 8), (2.0, 4), (2.25, -22), (2.6, -20),
                                          (3.1, 6)]))


def _paced(pace: float, keys: Sequence[Tuple[Any, ...]]) -> List[Tuple[Any, ...]]:
    return [(pace * key[0], *key[1:]) for key in keys]


def _lying_limbs(side: str, sign: float, roll: int, shift: float) -> Tuple[Any, ...]:
    is_low, inward = sign == roll, -sign * 0.11

    def own(left: float, *others: float) -> Tuple[float, ...]:
        return (sign * left, *others)

    feet = [(0, (0.13, 0, 0.085, 0, 0, 0)), (0.8, (0.14, 0.02, 0.085, 0, 0, 0)), (1.1, (0.15, 0.22, 0.085, -14, 0, 0)),
            (1.36, (0.16, 0.36, 0.085, -60, 0, 20)), (1.62, (0.14, 0.33, 0.09, -60, 1, 20)),
            (1.95, own(roll * 0.02, 0.28, 0.07, 0, 1, 25) if is_low else own(roll * 0.12, 0.16, 0.19, 0, 1, 25)),
            (2.22, own(shift + inward, 0.16, 0.085, 0, 1, 55)), (2.6, own(shift + inward, -0.03, 0.085, 0, 1, 72)),
            (3.1, own(shift + inward, 0.05, 0.085, 0, 1, 76))]
    knee = [(0, (0.2, 1, 0.15)), (0.8, (0.25, 0.5, 1)), (1.62, (0.3, 0.2, 1)), (1.95, own(roll, -0.3, 0.15)),
            (2.22, own(0.3 * roll, -1, -0.5)), (2.6, own(0, -1, -0.6)), (3.1, (-0.1, -1, -0.2))]
    wrist = [(0, (0.3, 0.0, 0.85)), (0.45, (0.3, 0.18, 0.62)), (0.78, (0.34, -0.62, 0.3)), (0.95, (0.36, -0.74, 0.06)),
             (1.2, (0.4, -0.8, 0.06)), (1.38, (0.36, -0.52, 0.06)), (1.62, (0.34, -0.52, 0.07)),
             (1.95, own(roll * 0.42, -0.92, 0.06) if is_low else own(roll * 0.36, -0.74, 0.07)),
             (2.22, own(shift - sign * 0.26, -0.9, 0.05)), (2.62, own(shift - sign * 0.2, -0.98, 0.07)),
             (2.8, own(shift - sign * 0.19, -0.88, 0.16)), (3.1, own(shift - sign * 0.17, -0.6, 0.46))]
    elbow = [(0, (0.7, -0.8, -0.2)), (0.9, (0.8, -0.6, 0.4)), (1.4, (1, 0, 0.5)), (1.62, (1, 0, 0.5)),
             (1.95, own(0.2 * roll, 0.4, 0.9)), (2.22, (-0.8, 0.6, 0.5)), (2.62, (-0.5, 0.8, 0.1)),
             (3.1, (-0.8, 0.5, 0.1))]
    down = (0, 0, -1)
    hands = [(0, (0.2, -1, 0), down, 0), (0.55, (0.5, -0.8, 0), down, 0), (0.8, (0.5, -0.8, 0.05), down, 1),
             (1.1, (0.6, -0.6, 0.05), down, 1), (1.22, (1, 0.2, 0.05), down, 1), (1.36, (0.2, 1, 0.05), down, 1),
             (1.62, (0.2, 1, 0.05), down, 1), (1.8, own(roll, -0.1, 0.1), down, 1),
             (1.95, own(0.3 * roll, -1, 0.05), down, 1), (2.22, (0.1, -1, 0.05), down, 1),
             (2.68, (0.1, -1, 0.05), down, 1), (2.95, (0.1, -1, -0.4), down, 0.3), (3.1, (0.1, -1, -0.4), down, 0.3)]
    return feet, knee, wrist, elbow, hands


def hand_over(rigs: Tuple[Rig, Rig], middle: Tuple[float, float, float], seed: int, meet: float = 1.2
              ) -> List[Actor]:
    """Return two who stand 0.95 m apart, facing each other; one hands the other something at `meet` [s].

    middle: x, y and the yaw of the first [deg].
    """
    x, y, yaw = middle
    height = min(rig.body.stature for rig in rigs) * 0.62
    actors = []
    for rig, sign, delay in ((rigs[0], -1, 0.0), (rigs[1], 1, 0.12)):
        facing = yaw if sign < 0 else yaw + 180
        forward = np.array([np.sin(np.deg2rad(yaw)), -np.cos(np.deg2rad(yaw))]) * 0.475 * sign
        rest = (0.16, 0.26, height * 0.92)
        wrist = {'R': [(0, rest), (meet - 0.5 + delay, rest), (meet, (0.02, 0.40, height)),
                       (meet + 0.25, (0.02, 0.40, height + 0.02)), (meet + 0.9 - delay, rest)]}
        keys = ActorKeys(wrist=wrist, hand_direction={'R': [(0, (-0.1, 1, 0), (-1, 0, 0.3), 0.8)]},
                         elbow=((0, (0.7, -0.6, -0.8)),))
        actors.append(Actor(rig, Place(x + forward[0], y + forward[1], facing), keys, seed + sign,
                            lean=[(0, 3), (meet, 9), (meet + 1, 3)], head_pitch=[(0, 5), (meet, 14), (meet + 1, 4)]))
    return actors


def shake_and_hug(rigs: Tuple[Rig, Rig], middle: Tuple[float, float], seed: int) -> List[Actor]:
    """Return two who shake hands (0.35-1.15 s) and hug (2.0 s on); the first stands left and looks right."""
    apart, near = 0.4, 0.165
    x, y = middle
    heavier = 0.10 * max(max(rig.body.spec.weight for rig in rigs) - 0.5, 0)
    actors = []
    for rig, other, sign in ((rigs[0], rigs[1], -1), (rigs[1], rigs[0], 1)):
        place = Place(x + sign * apart, y + (0.05 if sign > 0 else -0.03), -sign * 90 - 6)
        step = apart - near - heavier
        hip = [(0, (0, 0, 0.99)), (1.35, (0, 0, 0.99)), (1.9, (0.09, step, 0.99)), (3.4, (0.09, step, 0.985))]
        feet = {side: [(0, (0.13, 0, ANKLE, 0)), (1.35 + late, (0.13, 0, ANKLE, 0)),
                       (1.55 + 1.5 * late, (0.13, 0.13, 0.14, 8)),
                       (1.75 + 1.5 * late, (0.12, step - 0.6 * late, ANKLE, 0))] for side,
                       late in (('R', 0.0), ('L', 0.1))}
        keys = ActorKeys(
            hip=hip, feet=feet,
            wrist=_hug_wrists(apart, 2 * apart - step + 0.085, other.body.stature * 0.8),
            wrist_weight={'R': [(0, 0.3), (0.3, 1)], 'L': [(0, 0.2), (1.1, 0.3), (1.5, 1)]},
            elbow=[(0, (0.7, -0.6, -0.8)), (1.2, (0.7, -0.6, -0.8)), (1.8, (1, 0.1, -0.5))],
            hand_direction={side: _hug_hands(float(side == 'R')) for side in 'LR'},
            hands={'R': [(0, 'flat'), (0.45, 'relax'), (1.3, 'flat')], 'L': [(0, 'relax'), (1.5, 'flat')]})
        actors.append(Actor(rig, place, keys, seed + (sign > 0), lean=[(0, 3), (0.4, 8), (1.2, 6), (2.0, 9), (3.4, 9)],
                            head_pitch=[(0, 6), (1.6, 4), (2.1, 8)], head_yaw=[(0, 0), (1.5, 0), (2.0, 24), (3.4, 28)],
                            side=[(0, 0), (1.5, 0), (2.0, -3)]))
    return actors


def _hug_wrists(apart: float, behind: float, shoulder: float) -> Dict[str, List[Tuple[Any, ...]]]:
    """Return wrist key frames: `behind` is how far the back of the other is, `shoulder` its height."""
    reach, shake = apart - 0.082, 1.02
    right = [(0, (0.26, 0.12, 0.95)), *((0.35 + 0.15 * k, (0.022, reach, shake + up)) for k, up in enumerate(
        (0, 0.05, -0.04, 0.05, -0.03))), (1.15, (0.03, apart - 0.09, shake)),
        (1.55, (0.34, apart * 0.95, shoulder - 0.02)),
        (2.0, (0.06, behind, shoulder - 0.06)), (2.4, (0.04, behind, shoulder - 0.04)),
        (2.7, (0.06, behind, shoulder - 0.06))]
    left = [(0, (0.27, 0.03, 0.83)), (1.1, (0.27, 0.05, 0.83)), (1.55, (0.34, apart * 0.95, shoulder - 0.3)),
            (2.0, (0.1, behind, shoulder - 0.3)), (2.5, (0.1, behind, shoulder - 0.27)),
            (3.4, (0.1, behind, shoulder - 0.3))]
    return {'R': right, 'L': left}


def _hug_hands(shakes: float) -> List[Tuple[Any, ...]]:
    inward = (-1, 0, 0)
    return [(0, (0, 1, -0.1), inward, 0.2 * shakes), (0.3, (0, 1, -0.05), inward, shakes),
            (1.15, (0, 1, 0.0), inward, shakes), (1.5, (-0.3, 1, 0.1), (-1, -0.3, 0), 0.7),
            (2.0, (-1, 0.12, 0.15), (-0.1, -1, 0), 1.0)]
