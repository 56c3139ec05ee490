"""People as capsules: for each part of a body a segment between two points, and a radius that contains it.

A part whose joints are MISSING is anywhere within reach of those that are known: `reaches_of`.
"""
import math
from dataclasses import dataclass, fields
from typing import NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import distinct_ids, values_in
from openpose_ros_pkg.skeletons import BODY_25, COCO_18
from openpose_ros_signals.geometry import EARS, joints_of, stature_of
from skeleton_extract_3d.body.body import BODY, HEAD, HIPS, BodyConstants, joint_indices
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

_SIDES = ('left', 'right')
_TOES = tuple(f'{side}_big_toe' for side in _SIDES)
POINTS = (*COCO_18.joints, 'mid_hip', 'head', *(f'{side}_hand' for side in _SIDES), *_TOES)
"""Names of the points at which capsules end."""
_POINTS = {name: row for row, name in enumerate(POINTS)}
_ELBOWS, _WRISTS = (joint_indices(*(f'{side}_{joint}' for side in _SIDES)) for joint in ('elbow', 'wrist'))


class Segment(NamedTuple):
    """A part of a body between two points; {} stands for the side where there are two of it."""

    name: str
    start: str
    end: str
    radius: str  # field of `CapsuleConstants`
    length: str = ''  # field of `BodyConstants` or `CapsuleConstants`; '': no bone


SEGMENTS = (
    Segment('shoulders', 'left_shoulder', 'right_shoulder', 'trunk'),
    Segment('hips', 'left_hip', 'right_hip', 'trunk'),
    Segment('spine', 'neck', 'mid_hip', 'trunk', 'trunk_length'),
    Segment('neck', 'neck', 'head', 'head', 'neck_to_head'),
    Segment('head', 'left_ear', 'right_ear', 'head'),
    *(Segment(*(text.format(side) for text in texts)) for side in _SIDES for texts in (
        ('{}_side', '{}_shoulder', '{}_hip', 'trunk'),
        ('{}_upper_arm', '{}_shoulder', '{}_elbow', 'upper_arm', 'upper_arm'),
        ('{}_forearm', '{}_elbow', '{}_wrist', 'forearm', 'forearm'),
        ('{}_hand', '{}_wrist', '{}_hand', 'hand', 'hand_axis'),
        ('{}_thigh', '{}_hip', '{}_knee', 'thigh', 'thigh'),
        ('{}_shin', '{}_knee', '{}_ankle', 'shin', 'shin'),
        ('{}_foot', '{}_ankle', '{}_big_toe', 'foot', 'foot_length'))))
"""All parts of a body."""
PARTS = tuple(segment.name for segment in SEGMENTS)
"""Names of the capsules of a body."""
_ENDS = np.array([[_POINTS[segment.start], _POINTS[segment.end]] for segment in SEGMENTS])
_FEET = np.array([segment.radius == 'foot' for segment in SEGMENTS])
_TRUNK = np.array([segment.radius == 'trunk' for segment in SEGMENTS])
_RENDERED = ('98 % of the surface of rendered, dressed people with known joints (wave, turn, cross, group, robot) is '
             'nearer to the bone, rounded')
_WINTER = 'Winter, Biomechanics and Motor Control of Human Movement, 2009, fig. 4.1'


@dataclass(frozen=True)
class CapsuleConstants:
    """Capsules of an adult of `BodyConstants.adult_stature`; lengths scale with the stature."""

    trunk: float = constant(0.15, 'Radius of the capsules of shoulders, hips, spine and both sides.', unit='m',
                            source=_RENDERED)
    head: float = constant(0.14, 'Radius of the head, from ear to ear, and of the neck.', unit='m', source=_RENDERED)
    upper_arm: float = constant(0.10, 'Radius of an upper arm.', unit='m',
                                source=_RENDERED + ', without what belongs to the trunk beside it')
    forearm: float = constant(0.08, 'Radius of a forearm.', unit='m', source=_RENDERED + ', without the hand')
    hand: float = constant(0.06, 'Radius of a hand.', unit='m', source='half of the breadth of an open hand with thumb')
    thigh: float = constant(0.12, 'Radius of a thigh.', unit='m', source=_RENDERED)
    shin: float = constant(0.09, 'Radius of a shin.', unit='m', source=_RENDERED + ', without the foot')
    foot_length: float = constant(0.19, 'Ankle to the big toe.', unit='m',
                                  source=_WINTER + ': the foot is 0.152 of the stature, a quarter of it behind the '
                                                   'ankle')
    foot: float = constant(0.06, 'Radius of a foot; there is one where the network has toes.', unit='m',
                           source='half of its breadth, with the shoe')
    hand_length: float = constant(0.184, 'Wrist to fingertips, along the forearm.', unit='m',
                                  source=_WINTER + ': 0.108 of the stature')
    hand_bend: float = constant(0.5, 'Root mean square angle between forearm and hand.', unit='rad', source='chosen')
    no_sigma: float = constant(0.25, 'Sigma of a joint without one.', unit='m',
                               source='chosen: the error of most guessed joints')
    part_of_head: float = constant(0.08, 'Sigma of the middle of the head without both ears.', unit='m',
                                   source='middle of the ears to eyes and nose, BodyConstants.head_points')

    @property
    def hand_axis(self) -> float:
        """Length of the axis of the capsule of a hand [m]."""
        return self.hand_length - self.hand


CAPSULES = CapsuleConstants()
# More says nothing [m].
_MOST_SIGMA = 1000.0


@dataclass(frozen=True)
class Capsules:
    """N capsules of the people of a frame."""

    persons: np.ndarray  # (N,) int64 ids, see `distinct_ids`
    parts: np.ndarray  # (N,) int64 places in `PARTS`
    points: np.ndarray  # (N, 2) int64 places in `POINTS` of the ends
    ends: np.ndarray  # (N, 2, 3) float64 [m]
    radii: np.ndarray  # (N,) [m], without sigma
    sigma: np.ndarray  # (N, 2) [m], root mean square distance of the true ends from these; NaN: not estimated
    velocity: np.ndarray  # (N, 2, 3) of the ends [m/s]; NaN: not estimated
    measured: np.ndarray  # (N,) bool, both ends are MEASURED; a hand is with its forearm

    def __len__(self) -> int:
        return len(self.persons)

    def where(self, chosen: np.ndarray) -> 'Capsules':
        return Capsules(*(getattr(self, field.name)[chosen] for field in fields(self)))

    @property
    def known_sigma(self) -> np.ndarray:
        """Sigma of the ends (N, 2) [m], that of `CapsuleConstants.no_sigma` where there is none."""
        with np.errstate(invalid='ignore'):
            return np.asarray(np.where(self.sigma >= 0, np.minimum(self.sigma, _MOST_SIGMA), CAPSULES.no_sigma))


class _Points(NamedTuple):
    """M points of P people."""

    xyz: np.ndarray  # (P, M, 3) [m]
    status: np.ndarray  # (P, M)
    sigma: np.ndarray  # (P, M) [m]
    velocity: np.ndarray  # (P, M, 3) [m/s]


def capsules_of(people: People3D, constants: CapsuleConstants = CAPSULES, body: BodyConstants = BODY) -> Capsules:
    """Return what is to be kept free of the people of a frame, in their frame of reference.

    That is the known parts, and of a person without any of the trunk also the least sphere that holds one of it.
    """
    known, spheres = known_parts(people, constants, body), reaches_of(people, constants, body)
    spheres = spheres.where(_TRUNK[spheres.parts] & ~np.isin(spheres.persons, known.persons[_TRUNK[known.parts]]))
    spheres = spheres.where(np.argsort(spheres.radii))
    both = known, spheres.where(np.unique(spheres.persons, return_index=True)[1])
    return Capsules(*(np.concatenate([getattr(each, field.name) for each in both]) for field in fields(known)))


def known_parts(people: People3D, constants: CapsuleConstants = CAPSULES, body: BodyConstants = BODY) -> Capsules:
    """Return the parts whose ends are both known.

    Radii follow from the measured bones of this frame; without, they are those of an adult.
    """
    points, scale = _body_points(people, constants, body)
    known = (points.status[:, _ENDS] != MISSING).all(axis=2)
    persons, parts = np.nonzero(known)
    rows = persons[:, np.newaxis], _ENDS[parts]
    return Capsules(distinct_ids(people.ids)[persons], parts, _ENDS[parts], points.xyz[rows],
                    _radii(constants)[parts] * scale[persons], points.sigma[rows], points.velocity[rows],
                    (points.status[rows] == MEASURED).all(axis=1))


def reaches_of(people: People3D, constants: CapsuleConstants = CAPSULES, body: BodyConstants = BODY,
               feet: bool = False) -> Capsules:
    """Return for each part that `known_parts` leaves out a sphere that contains it, round a joint that is known.

    Both ends are that joint, from which the part is a chain of bones away. People without any known joint have none.

    Args:
        feet: also of a network without toes.
    """
    points, scale = _body_points(people, constants, body)
    known = points.status != MISSING
    missing = ~known[:, _ENDS].all(axis=2) & known.any(axis=1, keepdims=True)
    if not feet and not set(_TOES) <= set(people.skeleton.joints):
        missing &= ~_FEET
    persons, parts = np.nonzero(missing)
    # the stature of a person is not known well where joints are missing
    away = bone_paths(constants, body)[:, _ENDS].max(axis=2).T * (1 + body.stature_spread)
    costs = np.where(known[persons], away[parts] * scale[persons, np.newaxis] + np.nan_to_num(points.sigma[persons]),
                     np.inf)
    nearest = costs.argmin(axis=1)
    rows = persons[:, np.newaxis], np.stack([nearest, nearest], axis=1)
    return Capsules(distinct_ids(people.ids)[persons], parts, rows[1], points.xyz[rows],
                    (away[parts, nearest] + _radii(constants)[parts]) * scale[persons], points.sigma[rows],
                    points.velocity[rows], np.zeros(len(persons), bool))


def bone_paths(constants: CapsuleConstants = CAPSULES, body: BodyConstants = BODY) -> np.ndarray:
    """Return the lengths of the chains of bones between all points of an adult, (M, M) [m]."""
    bones = [('head', COCO_18.joints[joint], float(np.linalg.norm(place)))
             for joint, place in zip(HEAD, body.head_points)]
    bones += [(start, end, float(getattr(body if hasattr(body, name) else constants, name)))
              for _, start, end, _, name in SEGMENTS if name]
    bones += [(middle, f'{side}_{joint}', width / 2) for side in _SIDES for middle, joint, width in (
        ('neck', 'shoulder', body.shoulder_width), ('mid_hip', 'hip', body.hip_width))]
    paths = np.full((len(POINTS), len(POINTS)), np.inf)
    np.fill_diagonal(paths, 0.0)
    for start, end, length in bones:
        paths[_POINTS[start], _POINTS[end]] = paths[_POINTS[end], _POINTS[start]] = length
    for middle in range(len(POINTS)):  # Floyd and Warshall
        paths = np.minimum(paths, paths[:, [middle]] + paths[[middle]])
    return paths


def tail(deviations: np.ndarray) -> np.ndarray:
    """Return the probability that Student's t with three degrees of freedom is greater, by its standard deviations.

    Errors of ends along a line have it, with sigma / sqrt(3) as standard deviation.
    """
    return 0.5 - (np.arctan(deviations) + deviations / (1 + deviations ** 2)) / math.pi


def _radii(constants: CapsuleConstants) -> np.ndarray:
    return np.array([getattr(constants, segment.radius) for segment in SEGMENTS])


def _body_points(people: People3D, constants: CapsuleConstants, body: BodyConstants) -> Tuple[_Points, np.ndarray]:
    """Return the points of people, and their sizes (P,) as shares of an adult's."""
    velocity = values_in(people.velocity, people.skeleton, COCO_18, np.nan).astype(np.float64)
    joints = _Points(*joints_of(people), velocity)
    statures = np.array([stature_of(xyz, status) for xyz, status in zip(joints.xyz, joints.status)])
    scale = np.clip(np.where(np.isnan(statures), body.adult_stature, statures), *body.stature_limits
                    ) / body.adult_stature
    points = (joints, _mean(joints, HIPS), _head(joints, scale, constants), _hands(joints, scale, constants),
              _toes(people))
    return _Points(*(np.concatenate(values, axis=1) for values in zip(*points))), scale


def _mean(points: _Points, joints: np.ndarray) -> _Points:
    """Return the middle of joints that are all known; it is measured if all of them are."""
    status = points.status[:, joints]
    seen = np.where((status == MEASURED).all(axis=1), MEASURED, INFERRED)
    return _Points(points.xyz[:, joints].mean(axis=1, keepdims=True),
                   np.where((status == MISSING).any(axis=1), MISSING, seen)[:, np.newaxis],
                   points.sigma[:, joints].max(axis=1, keepdims=True),
                   points.velocity[:, joints].mean(axis=1, keepdims=True))


def _head(joints: _Points, scale: np.ndarray, constants: CapsuleConstants) -> _Points:
    """Return the middle of the ears, or of those joints of the head that are known."""
    head = _mean(joints, EARS)
    for row in np.flatnonzero(head.status[:, 0] == MISSING):
        known = HEAD[joints.status[row, HEAD] != MISSING]
        if len(known):
            one = _mean(_Points(*(value[[row]] for value in joints)), known)
            wider = np.hypot(one.sigma, constants.part_of_head * scale[row])
            for target, value in zip(head, one._replace(sigma=wider, status=np.full((1, 1), INFERRED))):
                target[row] = value[0]
    return head


@np.errstate(invalid='ignore')
def _hands(joints: _Points, scale: np.ndarray, constants: CapsuleConstants) -> _Points:
    """Return the ends of the capsules of the hands, which lie on from the forearms, or, without these, at the wrists.

    The hand may be bent at the wrist, by any angle where the direction of the forearm is not known.
    """
    length = (constants.hand_axis * scale)[:, np.newaxis]
    wrists, elbows = (_Points(*(value[:, rows] for value in joints)) for rows in (_WRISTS, _ELBOWS))
    forearm = np.linalg.norm(wrists.xyz - elbows.xyz, axis=2)
    has_forearm = forearm > 0
    share = np.where(has_forearm, length / np.where(has_forearm, forearm, 1.0), 0.0)
    beyond = share[..., np.newaxis]

    def extended(wrist: np.ndarray, elbow: np.ndarray) -> np.ndarray:
        return np.where(beyond > 0, wrist + beyond * (wrist - elbow), wrist)

    # the direction of a forearm without any known end is off by a right angle, root mean square
    turned = np.minimum(np.hypot(wrists.sigma, elbows.sigma) / np.where(has_forearm, forearm, np.nan), np.pi / 2)
    angle = np.where(has_forearm, np.hypot(turned, constants.hand_bend), np.pi / 2)
    sigma = np.hypot(wrists.sigma, angle * length)
    both = np.where(has_forearm & (elbows.status == MEASURED), wrists.status, INFERRED)
    return _Points(extended(wrists.xyz, elbows.xyz), np.where(wrists.status == MISSING, MISSING, both), sigma,
                   extended(wrists.velocity, elbows.velocity))


def _toes(people: People3D) -> _Points:
    """Return the big toes, MISSING where the network has none."""
    rows = [BODY_25.index[name] for name in _TOES]
    return _Points(*(values_in(values, people.skeleton, BODY_25, missing)[:, rows] for values, missing in (
        (people.xyz.astype(np.float64), np.nan), (people.status, MISSING), (people.sigma.astype(np.float64), np.nan),
        (people.velocity.astype(np.float64), np.nan))))
