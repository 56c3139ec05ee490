"""How near people are to links of a robot: the least distance, and a bound below it that holds with a probability.

**Where people may be.** An end of a capsule (`capsules.py`) was last known t seconds ago, at a position x with sigma s
and velocity v. Two statements hold of it, and the best one counts:

    motion     it is near x + v t, with variance s^2 + (s_v t)^2, for half a second; from there it walks
    walking    it is within 1.6 m/s t of where it was, which has variance s^2; a limb moves about its root too, by
               at most 2.0 m/s t, and no further than it reaches

Both speeds are those of ISO 13855: of walking, and of upper limbs. People who are no longer seen are people who were
last known a while ago. A part that is not MEASURED is also within reach of the nearest joint that is, of which the same
is said. Errors have heavier tails than normal ones: Student's t with three degrees of freedom.

**The bound** is the greatest b with which the probability that a person is nearer than b is 1 - p at most, as a sum
over people (Boole). Of one person the part and link count with which that is most probable: errors of the joints of a
body depend on each other, as those of one depth, one size and one identity.
"""
import math
from dataclasses import dataclass, replace
from typing import Callable, NamedTuple, Optional, Sequence, Set, Tuple

import numpy as np
from scipy.special import stdtrit

from openpose_ros_bridges.capsules import (
    CAPSULES,
    PARTS,
    POINTS,
    CapsuleConstants,
    Capsules,
    bone_paths,
    capsules_of,
    reaches_of,
)
from openpose_ros_bridges.guard import View
from openpose_ros_bridges.node_params import SeparationParams
from openpose_ros_pkg.params.constants import constant
from skeleton_extract_3d.body.body import BODY, BodyConstants
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

_MEASURED_ON = 'mode balanced on rendered sequences (wave, turn, cross, crowd, group, close, floor, furniture)'
# Steps of the search for the bound: to a hundredth of a millimetre in 100 m.
_STEPS = 24
# Spheres that stand for a link between two frames.
_MOST_SPHERES = 20
# More says nothing [m].
_MOST_SIGMA = 1000.0
# Points at the ends of limbs, and knees, (M,).
_ENDS = np.array([name.endswith(('wrist', 'hand', 'knee', 'ankle', 'toe')) for name in POINTS])


@dataclass(frozen=True)
class SeparationConstants:
    """Errors of people's positions, and how they move."""

    walking: float = constant(1.6, 'People walk at most this fast.', unit='m/s', source='ISO 13855')
    limbs: float = constant(2.0, 'Limbs move at most this fast about the joint where they begin.', unit='m/s',
                            source='ISO 13855, upper limbs')
    inferred_error: float = constant(2.0, 'Error of an INFERRED joint, of its sigma; of a MEASURED one it is 1.',
                                     unit='share', source=_MEASURED_ON + ': 99 % of the errors along a line')
    inferred_end_error: float = constant(1.4, 'The same of the end of a limb, and of a knee.', unit='share',
                                         source='as `inferred_error`')
    no_sigma: float = constant(0.25, 'Sigma of a joint without one.', unit='m', source='chosen: the error of most '
                                                                                      'guessed joints')
    speed_error: float = constant(0.42, "Root mean square error of a trunk joint's velocity; of others as much more as "
                                       'they accelerate more.', unit='m/s', source=_MEASURED_ON)
    greatest_speed: float = constant(10.0, 'Greater velocities are errors.', unit='m/s', source='chosen: hands that '
                                                                                               'throw a ball')
    longest_motion: float = constant(0.5, 'Positions are extrapolated by the velocity for this long.', unit='s',
                                     source='chosen: half of a step')
    ahead: float = constant(0.1, 'Stamps that are ahead of the clock by more are of another clock.', unit='s',
                            source='chosen: several times the error of NTP')


CONSTANTS = SeparationConstants()


class Links(NamedTuple):
    """Parts of the robot as spheres: names, centres (L, 3) [m] in the frame of the people, radii (L,) [m].

    `away` (L,) is how far each may have moved since [m].
    """

    names: Sequence[str]
    centres: np.ndarray
    radii: np.ndarray
    away: np.ndarray


class Separation(NamedTuple):
    """How near people are.

    Attributes:
        distance: from the surface of a link to that of a part of a body, the least one [m]; inf: no person is known;
            NaN: nothing is known.
        bound: that is less than it with the probability [m]; inf: no person is known, and there is no guard volume.
        link, person, part, status: the pair that alone would have the least bound: name of the link, id (0: none), name
            of the part, MEASURED, INFERRED or MISSING.
        age: of the data of this person, or, without one, of the newest frame [s]; NaN: there is none.
        people: number of people that count, with those who were lost.
        reason: why the bound is not by the people; empty: it is.
    """

    distance: float
    bound: float
    link: str = ''
    person: int = 0
    part: str = ''
    status: int = MISSING
    age: float = math.nan
    people: int = 0
    reason: str = ''


class _Parts(NamedTuple):
    """Parts of bodies where they were last known, in arrays with a row for each.

    Attributes:
        persons, parts, status, stamps: (N,) ids, places in `PARTS`, status, and when [s].
        ends: (N, 2, 3) [m].
        radii: (N,) that contain the part [m].
        skins: (N,) radii by which distances are told [m].
        sigma, speeds: (N, 2) root mean square errors of both ends [m], and of their velocities [m/s].
        velocity: (N, 2, 3) [m/s].
        swings: (N, 2) how far both ends may move about the root of their limb [m].
    """

    persons: np.ndarray
    parts: np.ndarray
    status: np.ndarray
    stamps: np.ndarray
    ends: np.ndarray
    radii: np.ndarray
    skins: np.ndarray
    sigma: np.ndarray
    speeds: np.ndarray
    velocity: np.ndarray
    swings: np.ndarray

    @classmethod
    def none(cls) -> '_Parts':
        ids, values = np.zeros(0, np.int64), np.zeros(0)
        ends, points = np.zeros((0, 2)), np.zeros((0, 2, 3))
        return cls(ids, ids, ids, values, points, values, values, ends, ends, points, ends)

    def where(self, chosen: np.ndarray) -> '_Parts':
        return _Parts(*(value[chosen] for value in self))

    def and_of(self, other: '_Parts') -> '_Parts':
        return _Parts(*(np.concatenate(values) for values in zip(self, other)))


class _Margins(NamedTuple):
    """Distances of L links from N parts at three points, and root mean square errors along a line: (3, L, N) [m]."""

    distances: np.ndarray
    sigmas: np.ndarray


class SeparationEstimator:
    """Remembers where people are, and tells how near they may be at any time.

    Args:
        params: probability, and times after which nothing is known.
    """

    def __init__(self, params: SeparationParams, constants: SeparationConstants = CONSTANTS,
                 capsules: CapsuleConstants = CAPSULES, body: BodyConstants = BODY) -> None:
        self._params, self._constants, self._capsules, self._body = params, constants, capsules, body
        roots, paths = _roots(), bone_paths(capsules, body)
        # from one side of the root to the other
        self._swings = 2 * paths[np.arange(len(POINTS)), roots]
        self._paces = _paces(body)
        self._quantile = float(stdtrit(3, params.probability)) / math.sqrt(3)
        self.clear()

    def clear(self) -> None:
        """Forget all people."""
        self._parts = self._reaches = _Parts.none()
        self._newest: Optional[float] = None
        self._unplaced: Set[int] = set()
        self._view: Optional[View] = None

    def take(self, people: People3D, stamp: float, view: Optional[View] = None) -> None:
        """Take the people of a frame.

        Args:
            stamp: [s]; of a frame that is older than the newest one nothing is taken.
            view: what the camera sees, in the frame of the people; None: it is not known.
        """
        if self._newest is not None and stamp < self._newest:
            return
        parts, reaches = self._of(people, stamp)
        kept = ~np.isin(self._parts.persons, parts.persons) & (
            stamp - self._parts.stamps <= self._params.lost_timeout)
        self._parts, self._reaches = self._parts.where(kept).and_of(parts), self._reaches.where(kept).and_of(reaches)
        # a person who is there without a position may be anywhere, unless it is known from before
        self._unplaced = set(people.ids.tolist()) - set(self._parts.persons.tolist())
        self._newest, self._view = stamp, view

    def at(self, now: float, links: Links) -> Separation:
        """Return how near people are to links at a time [s]."""
        params, newest = self._params, self._newest
        if newest is None:
            return unknown('no people message yet')
        age = now - newest
        if age > params.data_timeout:
            return unknown(f'the newest people are {age:.2f} s old', age)
        if age < -self._constants.ahead:
            return unknown(f'stamps of people are {-age:.2f} s ahead of the clock', age)
        kept = (self._parts.stamps == newest) | (now - self._parts.stamps <= params.lost_timeout)
        known = self._parts.where(kept)
        found = self._nearest(known, self._reaches.where(kept), np.maximum(now - known.stamps, 0.0), links)
        found = found._replace(people=len(set(known.persons.tolist()) | self._unplaced),
                               age=age if math.isnan(found.age) else found.age)
        if self._unplaced:
            return found._replace(bound=0.0, reason=f'person {min(self._unplaced)} has no position')
        return found if not params.guard else self._guarded(found, max(age, 0.0), links)

    def _guarded(self, found: Separation, age: float, links: Links) -> Separation:
        """Return the separation with people who come from where the camera does not look."""
        if self._view is None:
            return found._replace(bound=0.0, reason='no camera info: what the camera sees is not known')
        params = self._params
        free = self._view.depths_inside(links.centres, params.guard_range) - links.radii - links.away
        bound = max(float(free.min()) - params.guard_margin - self._constants.walking * age, 0.0)
        if bound >= found.bound:
            return found
        return Separation(found.distance, bound, links.names[int(free.argmin())], age=age, people=found.people,
                          reason='guard volume')

    def _nearest(self, known: _Parts, reaches: _Parts, ages: np.ndarray, links: Links) -> Separation:
        if not len(ages):
            return Separation(math.inf, math.inf)
        statements = [margins(parts, ages, links) for parts in (known, reaches)
                      for margins in (self._motion, self._walking)]
        away = self._motion(known._replace(radii=known.skins), np.minimum(ages, self._constants.longest_motion),
                            links._replace(away=np.zeros(len(links.radii)))).distances

        def deviations(bound: float) -> np.ndarray:
            """Return by how many standard deviations each part (N) would have to be nearer to each link (L)."""
            return np.asarray(np.max([((each.distances - bound) / each.sigmas).min(axis=0) for each in statements],
                                     axis=0))

        highest = float(np.max([each.distances.min(axis=0) for each in statements], axis=0).min())
        _, person = np.unique(known.persons, return_inverse=True)

        def probability(bound: float) -> float:
            nearest = np.full(person.max() + 1, np.inf)
            np.minimum.at(nearest, person, deviations(bound).min(axis=0))
            return float(tail(nearest).sum())

        bound = _greatest(probability, 1 - self._params.probability, highest)
        # the pair that alone would have the least bound
        alone = np.max([(each.distances - self._quantile * each.sigmas).min(axis=0) for each in statements], axis=0)
        link, row = divmod(int(alone.argmin()), len(ages))
        distance = max(float(away.min()), 0.0)
        return Separation(distance, min(bound, distance), links.names[link], int(known.persons[row]),
                          PARTS[known.parts[row]], int(known.status[row]), float(ages[row]))

    def _motion(self, known: _Parts, ages: np.ndarray, links: Links) -> _Margins:
        moved = np.minimum(ages, self._constants.longest_motion)[:, np.newaxis]
        sigma = np.hypot(known.sigma, known.speeds * moved)
        ends = known.ends + known.velocity * moved[..., np.newaxis]
        return _margins(known, ends, sigma, links, self._walked(known, ages[:, np.newaxis] - moved))

    def _walking(self, known: _Parts, ages: np.ndarray, links: Links) -> _Margins:
        return _margins(known, known.ends, known.sigma, links, self._walked(known, ages[:, np.newaxis]))

    def _walked(self, known: _Parts, ages: np.ndarray) -> np.ndarray:
        """Return how far both ends may have got in times (N, 1) [s], (N, 2) [m]."""
        return self._constants.walking * ages + np.minimum(self._constants.limbs * ages, known.swings)

    def _of(self, people: People3D, stamp: float) -> Tuple[_Parts, _Parts]:
        """Return the parts of the people of a frame, and the spheres within reach of measured joints that hold them."""
        # by their rows, as a message may have an id twice
        rows = replace(people, ids=np.arange(len(people)))
        known, missing, reaches = (parts_of(each, self._capsules, self._body) for parts_of, each in (
            (capsules_of, rows), (reaches_of, rows), (reaches_of, _measured(rows))))
        parts = self._rows(known, np.where(known.measured, MEASURED, INFERRED), known.radii, stamp).and_of(
            self._rows(missing, np.full(len(missing), MISSING), np.zeros(len(missing)), stamp))
        around = self._rows(reaches, np.full(len(reaches), MEASURED), np.zeros(len(reaches)), stamp)
        by_part = {key: row for row, key in enumerate(zip(around.persons.tolist(), around.parts.tolist()))}
        own = np.array([by_part.get(key, -1) for key in zip(parts.persons.tolist(), parts.parts.tolist())], int)
        # what has no such sphere may be anywhere, by this statement
        spheres = parts._replace(radii=np.full(len(own), np.inf))
        if len(reaches):
            spheres = _Parts(*(np.where(_as_wide(own >= 0, other), value[own], other) for value, other in zip(
                around, spheres)))
        ids = people.ids[parts.persons]
        return parts._replace(persons=ids), spheres._replace(persons=ids)

    def _rows(self, capsules: Capsules, status: np.ndarray, skins: np.ndarray, stamp: float) -> _Parts:
        constants, paces = self._constants, self._paces[capsules.points]
        with np.errstate(invalid='ignore'):
            sigma = np.where(capsules.sigma >= 0, np.minimum(capsules.sigma, _MOST_SIGMA), constants.no_sigma)
            moves = np.linalg.norm(capsules.velocity, axis=2) <= constants.greatest_speed
        inferred = np.where(_ENDS[capsules.points], constants.inferred_end_error, constants.inferred_error)
        error = np.where((status == MEASURED)[:, np.newaxis], 1.0, inferred)
        # what moves at an unknown velocity stays within `walking` by the other statement
        speeds = np.where(moves, constants.speed_error * paces, constants.walking + constants.limbs)
        return _Parts(capsules.persons, capsules.parts, status, np.full(len(capsules), stamp), capsules.ends,
                      capsules.radii, skins, sigma * error, speeds,
                      np.where(moves[..., np.newaxis], capsules.velocity, 0.0), self._swings[capsules.points])


def _measured(people: People3D) -> People3D:
    """Return people with their MEASURED joints only."""
    other = people.status != MEASURED
    return replace(people, xyz=np.where(other[..., np.newaxis], np.nan, people.xyz),
                   status=np.where(other, MISSING, people.status), sigma=np.where(other, np.nan, people.sigma))


def _as_wide(mask: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return a mask (N,) for values (N, ...)."""
    return mask.reshape(-1, *(1,) * (values.ndim - 1))


def spheres_of(ends: np.ndarray, radius: float) -> Tuple[np.ndarray, float]:
    """Return centres (M, 3) and a radius of spheres that hold the capsule between ends (2, 3) [m]; one, of a sphere."""
    length = float(np.linalg.norm(ends[1] - ends[0]))
    number = min(math.ceil(length / max(radius, 0.01)), _MOST_SPHERES - 1) + 1
    shares = np.linspace(0.0, 1.0, number)[:, np.newaxis]
    return ends[0] + shares * (ends[1] - ends[0]), math.hypot(radius, length / max(number - 1, 1) / 2)


def unknown(reason: str, age: float = math.nan) -> Separation:
    """Return what is told where nothing is known."""
    return Separation(math.nan, 0.0, age=age, reason=reason)


def _roots() -> np.ndarray:
    """Return for each point that at which its limb begins; the points of the trunk are their own."""
    begin = {'elbow': 'shoulder', 'wrist': 'shoulder', 'hand': 'shoulder', 'knee': 'hip', 'ankle': 'hip',
             'big_toe': 'hip'}
    roots = []
    for name in POINTS:
        side, _, part = name.partition('_')
        on_head = name in ('nose', 'head') or part in ('eye', 'ear')
        roots.append(POINTS.index('neck' if on_head else f'{side}_{begin[part]}' if part in begin else name))
    return np.array(roots)


def _paces(body: BodyConstants) -> np.ndarray:
    """Return the accelerations of all points relative to those of the trunk's joints."""
    paces = {'head': 1.0, 'hand': dict(body.relative_acceleration)['wrist'],
             'big_toe': dict(body.relative_acceleration)['ankle'], **dict(body.relative_acceleration)}
    return np.array([paces[name if name in paces else name.partition('_')[2]] for name in POINTS])


def _margins(known: _Parts, ends: np.ndarray, sigma: np.ndarray, links: Links, grown: np.ndarray
             ) -> _Margins:
    """Return how far links are from parts at their ends and at the nearest point between.

    Args:
        ends: (N, 2, 3) of the parts [m].
        sigma: (N, 2) of these [m].
        grown: (N, 2) by how much the ends may be nearer [m].
    """
    begins, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    squares = np.maximum((along ** 2).sum(axis=1), 1e-12)
    offsets = links.centres[:, np.newaxis] - begins
    shares = np.clip((offsets * along).sum(axis=2) / squares, 0.0, 1.0)
    shares = np.stack([np.zeros_like(shares), shares, np.ones_like(shares)])
    distances = np.linalg.norm(offsets - shares[..., np.newaxis] * along, axis=3)

    def between(values: np.ndarray) -> np.ndarray:
        return (1 - shares) * values[:, 0] + shares * values[:, 1]

    distances = distances - known.radii - (links.radii + links.away)[:, np.newaxis]
    return _Margins(distances - between(grown), np.maximum(between(sigma) / math.sqrt(3), 1e-9))


def tail(deviations: np.ndarray) -> np.ndarray:
    """Return the probability that Student's t with three degrees of freedom is greater, by its standard deviations."""
    return 0.5 - (np.arctan(deviations) + deviations / (1 + deviations ** 2)) / math.pi


def _greatest(probability: Callable[[float], float], most: float, highest: float) -> float:
    """Return the greatest bound from 0 to `highest` with at most that probability, which grows with it; else 0."""
    low, high = 0.0, max(highest, 0.0)
    if probability(low) > most:
        return 0.0
    for _ in range(_STEPS):
        middle = (low + high) / 2
        low, high = (middle, high) if probability(middle) <= most else (low, middle)
    return low
