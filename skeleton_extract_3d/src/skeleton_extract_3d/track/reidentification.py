"""Who comes back: newcomers who are somebody that left the image, was hidden or was lost a short time ago."""
from dataclasses import replace
from typing import Iterator, NamedTuple, Tuple

import numpy as np

from skeleton_extract_3d.body import measures
from skeleton_extract_3d.body.body import MEASURED_BONES, MEASURED_KINDS
from skeleton_extract_3d.body.measures import Sizes
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.surfaces import lower_median
from skeleton_extract_3d.settings import IdentityParams
from skeleton_extract_3d.track.appearance import Clothes, clothes_evidence, log_normal
from skeleton_extract_3d.track.identity import stature_spread
from skeleton_extract_3d.track.memory import Memory
from skeleton_extract_3d.track.observations import Sightings, begin_tracks, newcomers
from skeleton_extract_3d.track.tracks import Tracks, middle_of_trunk

_BODY, _RETURNING = METHOD.body, METHOD.track.returning
# Rows of newcomers who are nobody absent, and of those of whom that can not be told yet.
STRANGER, UNCLEAR = -1, -2
_KINDS = MEASURED_KINDS[:len(MEASURED_BONES)]


class Newcomers(NamedTuple):
    """N people of a frame who have no track.

    Attributes:
        place: (N, 3) middle of the trunk [m].
        clothes: of this frame.
        lengths: (N, 10) of the bones that are seen in this frame [m], as `body.MEASURED_BONES`; NaN of others.
    """

    place: np.ndarray
    clothes: Clothes
    lengths: np.ndarray

    @classmethod
    def of(cls, people: Sightings) -> 'Newcomers':
        """Return what a frame shows of people."""
        lifted, seen = people.lifted, people.observed
        sure = lifted.measured & (seen.scores > METHOD.sizes.least_score)
        start, end = lifted.xyz[:, MEASURED_BONES[:, 0]], lifted.xyz[:, MEASURED_BONES[:, 1]]
        lengths = np.where(sure[:, MEASURED_BONES].all(axis=2), np.linalg.norm(end - start, axis=2), np.nan)
        return cls(middle_of_trunk(lifted.xyz, seen.known), people.clothes, lengths)


def welcome(memory: Memory, tracks: Tracks, people: Sightings, stamp: float, ids: Iterator[int],
            params: IdentityParams) -> Tuple[Memory, Tracks, Sightings]:
    """Return what is remembered, the tracks with one for each newcomer, and the people who have a track.

    Newcomers who were here before keep id, sizes and clothes. The track that they had stays, see `without`.

    Args:
        tracks: predicted to this frame.
        people: of the frame, newcomers with row -1.
        stamp: [s].
        ids: where ids come from.
    """
    new = newcomers(people, params)
    absent = tracks.kept(people.others(len(tracks))).joined(memory.gone)
    rows = recognize(absent, Newcomers.of(people.select(new)), stamp, params)
    unclear = rows == UNCLEAR
    waiting = (stamp if memory.waiting is None else memory.waiting) if unclear.any() else None
    if waiting is not None and stamp - waiting < _RETURNING.patience:
        new, rows = new[~unclear], rows[~unclear]
    if len(new):
        given = people.observed.people_2d.ids
        if params.tracking or (given < 0).any():
            given = np.full(len(given), -1)
            given[new] = [absent.ids[row] if row >= 0 else next(ids) for row in rows]
        begun = begin_tracks(people.select(new), stamp, given[new])
        row = people.row.copy()
        row[new] = np.arange(len(tracks), len(tracks) + len(new))
        people, tracks = people._replace(row=row), tracks.joined(_as_before(begun, absent, rows))
    has_track = people.row >= 0
    people = people if has_track.all() else people.select(np.flatnonzero(has_track))
    return replace(memory, waiting=waiting), tracks, people


def _as_before(begun: Tracks, absent: Tracks, rows: np.ndarray) -> Tracks:
    """Return new tracks, with what was known of those whose rows in the absent ones, (N,), are not negative."""
    back = np.flatnonzero(rows >= 0)
    if not len(back):
        return begun
    known, others = absent.select(rows[back]), np.flatnonzero(rows < 0)
    same = replace(begun.select(back), sightings=known.sightings, sizes=known.sizes, clothes=known.clothes)
    return begun.select(others).joined(same).select(np.argsort(np.concatenate([others, back])))


def without(tracks: Tracks, present: Tracks) -> Tracks:
    """Return tracks without those that came back as others."""
    return tracks.kept(~np.isin(tracks.ids, present.ids))


def recognize(absent: Tracks, new: Newcomers, stamp: float, params: IdentityParams) -> np.ndarray:
    """Return the row of the absent person that each newcomer is, or STRANGER or UNCLEAR, (N,) int64.

    Clothes, size and place have to be much likelier for somebody absent than for a stranger, for any other absent
    person, and for any other newcomer. It is unclear where a part of the clothes that could tell is not in view yet.

    Args:
        absent: people who are not seen, where they are expected.
        stamp: [s].
    """
    rows = np.full(len(new.place), STRANGER, np.int64)
    if not len(absent) or not len(rows):
        return rows
    away = (stamp - absent.last_seen)[:, None]
    distance = np.linalg.norm(absent.root.position[:, :1] - new.place[None], axis=2)
    may_be = (away >= _RETURNING.least_away) & (distance <= params.track_gate + _RETURNING.greatest_speed * away)
    likelier, compared = clothes_evidence(absent.clothes, new.clothes)
    likelier += size_evidence(absent.sizes, new.lengths) + place_evidence(distance, away)
    likelier = np.where(may_be, likelier, -np.inf)
    could_tell = ((absent.clothes.weights > 0)[:, None] & ~compared).any(axis=2)
    rows[(could_tell & (likelier > -_RETURNING.least_evidence)).any(axis=0)] = UNCLEAR
    likelier = np.where(compared.any(axis=2), likelier, -np.inf)
    for person, row in enumerate(likelier.argmax(axis=0)):
        rivals = np.concatenate([np.delete(likelier[:, person], row), np.delete(likelier[row], person)])
        if likelier[row, person] >= max(_RETURNING.least_evidence, rivals.max(initial=-np.inf) + _RETURNING.margin):
            rows[person] = row
    return rows


def size_evidence(absent: Sizes, lengths: np.ndarray) -> np.ndarray:
    """Return by how much the same body is likelier than a stranger's, (T, N); 0 where too few bones are seen.

    Args:
        absent: of T people.
        lengths: (N, 10) of `body.MEASURED_BONES` [m], NaN where they are not seen.
    """
    known, adult = measures.expected_lengths(absent)[:, _KINDS], _BODY.bone_lengths[_KINDS]
    against_known = lower_median(np.log(lengths)[None] - np.log(known)[:, None])
    against_adults = lower_median(np.log(lengths) - np.log(adult))
    seen = np.isfinite(lengths).sum(axis=1) >= METHOD.sizes.least_bones
    spread = np.hypot(stature_spread(absent), _RETURNING.seen_size)[:, None]
    return np.where(seen, log_normal(against_known, spread) - log_normal(against_adults, _RETURNING.strange_size), 0.0)


def place_evidence(distance: np.ndarray, away: np.ndarray) -> np.ndarray:
    """Return by how much a place is likelier for somebody absent than for a stranger, who may come anywhere, (T, N).

    Args:
        distance: from where somebody is expected [m].
        away: time since they were seen [s].
    """
    spread = np.minimum(_RETURNING.spread_at_once + _RETURNING.spread_growth * away, _RETURNING.greatest_spread)
    return np.log(_RETURNING.room / (2 * np.pi * spread ** 2)) - (distance / spread) ** 2 / 2
