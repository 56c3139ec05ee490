"""The people of one frame as the tracks take them in: observed, identified and lifted, in one record.

Two bodies cannot be in one place: of people who fill the same space, one stays.
"""
from dataclasses import replace
from typing import NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import JOINTS, TRUNK
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.records import Lifted, ObservedPeople
from skeleton_extract_3d.lift.surfaces import lower_median
from skeleton_extract_3d.settings import IdentityParams
from skeleton_extract_3d.track.appearance import Clothes
from skeleton_extract_3d.track.completion import Completion
from skeleton_extract_3d.track.tracks import Tracks

_IDENTITY, _ONE_BODY = METHOD.track.identity, METHOD.track.one_body
_OF_TRUNK = np.isin(np.arange(len(JOINTS)), TRUNK)
_SWAP = np.array(COCO_18.swap)


class Sightings(NamedTuple):
    """P people of one frame.

    Attributes:
        row: (P,) int64, row of each person's track; -1 where there is none.
        observed: keypoints and surfaces.
        clothes: colours of the clothes.
        lifted: joints in space.
    """

    row: np.ndarray
    observed: ObservedPeople
    clothes: Clothes
    lifted: Lifted

    def select(self, people: np.ndarray) -> 'Sightings':
        """Return some of the people, by indices, in the order of these."""
        return Sightings(self.row[people], self.observed.select(people), self.clothes.select(people),
                         self.lifted.select(people))

    def others(self, count: int) -> np.ndarray:
        """Return which of the first tracks are none of these people's, (count,) bool."""
        others = np.ones(max(count, self.row.max(initial=-1) + 1), bool)
        others[self.row[self.row >= 0]] = False
        return others[:count]

    def size_error(self) -> np.ndarray:
        """Return the error of people without a single surface, whose depth their size alone tells, (P, 1) [m]; else 0.
        """
        lifted = self.lifted
        return np.where(lifted.measured.any(axis=1), 0.0, METHOD.body.stature_spread * lifted.root)[:, None]


def newcomers(people: Sightings, params: IdentityParams) -> np.ndarray:
    """Return the people without a track who may get one, indices (N,)."""
    seen, lifted = people.observed, people.lifted
    followed = people.row >= 0
    # what can not be measured does not speak against a newcomer
    measurable = (seen.known & np.isfinite(seen.samples).any(axis=2)).sum(axis=1)
    new = ~followed & (lifted.measured.sum(axis=1) >= np.minimum(params.birth_joints, measurable))
    return np.flatnonzero(new & ~repeated(lifted.xyz, seen.known, followed))


def begin_tracks(people: Sightings, stamp: float, ids: np.ndarray) -> Tracks:
    """Return new tracks of people, with ids (P,), at a time [s]."""
    known, lifted = people.observed.known, people.lifted
    return Tracks.begun(ids, stamp, np.where(known[..., None], lifted.xyz, np.nan), lifted.left, lifted.stature)


def repeated(xyz: np.ndarray, known: np.ndarray, followed: np.ndarray) -> np.ndarray:
    """Return which newcomers stand where somebody stands who is followed already, (P,) bool.

    Args:
        xyz: (P, 18, 3) [m].
        known: (P, 18) bool, joints with a keypoint.
        followed: (P,) bool, who is followed already.
    """
    if followed.all():
        return ~followed
    same = in_one_place(xyz, known, _IDENTITY.repeated_joints, _IDENTITY.repeated_distance)
    return ~followed & (same & followed[None]).any(axis=1)


def in_one_place(xyz: np.ndarray, placed: np.ndarray, least_joints: int, reach: float) -> np.ndarray:
    """Return who fills the same space, (P, P) bool: most joints are near, where left and right may be exchanged.

    Args:
        xyz: (P, 18, 3) [m].
        placed: (P, 18) bool, joints that count.
        least_joints: that both must have.
        reach: median distance of who is in one place [m].
    """
    same = np.zeros((len(xyz), len(xyz)), bool)
    for order in (np.arange(len(_SWAP)), _SWAP):
        both = placed[:, None] & placed[None][..., order]
        distance = np.where(both, np.linalg.norm(xyz[:, None] - xyz[None][:, :, order], axis=3), np.inf)
        with np.errstate(invalid='ignore'):
            same |= (both.sum(axis=2) >= least_joints) & (lower_median(distance) < reach)
    return same


def _halves(xyz: np.ndarray, placed: np.ndarray, trusted: np.ndarray) -> np.ndarray:
    """Return who are halves of one person, (P, P) bool: hardly a joint in common, and the trunk in one place.

    Args:
        xyz: (P, 18, 3) [m].
        placed, trusted: (P, 18) bool, see `Completion`.
    """
    common = (trusted[:, None] & trusted[None]).sum(axis=2)
    return (common <= _IDENTITY.halves_common) & in_one_place(
        xyz, placed & _OF_TRUNK, _ONE_BODY.least_joints, _ONE_BODY.halves_apart)


def separate(seen: Completion, people: Sightings, stamp: float) -> Tuple[Completion, Sightings, Tracks]:
    """Return the people of a frame without those who have been in somebody's place for too long.

    The one who is followed for longer stays, so that ids last. Newcomers go at once.

    Args:
        seen, people: the same N people.
        stamp: of the frame [s].

    Returns:
        Who stays, and the tracks of those who were somewhere else before: they are real, and what is seen is not them.
    """
    tracks = seen.tracks
    if len(tracks) < 2:
        return seen._replace(tracks=replace(tracks, alone=np.full(len(tracks), stamp))), people, Tracks.none()
    shared = in_one_place(tracks.joints.position, seen.placed, _ONE_BODY.least_joints, _ONE_BODY.thickness)
    shared |= _halves(tracks.joints.position, seen.placed, seen.trusted)
    oldest = np.lexsort((tracks.ids, -seen.trusted.sum(axis=1), tracks.born))
    gone, alone = np.zeros(len(tracks), bool), np.full(len(tracks), stamp)
    for i, person in enumerate(oldest):
        before = oldest[:i]
        if (shared[person, before] & ~gone[before]).any():
            alone[person] = tracks.alone[person]
            gone[person] = stamp - alone[person] >= _ONE_BODY.longest
    tracks = replace(tracks, alone=alone)
    if not gone.any():
        return seen._replace(tracks=tracks), people, Tracks.none()
    kept = np.flatnonzero(~gone)
    real = gone & (tracks.alone - tracks.born >= _ONE_BODY.surely_alone)
    return (Completion(tracks.select(kept), seen.trusted[kept], seen.placed[kept], seen.sigma[kept]),
            people.select(kept), tracks.kept(real))


def apart(hidden: Tracks, seen: Completion) -> Tracks:
    """Return who of those not seen is not where somebody is seen."""
    if not len(hidden) or not len(seen.tracks):
        return hidden
    xyz = np.concatenate([hidden.joints.position, seen.tracks.joints.position])
    placed = np.concatenate([hidden.has, seen.placed])
    shared = in_one_place(xyz, placed, _ONE_BODY.least_joints, _ONE_BODY.thickness)
    return hidden.kept(~shared[:len(hidden), len(hidden):].any(axis=1))
