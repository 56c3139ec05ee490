"""Who is new: people who may get a track, and those of them who had one that left, was hidden or was lost."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.body import measures
from skeleton_extract_3d.body.body import MEASURED_KINDS
from skeleton_extract_3d.body.measures import Sizes
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.surfaces import lower_median
from skeleton_extract_3d.track.appearance import Clothes, clothes_evidence, log_normal
from skeleton_extract_3d.track.one_body import in_one_place
from skeleton_extract_3d.track.tracks import Observations, Tracks, middle_of_trunk

# Rows of new people that are no absent track, and of those of which that cannot be decided yet.
STRANGER, UNCLEAR = -1, -2
_KINDS = MEASURED_KINDS[:-1]  # without that of neck to hips


class NewPeople(NamedTuple):
    """N people without a track: middle of the trunk (N, 3), clothes, lengths of `MEASURED_BONES` (N, 10) or NaN [m]."""

    place: np.ndarray
    clothes: Clothes
    lengths: np.ndarray

    @classmethod
    def of(cls, people: Observations, least_score: float) -> 'NewPeople':
        """Return what a frame shows of people; keypoints below a score do not measure bones."""
        lifted, observed = people.lifted, people.observed
        sure = lifted.measured & (observed.scores > least_score)
        return cls(middle_of_trunk(lifted.xyz, observed.known), people.clothes,
                   measures.measured_lengths(lifted.xyz, sure))


def new_people(people: Observations, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the people without a track who may get one, indices (N,)."""
    constants, observed, lifted = method.track.identity, people.observed, people.lifted
    tracked = people.row >= 0
    if tracked.all():
        return np.zeros(0, np.int64)
    new = ~tracked & observed.has_measured(lifted.measured, constants.birth_joints)
    same = in_one_place(lifted.xyz, observed.known, method.track.one_body.least_joints, constants.same_place)
    return np.flatnonzero(new & ~(same & tracked[None]).any(axis=1))


def recognize(absent: Tracks, new: NewPeople, stamp: float, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the row of the absent track of each new person, (N,) int64, where clothes, size and place make it much
    likelier than any other track or person; else STRANGER, or UNCLEAR while clothes that could decide are not visible.
    """
    constants, rows = method.track.returning, np.full(len(new.place), STRANGER, np.int64)
    if not len(absent) or not len(rows):
        return rows
    away = (stamp - absent.last_seen)[:, None]
    distance = np.linalg.norm(absent.root.position[:, :1] - new.place[None], axis=2)
    may_be = (away > method.track.identity.gap) & (
        distance <= method.track.identity.gate + method.track.out_of_sight.greatest_speed * away)
    # a person who may appear anywhere does so in a room with a floor of 2 pi spread^2, 14 m^2, in view
    by_place = -(distance / constants.spread) ** 2 / 2
    by_body = _size_evidence(absent.sizes, new.lengths, method) + by_place
    by_clothes, compared = clothes_evidence(absent.clothes, new.clothes, method.track.appearance)
    likelier = np.where(may_be, by_clothes + by_body, -np.inf)
    could_tell = ((absent.clothes.weights > 0)[:, None] & ~compared).any(axis=2)
    rows[(could_tell & (likelier > -constants.least_evidence)).any(axis=0)] = UNCLEAR
    likelier = np.where(compared.any(axis=2), likelier, -np.inf)
    for person, row in enumerate(likelier.argmax(axis=0)):
        rivals = np.concatenate([np.delete(likelier[:, person], row), np.delete(likelier[row], person)])
        if likelier[row, person] >= max(rivals.max(initial=-np.inf), 0.0) + constants.least_evidence:
            rows[person] = row
    return rows


def _size_evidence(absent: Sizes, lengths: np.ndarray, method: MethodConstants) -> np.ndarray:
    """Return the log likelihood ratio of the same body to another, (T, N), by lengths (N, 10) [m]; 0 with few."""
    known, adult = measures.expected_lengths(absent, method)[:, _KINDS], method.body.bone_lengths[_KINDS]
    spread = np.hypot(measures.stature_spread(absent, method), method.body.proportion_spread)[:, None]
    against_known = lower_median(np.log(lengths)[None] - np.log(known)[:, None])
    against_adults = lower_median(np.log(lengths) - np.log(adult))
    enough = np.isfinite(lengths).sum(axis=1) >= method.sizes.least_bones
    evidence = log_normal(against_known, spread) - log_normal(against_adults, method.track.returning.strange_size)
    return np.where(enough, evidence, 0.0)
