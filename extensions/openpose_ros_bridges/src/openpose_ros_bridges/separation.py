"""How near people are to links of a robot: the least distance, and a bound below it that holds with a probability.

**Where people may be.** An end of a capsule (`capsules.py`) was last known t seconds ago, at a position x with sigma s
and velocity v. Two statements hold of it, and the best one counts:

    motion     it is near x + v t, with variance s^2 + (s_v t)^2, for half a second; from there it walks
    walking    it is within 1.6 m/s t of where it was, which has variance s^2; a limb moves about its root too, by
               at most 2.0 m/s t, and no further than it reaches

Both speeds are from ISO 13855: walking, and upper limbs. A person is an id; where it is not in the newest frame, its
track is lost: it is where it was last known, also when another id appears near it; of people without an id of their
own no bound is known. A part that is not MEASURED is also
within reach of the nearest joint that is, of which the same is said. Errors have heavier tails than normal ones:
Student's t with three degrees of freedom.

**The bound** is the largest b for which P(a person is nearer than b) <= 1 - p, where P is the sum over people (Boole).
Of one person the most probable pair of part and link is taken: errors of the joints of a body are dependent, as they
share one depth, one size and one identity.
"""
import math
from dataclasses import dataclass, replace
from typing import NamedTuple, Optional, Sequence, Tuple

import numpy as np
from scipy.special import stdtrit

from openpose_ros_bridges.guard import View
from openpose_ros_bridges.moving_parts import Links, MovingParts, greatest, margins_of
from openpose_ros_bridges.node_params import SeparationParams
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import distinct_ids
from openpose_ros_signals.capsules import (
    CAPSULES,
    PARTS,
    POINTS,
    CapsuleConstants,
    Capsules,
    bone_paths,
    known_parts,
    reaches_of,
    tail,
)
from skeleton_extract_3d.body.body import BODY, BodyConstants
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

_MEASURED_ON = 'mode balanced on rendered sequences (wave, turn, cross, crowd, group, close, floor, furniture)'
# Points at the ends of limbs, and knees, (M,).
_ENDS = np.array([name.endswith(('wrist', 'hand', 'knee', 'ankle', 'toe')) for name in POINTS])


@dataclass(frozen=True)
class SeparationConstants:
    """Errors of people's positions, and how they move."""

    walking: float = constant(1.6, 'People walk at most this fast.', unit='m/s', source='ISO 13855')
    limbs: float = constant(2.0, 'Limbs move at most this fast about the joint where they begin.', unit='m/s',
                            source='ISO 13855, upper limbs')
    inferred_error: float = constant(2.0, 'Error of an INFERRED joint, of its sigma; of a MEASURED one it is 1.',
                                     unit='share', source=_MEASURED_ON + (
                                         ': 99 % of the errors along a line, before calibration made sigma greater'))
    inferred_end_error: float = constant(1.4, 'The same of the end of a limb, and of a knee.', unit='share',
                                         source='as `inferred_error`')
    speed_error: float = constant(0.42, "Root mean square error of a trunk joint's velocity; of others as much more as "
                                       'they accelerate more.', unit='m/s', source=_MEASURED_ON)
    greatest_speed: float = constant(10.0, 'Greater velocities are errors.', unit='m/s', source='chosen: hands that '
                                                                                               'throw a ball')
    longest_motion: float = constant(0.5, 'Positions are extrapolated by the velocity for this long.', unit='s',
                                     source='chosen: half of a step')
    ahead: float = constant(0.1, 'Stamps that are ahead of the clock by more are of another clock.', unit='s',
                            source='chosen: several times the error of NTP')
    data_timeout: float = constant(1.0, 'The bound is 0 when the newest people are older.', unit='s', source='chosen')
    guard_margin: float = constant(1.0, 'People are found when they are that far in the image.', unit='m', source=(
        'chosen: an arm may be in it before, 0.7 m, and a person is published some frames later, walking for 0.2 s'))
    feet: bool = constant(True, 'Feet are within reach of the ankles where the network has no toes.', source='chosen')


CONSTANTS = SeparationConstants()


class Separation(NamedTuple):
    """How near people are; the pair of link and part is that which alone would have the least bound."""

    distance: float  # the least one from a link to a part of a body [m]; inf: no person is known; NaN: nothing is
    bound: float  # less than it with the probability [m]; inf: no person is known, and there is no guard volume
    link: str = ''
    person: int = 0  # id; 0: none
    part: str = ''
    status: int = MISSING  # MEASURED, INFERRED or MISSING
    age: float = math.nan  # of the data of this person, or, without one, of the newest frame [s]; NaN: there is none
    people: int = 0  # number of people that count, including lost tracks
    reason: str = ''  # why the bound is not by the people; empty: it is


class SeparationEstimator:
    """Remembers where people are, and tells how near they may be at any time."""

    def __init__(self, params: SeparationParams, constants: SeparationConstants = CONSTANTS,
                 capsules: CapsuleConstants = CAPSULES, body: BodyConstants = BODY) -> None:
        self._params, self._constants, self._capsules, self._body = params, constants, capsules, body
        # from one side of the root to the other
        self._swings = 2 * bone_paths(capsules, body)[np.arange(len(POINTS)), _roots()]
        self._paces = _paces(body)
        self._quantile = float(stdtrit(3, params.probability)) / math.sqrt(3)
        self.clear()

    def clear(self) -> None:
        """Forget all people."""
        self._parts = self._reaches = MovingParts.none()
        self._newest: Optional[float] = None
        self._unplaced: Sequence[int] = ()
        self._have_ids = True
        self._view: Optional[View] = None

    def take(self, people: People3D, stamp: float, view: Optional[View] = None) -> None:
        """Take the people of a frame that is not older than the newest one, and what the camera sees of their frame."""
        if self._newest is not None and stamp < self._newest:
            return
        parts, reaches = self._of(people, stamp)
        lost = ~np.isin(self._parts.persons, parts.persons)
        kept = lost & (stamp - self._parts.stamps <= self._params.lost_timeout)
        self._parts, self._reaches = self._parts.where(kept).and_of(parts), self._reaches.where(kept).and_of(reaches)
        # a person without a position may be anywhere, unless it is known from before
        known = set(self._parts.persons.tolist())
        self._unplaced = [name for name in distinct_ids(people.ids).tolist() if name not in known]
        self._have_ids = bool((people.ids > 0).all()) and len(set(people.ids.tolist())) == len(people)
        self._newest, self._view = stamp, view

    def at(self, now: float, links: Links) -> Separation:
        """Return how near people are to links at a time [s]."""
        newest = self._newest
        if newest is None:
            return unknown('no people message yet')
        age = now - newest
        if age > self._constants.data_timeout:
            return unknown(f'the newest people are {age:.2f} s old', age)
        if age < -self._constants.ahead:
            return unknown(f'stamps of people are {-age:.2f} s ahead of the clock', age)
        kept = (self._parts.stamps == newest) | (now - self._parts.stamps <= self._params.lost_timeout)
        known = self._parts.where(kept)
        found = self._nearest(known, self._reaches.where(kept), np.maximum(now - known.stamps, 0.0), links)
        found = found._replace(people=len(set(known.persons.tolist())) + len(self._unplaced),
                               age=age if math.isnan(found.age) else found.age)
        if self._unplaced:
            return found._replace(distance=math.nan, bound=0.0, reason=f'person {self._unplaced[0]} has no position')
        if not self._have_ids:  # then it can not be told from others when it is lost
            return found._replace(bound=0.0, reason='a person has no id of its own')
        return found if not self._params.guard else self._guarded(found, max(age, 0.0), links, known)

    def _guarded(self, found: Separation, age: float, links: Links, known: MovingParts) -> Separation:
        """Return the separation with people coming from where the camera does not look, or from behind known ones."""
        if self._view is None:
            return found._replace(bound=0.0, reason='no camera info: what the camera sees is not known')
        hiding = known.where(known.status != MISSING)
        # three balls along a part leave gaps of centimetres, less than guard_margin
        balls = np.insert(hiding.ends, 1, hiding.ends.mean(axis=1), axis=1).reshape(-1, 3)
        hidden = self._view.hidden_distances(links.centres, balls, np.repeat(hiding.radii, 3))
        inside = self._view.depths_inside(links.centres, self._params.guard_range)
        free = np.minimum(inside, hidden) - links.radii - links.away
        # a person, and an arm before it
        came = self._constants.walking * age + min(self._constants.limbs * age, float(self._swings.max()))
        bound = max(float(free.min()) - self._constants.guard_margin - came, 0.0)
        if bound >= found.bound:
            return found
        return Separation(found.distance, bound, links.names[int(free.argmin())], age=age, people=found.people,
                          reason='guard volume')

    def _nearest(self, known: MovingParts, reaches: MovingParts, ages: np.ndarray, links: Links) -> Separation:
        if not len(ages):
            return Separation(math.inf, math.inf)
        longest = self._constants.longest_motion
        statements = [self._margins(parts, ages, links, most) for parts in (known, reaches) for most in (longest, 0.0)]
        away, _ = self._margins(known._replace(radii=known.skins), np.minimum(ages, longest),
                                links._replace(away=np.zeros(len(links.radii))), longest)

        def deviations(bound: float) -> np.ndarray:
            """Return by how many standard deviations each part (N) would have to be nearer to each link (L)."""
            return np.asarray(np.max([((distances - bound) / sigmas).min(axis=0) for distances, sigmas in statements],
                                     axis=0))

        highest = float(np.max([distances.min(axis=0) for distances, _ in statements], axis=0).min())
        _, person = np.unique(known.persons, return_inverse=True)

        def probability(bound: float) -> float:
            nearest = np.full(person.max() + 1, np.inf)
            np.minimum.at(nearest, person, deviations(bound).min(axis=0))
            return float(tail(nearest).sum())

        bound = greatest(probability, 1 - self._params.probability, highest)
        # the pair that alone would have the least bound
        alone = np.max([(distances - self._quantile * sigmas).min(axis=0) for distances, sigmas in statements], axis=0)
        link, row = divmod(int(alone.argmin()), len(ages))
        distance = max(float(away.min()), 0.0)
        return Separation(distance, min(bound, distance), links.names[link], int(known.persons[row]),
                          PARTS[known.parts[row]], int(known.status[row]), float(ages[row]))

    def _margins(self, known: MovingParts, ages: np.ndarray, links: Links, most: float
                 ) -> Tuple[np.ndarray, np.ndarray]:
        """Return what `margins_of` parts that moved on for at most so long [s], and walk since."""
        moved = np.minimum(ages, most)[:, np.newaxis]
        sigma = np.hypot(known.sigma, known.speeds * moved)
        ends, rest = known.ends + known.velocity * moved[..., np.newaxis], ages[:, np.newaxis] - moved
        walked = self._constants.walking * rest + np.minimum(self._constants.limbs * rest, known.swings)
        return margins_of(known, ends, sigma, links, walked)

    def _of(self, people: People3D, stamp: float) -> Tuple[MovingParts, MovingParts]:
        """Return the parts of the people of a frame, and the spheres within reach of measured joints that hold them."""
        known, missing = known_parts(people, self._capsules, self._body), self._reaches_of(people)
        parts = self._rows(known, np.where(known.measured, MEASURED, INFERRED), known.radii, stamp).and_of(
            self._rows(missing, np.full(len(missing), MISSING), np.zeros(len(missing)), stamp))
        other = people.status != MEASURED
        reaches = self._reaches_of(replace(
            people, xyz=np.where(other[..., np.newaxis], np.nan, people.xyz),
            status=np.where(other, MISSING, people.status), sigma=np.where(other, np.nan, people.sigma)))
        around = self._rows(reaches, np.full(len(reaches), MEASURED), np.zeros(len(reaches)), stamp)
        by_part = {key: row for row, key in enumerate(zip(around.persons.tolist(), around.parts.tolist()))}
        own = np.array([by_part.get(key, -1) for key in zip(parts.persons.tolist(), parts.parts.tolist())], int)
        # what has no such sphere may be anywhere, by this statement
        spheres = parts._replace(radii=np.full(len(own), np.inf))
        return parts, spheres.and_of(around).where(np.where(own >= 0, len(own) + own, np.arange(len(own))))

    def _reaches_of(self, people: People3D) -> Capsules:
        return reaches_of(people, self._capsules, self._body, self._constants.feet)

    def _rows(self, capsules: Capsules, status: np.ndarray, skins: np.ndarray, stamp: float) -> MovingParts:
        constants, paces = self._constants, self._paces[capsules.points]
        with np.errstate(invalid='ignore'):
            moves = np.linalg.norm(capsules.velocity, axis=2) <= constants.greatest_speed
        inferred = np.where(_ENDS[capsules.points], constants.inferred_end_error, constants.inferred_error)
        error = np.where((status == MEASURED)[:, np.newaxis], 1.0, inferred)
        # what moves at an unknown velocity stays within `walking` by the other statement
        speeds = np.where(moves, constants.speed_error * paces, constants.walking + constants.limbs)
        return MovingParts(
            capsules.persons, capsules.parts, status, np.full(len(capsules), stamp), capsules.ends,
            capsules.radii, skins, capsules.known_sigma * error, speeds,
            np.where(moves[..., np.newaxis], capsules.velocity, 0.0), self._swings[capsules.points])


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


