"""A skeleton with an adult's proportions that holds poses and moves between them, z up, as an estimator tells it."""
from dataclasses import dataclass, replace
from typing import Callable, Iterator, List, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.person import Surroundings
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import PersonSignals
from skeleton_extract_3d.body.body import BODY, HEAD
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

UP = np.array([0.0, 0.0, 1.0])
ADULT, CHILD = 1.75, 1.10
RATES = (5, 10, 30)
NOTHING = Surroundings()
# Noise of the joints per axis [m], and the sigma that the estimator tells of them [m].
NOISE, SIGMA = 0.005, 0.03

TRUNK = ('neck', 'left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')
FACE = ('nose', 'left_eye', 'right_eye', 'left_ear', 'right_ear')

Direction = Tuple[float, float, float]


@dataclass(frozen=True)
class Limb:
    """An arm or a leg: directions of its upper and lower part, to the outside, forwards and up, of any length."""

    upper: Direction
    lower: Direction


HANGING = Limb((0.15, 0.0, -1.0), (0.1, 0.15, -1.0))
STRAIGHT = Limb((0.0, 0.0, -1.0), (0.0, -0.05, -1.0))


@dataclass(frozen=True)
class Pose:
    """What a body is like at a time.

    Attributes:
        lean: angle of the trunk forwards [deg]; -90 lies on the back.
        facing: angle to the left from x [deg].
        place: x, y of the middle of the hips [m].
    """

    left: Limb = HANGING
    right: Limb = HANGING
    left_leg: Limb = STRAIGHT
    right_leg: Limb = STRAIGHT
    lean: float = 0.0
    facing: float = 0.0
    place: Tuple[float, float] = (0.0, 0.0)

    def with_arm(self, side: str, arm: Limb) -> 'Pose':
        """Return the pose with another left or right arm."""
        return replace(self, **{side: arm})


Motion = Callable[[float], Pose]

STANDING = Pose()
_SEATED = Limb((0.1, 1.0, 0.0), (0.0, 0.0, -1.0))
SITTING = Pose(left_leg=_SEATED, right_leg=_SEATED)
_STRETCHED = Limb((0.1, 1.0, 0.0), (0.0, 1.0, 0.0))
SITTING_ON_FLOOR = Pose(left_leg=_STRETCHED, right_leg=_STRETCHED)
_CROSS_LEGGED = Limb((0.7, 0.7, 0.05), (-1.0, -0.1, -0.05))
CROSS_LEGGED = Pose(left_leg=_CROSS_LEGGED, right_leg=_CROSS_LEGGED)
_SQUAT = Limb((0.2, 0.95, 0.1), (0.0, -0.65, -0.75))
CROUCHING = Pose(left_leg=_SQUAT, right_leg=_SQUAT, lean=35.0)
_KNEE = Limb((0.0, 0.0, -1.0), (0.0, -1.0, -0.05))
KNEELING = Pose(left_leg=_KNEE, right_leg=_KNEE)
ON_ONE_KNEE = Pose(left_leg=_KNEE, right_leg=Limb((0.0, 1.0, -0.1), (0.0, 0.0, -1.0)))
ON_ALL_FOURS = replace(KNEELING, lean=85.0)
_FLAT = Limb((0.0, 1.0, 0.0), (0.0, 1.0, 0.0))
LYING = Pose(left=Limb((0.3, 1.0, 0.0), (0.3, 1.0, 0.0)), right=Limb((0.3, 1.0, 0.0), (0.3, 1.0, 0.0)),
             left_leg=_FLAT, right_leg=_FLAT, lean=-90.0)
BENT_OVER = Pose(lean=85.0)
RUNNING = Pose(left_leg=Limb((0.0, -0.2, -1.0), (0.0, -1.0, -0.1)), right_leg=Limb((0.0, 0.3, -1.0), (0.0, -0.2, -1.0)))


def joints_of(pose: Pose, stature: float = ADULT) -> np.ndarray:
    """Return the joints of a pose, (18, 3) [m], its lowest one on the floor."""
    scale, turn = stature / BODY.adult_stature, np.radians(pose.facing)
    ahead, left = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
    lean = np.radians(pose.lean)
    spine = np.sin(lean) * ahead + np.cos(lean) * UP
    chest = np.cos(lean) * ahead - np.sin(lean) * UP
    at = {'neck': BODY.trunk_length * spine}
    for joint, (to_left, down, forward) in zip(HEAD, BODY.head_points):
        at[COCO_18.joints[joint]] = (at['neck'] + (BODY.neck_to_head - down) * spine + to_left * left + forward * chest)
    for sign, side, arm, leg in ((1, 'left', pose.left, pose.left_leg), (-1, 'right', pose.right, pose.right_leg)):
        axes = np.array([sign * left, ahead, UP])
        at[f'{side}_shoulder'] = at['neck'] + sign * BODY.shoulder_width / 2 * left
        at[f'{side}_hip'] = sign * BODY.hip_width / 2 * left
        for limb, names, lengths in ((arm, ('shoulder', 'elbow', 'wrist'), (BODY.upper_arm, BODY.forearm)),
                                     (leg, ('hip', 'knee', 'ankle'), (BODY.thigh, BODY.shin))):
            for start, end, way, length in zip(names, names[1:], (limb.upper, limb.lower), lengths):
                at[f'{side}_{end}'] = at[f'{side}_{start}'] + length * _unit(way) @ axes
    joints = scale * np.array([at[name] for name in COCO_18.joints])
    return joints + np.array([*pose.place, 0.06 * scale - joints[:, 2].min()])


def between(first: Pose, second: Pose, share: float) -> Pose:
    """Return a pose on the way from one to another."""
    def limb(one: Limb, other: Limb) -> Limb:
        return Limb(*(tuple((1 - share) * _unit(a) + share * _unit(b))
                      for a, b in ((one.upper, other.upper), (one.lower, other.lower))))
    mixed = {name: limb(getattr(first, name), getattr(second, name))
             for name in ('left', 'right', 'left_leg', 'right_leg')}
    numbers = {name: (1 - share) * np.array(getattr(first, name)) + share * np.array(getattr(second, name))
               for name in ('lean', 'facing', 'place')}
    return Pose(**mixed, **numbers)


def held(*poses: Tuple[float, Pose]) -> Motion:
    """Return a motion through poses at times [s]: between two times from one to the next, held after the last."""
    times = np.array([time for time, _ in poses])

    def motion(time: float) -> Pose:
        number = int(np.clip(np.searchsorted(times, time, 'right'), 1, len(poses)))
        if number == len(poses):
            return poses[-1][1]
        (begin, first), (end, second) = poses[number - 1:number + 1]
        return between(first, second, float(np.clip((time - begin) / (end - begin), 0, 1)))
    return motion


def swinging(first: Pose, second: Pose, frequency: float, begin: float = 0.0) -> Motion:
    """Return a motion to and fro between two poses, with a frequency [Hz], from a time on [s]."""
    def motion(time: float) -> Pose:
        swing = 0.5 - 0.5 * np.cos(2 * np.pi * frequency * max(time - begin, 0.0))
        return between(first, second, swing)
    return motion


def then(*parts: Tuple[float, Motion]) -> Motion:
    """Return motions one after the other, each from its time on [s]."""
    def motion(time: float) -> Pose:
        return [part for begin, part in parts if begin <= time + 1e-9][-1](time)
    return motion


def people_of(poses: Sequence[Pose], ids: Sequence[int], random: np.random.RandomState, hidden: Sequence[str] = (),
              stature: float = ADULT) -> People3D:
    """Return people as an estimator tells them: with noise, and hidden joints INFERRED far off.

    Args:
        hidden: names of joints, or their ends.
    """
    joints = np.array([joints_of(pose, stature) for pose in poses]).reshape(-1, len(COCO_18.joints), 3)
    covered = np.array([name.endswith(tuple(hidden)) for name in COCO_18.joints])
    joints = joints + np.where(covered[:, np.newaxis], 0.15, NOISE) * random.normal(size=joints.shape)
    shape = joints.shape[:2]
    return People3D(COCO_18, joints, np.ones(shape), np.broadcast_to(np.where(covered, INFERRED, MEASURED), shape),
                    np.broadcast_to(np.where(covered, 0.25, SIGMA), shape), ids)


def frames(motion: Motion, seconds: float, rate: float, hidden: Sequence[str] = (), stature: float = ADULT,
           ) -> Iterator[Tuple[float, People3D]]:
    """Yield stamps [s] and the person who moves like this, with the id 1."""
    random = np.random.RandomState(1)
    for number in range(int(seconds * rate) + 1):
        yield number / rate, people_of([motion(number / rate)], [1], random, hidden, stature)


def watch(motion: Motion, seconds: float, rate: float = 10, around: Surroundings = NOTHING, **how: object,
          ) -> List[Tuple[float, PersonSignals]]:
    """Return what is told of a person that moves like this, by stamp [s]; see `frames`."""
    reader = SignalReader()
    return [(stamp, reader.update(people, stamp, UP, around)[0]) for stamp, people in
            frames(motion, seconds, rate, **how)]


def all_told(signals: List[Tuple[float, PersonSignals]]) -> 'set[str]':
    """Return the names of all gestures that are told."""
    return {gesture.name for _, person in signals for gesture in person.gestures}


def without(people: People3D, joints: Sequence[str]) -> People3D:
    """Return people with some joints MISSING."""
    missing = np.array([name in joints for name in people.skeleton.joints])
    return replace(people, xyz=np.where(missing[:, np.newaxis], np.nan, people.xyz),
                   status=np.where(missing, MISSING, people.status), sigma=np.where(missing, np.nan, people.sigma))


def _unit(way: Sequence[float]) -> np.ndarray:
    vector = np.array(way, np.float64)
    return vector / np.linalg.norm(vector)
