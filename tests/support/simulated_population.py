"""Simulated people of all sizes who gesture, each in an own way, and who do what is nearly a gesture.

Each draws stature, facing, seat, arm, size and speed of the motion; errors of the joints, lasting ones and noise; rate
of the frames, whose stamps jitter and of which some are lost.
"""
from dataclasses import replace
from typing import Callable, Dict, Iterator, List, Set, Tuple

import numpy as np

from animated_skeleton import (
    CROUCHING,
    HANGING,
    LYING,
    SITTING,
    SITTING_ON_FLOOR,
    STANDING,
    UP,
    Limb,
    Motion,
    Pose,
    held,
    joints_of,
    swinging,
    then,
)
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import PersonSignals
from skeleton_extract_3d.people import MEASURED, People3D

Random = np.random.RandomState
Told = List[Tuple[float, PersonSignals]]
# The arms are where the gesture begins, and where it ends [s].
BEGIN, END = 1.3, 3.3
# Both arms do this.
_BOTH = ('arms_crossed', 'claps', 'hands on the hips', 'carries a box', 'clasps the hands')


def told_of(motion: Motion, random: Random, seconds: float = END + 0.7) -> Told:
    """Return the signals of a person whom a camera of some rate sees with its errors, by stamp [s]."""
    reader, signals = SignalReader(), []
    stature, rate = random.uniform(1.0, 1.95), random.choice([5.0, 10.0, 15.0, 30.0])
    shape = (1, len(COCO_18.joints), 3)
    lasting, noise = random.normal(0, 0.012, shape), random.uniform(0.003, 0.008)
    for number in range(int(seconds * rate)):
        if random.rand() < 0.05:
            continue
        stamp = (number + random.uniform(0.0, 0.3)) / rate
        joints = joints_of(motion(stamp), stature) + lasting + noise * random.normal(size=shape)
        people = People3D(COCO_18, joints, np.ones(shape[:2]), np.full(shape[:2], MEASURED), np.full(shape[:2], 0.03),
                          [1])
        signals.append((stamp, reader.update(people, stamp, UP)[0]))
    return signals


def arm_of(motion: Motion) -> str:
    """Return the arm of a gesture: that whose upper part is elsewhere than at the start."""
    begin, middle = motion(0.0), motion((BEGIN + END) / 2)
    return max(('left', 'right'), key=lambda side: np.linalg.norm(
        np.subtract(getattr(begin, side).upper, getattr(middle, side).upper)))


def gestures(name: str, random: Random) -> Motion:
    """Return a gesture: the arm comes up before BEGIN, and goes down again after END."""
    first, second, frequency = _GESTURES[name](random)
    return _brought(name, first, second, frequency, random)


def nearly(name: str, random: Random) -> Motion:
    """Return what is nearly a gesture."""
    if name in _MOTIONS:
        return _MOTIONS[name](random)
    return _brought(name, *_NEARLY[name](random), random)


def _brought(name: str, first: Limb, second: Limb, frequency: float, random: Random) -> Motion:
    base = replace(STANDING if random.rand() < 0.7 else SITTING, facing=random.uniform(0, 360))
    side = 'left' if random.rand() < 0.5 else 'right'
    one, other = (base.with_arm(side, arm) for arm in (first, second))
    if name in _BOTH:
        one, other = (replace(base, left=arm, right=arm) for arm in (first, second))
    way = random.uniform(0.25, 0.5)
    comes = held((0, base), (BEGIN - way, base), (BEGIN, one))
    motion = swinging(one, other, frequency, BEGIN)
    return then((0, comes), (BEGIN, motion), (END, held((END, motion(END)), (END + way, base))))


def _wave(random: Random) -> Tuple[Limb, Limb, float]:
    size, height, ahead = random.uniform(0.3, 0.75), random.uniform(-0.6, 0.1), random.uniform(0.2, 0.6)
    upper, to = (0.5, ahead, height), random.uniform(0.0, 0.3)
    return Limb(upper, (to - size, 0.2, 1.0)), Limb(upper, (to + size, 0.2, 1.0)), random.uniform(1.0, 2.5)


def _point(random: Random) -> Tuple[Limb, Limb, float]:
    around, height = np.radians(random.uniform(-25, 95)), np.radians(random.uniform(-30, 35))
    way = (np.cos(height) * np.sin(around), np.cos(height) * np.cos(around), np.sin(height))
    arm = Limb(way, tuple(np.array(way) + random.uniform(-0.15, 0.15, 3)))
    return arm, arm, 0.0


def _held(*ways: Tuple[float, float, float], spread: float = 0.08) -> Callable[[Random], Tuple[Limb, Limb, float]]:
    """Return what draws an arm that is held about like this: its upper part and its forearm."""
    def draw(random: Random) -> Tuple[Limb, Limb, float]:
        upper, lower = (tuple(np.array(way) + random.uniform(-spread, spread, 3)) for way in ways)
        return Limb(upper, lower), Limb(upper, lower), 0.0
    return draw


def _swung(first: Limb, second: Limb, slow: float, fast: float) -> Callable[[Random], Tuple[Limb, Limb, float]]:
    return lambda random: (first, second, random.uniform(slow, fast))


def _walks(random: Random) -> Motion:
    """Return a walk, with arms that swing: until END."""
    swing, speed = random.uniform(0.2, 0.6), random.uniform(0.7, 1.6)
    ahead, behind = Limb((0.1, swing, -1.0), (0.05, swing + 0.3, -1.0)), Limb((0.1, -swing, -1.0), (0.05, 0.1, -1.0))
    facing = random.uniform(0, 360)
    turn, frequency = np.radians(facing), random.uniform(0.8, 1.2)
    steps = swinging(replace(STANDING, left=ahead, right=behind), replace(STANDING, left=behind, right=ahead),
                     frequency)
    return lambda time: replace(steps(time), facing=facing,
                                place=tuple(speed * time * np.array([np.cos(turn), np.sin(turn)])))


def _through(*poses: Tuple[float, Pose]) -> Callable[[Random], Motion]:
    """Return what draws a motion through poses, at times [s] for an average speed."""
    def draw(random: Random) -> Motion:
        slow, facing = random.uniform(0.8, 1.3), random.uniform(0, 360)
        return held(*((slow * time, replace(pose, facing=facing)) for time, pose in poses))
    return draw


_GESTURES: Dict[str, Callable[[Random], Tuple[Limb, Limb, float]]] = {
    'wave': _wave, 'point': _point,
    'raise_hand': _held((0.2, 0.1, 1.0), (0.1, 0.0, 1.0), spread=0.15),
    'stop': _held((0.1, 1.0, -0.45), (0.0, 0.6, 0.8)),
    'arms_crossed': _held((0.25, 0.2, -1.0), (-1.0, 0.35, 0.05))}
_STRETCHED = Limb((1.0, -0.2, 0.4), (0.9, -0.3, 0.5))
_DOWN = Limb((0.1, 0.6, -0.8), (0.0, 0.45, -0.9))
_BENT_DOWN = replace(CROUCHING, lean=60.0)
_NEARLY: Dict[str, Callable[[Random], Tuple[Limb, Limb, float]]] = {
    'phones': _held((0.5, 0.4, -0.7), (-0.25, -0.1, 1.0)),
    'scratches the head': _swung(Limb((0.9, 0.1, 0.5), (-0.75, 0.0, 0.7)), Limb((0.9, 0.1, 0.6), (-0.85, 0.0, 0.5)),
                                 1.5, 3.0),
    'adjusts the glasses': _held((0.4, 0.6, -0.35), (-0.5, 0.05, 1.0)),
    'drinks': _held((0.35, 0.5, -0.75), (-0.45, 0.15, 1.0)),
    'hands on the hips': _held((0.8, -0.3, -0.8), (-0.9, 0.3, -0.5)),
    'carries a box': _held((0.1, 0.3, -1.0), (-0.1, 1.0, -0.05)),
    'clasps the hands': _held((0.2, 0.2, -1.0), (-0.6, 0.7, -0.35)),
    'claps': _swung(Limb((0.3, 0.4, -0.9), (-0.1, 1.0, 0.3)), Limb((0.2, 0.4, -0.9), (-0.6, 0.8, 0.3)), 2.0, 4.0),
    'talks with a hand': _swung(Limb((0.2, 0.2, -1.0), (0.0, 1.0, 0.0)), Limb((0.3, 0.2, -1.0), (0.4, 0.9, 0.3)),
                                0.8, 2.0),
    'shakes hands': _swung(Limb((0.1, 0.4, -0.9), (-0.1, 1.0, -0.1)), Limb((0.1, 0.4, -0.9), (-0.1, 1.0, 0.25)),
                           2.0, 3.5)}
_MOTIONS: Dict[str, Callable[[Random], Motion]] = {
    'walks': _walks,
    'stretches': _through((0, STANDING), (1, STANDING), (2, replace(STANDING, left=_STRETCHED, right=_STRETCHED)),
                          (3.2, STANDING)),
    'sits down': _through((0, STANDING), (1, STANDING), (1.9, SITTING)),
    'sits down on the floor': _through((0, STANDING), (1, STANDING), (1.8, replace(_BENT_DOWN, right=_DOWN)),
                                       (2.6, SITTING_ON_FLOOR)),
    'lies down slowly': _through((0, STANDING), (0.5, STANDING), (1.5, CROUCHING), (2.4, SITTING_ON_FLOOR),
                                 (3.8, LYING)),
    'ties the shoes': _through((0, STANDING), (1, STANDING), (1.7, replace(_BENT_DOWN, left=_DOWN, right=_DOWN)),
                               (3.4, replace(_BENT_DOWN, left=_DOWN, right=_DOWN)), (4.0, STANDING)),
    'swings an arm past': _through((0, STANDING), (1, STANDING), (1.35, replace(
        STANDING, right=Limb((0.5, 0.9, 0.0), (0.5, 0.9, 0.05)))), (1.7, replace(STANDING, right=HANGING)))}
GESTURES, NEARLY = tuple(_GESTURES), (*_NEARLY, *_MOTIONS)


def found(signals: Told) -> Iterator[Tuple[float, str]]:
    """Yield when each gesture begins to be told [s], and its name."""
    before: Set[Tuple[str, str]] = set()
    for stamp, person in signals:
        now = {(gesture.name, gesture.arm) for gesture in person.gestures}
        yield from ((stamp, name) for name, _ in now - before)
        before = now
