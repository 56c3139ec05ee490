"""Two bodies cannot be in one place: of people who fill the same space, one stays."""
from dataclasses import replace
from typing import Tuple

import numpy as np

from skeleton_extract_3d.body.body import JOINTS, SWAP, TRUNK
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.surfaces import lower_median
from skeleton_extract_3d.track.completion import Completion
from skeleton_extract_3d.track.constants import OneBodyConstants, TrackConstants
from skeleton_extract_3d.track.tracks import Observations, Tracks

_OF_TRUNK = np.isin(np.arange(len(JOINTS)), TRUNK)
_SIDES = np.array([np.arange(len(JOINTS)), SWAP])  # the joints as they are, and with left and right exchanged


def in_one_place(xyz: np.ndarray, placed: np.ndarray, least_joints: int, reach: float) -> np.ndarray:
    """Return which people fill the same space, (P, P) bool: most joints are near; left and right may be exchanged.

    Args:
        placed: (P, 18) bool, joints that count; both must have `least_joints`.
        reach: greatest median distance in one place [m].
    """
    off = xyz[:, None, None] - xyz[:, _SIDES]
    common = placed[:, None, None] & placed[:, _SIDES]
    distance = np.where(common, np.sqrt(np.einsum('...i,...i', off, off)), np.nan)
    return ((common.sum(axis=3) >= least_joints) & (lower_median(distance) < reach)).any(axis=2)


def _halves(seen: Completion, constants: TrackConstants) -> np.ndarray:
    """Return which people are halves of one person, (P, P) bool: few joints in common, and the trunk in one place."""
    few = (seen.trusted[:, None] & seen.trusted[None]).sum(axis=2) < constants.one_body.least_joints
    if not few.any():
        return few
    return few & in_one_place(seen.tracks.joints.position, seen.placed & _OF_TRUNK, constants.one_body.least_joints,
                              constants.identity.same_place)


def separate(seen: Completion, people: Observations, stamp: float, constants: TrackConstants = METHOD.track
             ) -> Tuple[Completion, Observations, Tracks]:
    """Return people without those that share the place of an older track for too long, new ones at once, and the tracks
    of those that had a place of their own before, which are hidden now.
    """
    one_body, tracks = constants.one_body, seen.tracks
    if len(tracks) < 2:
        return seen._replace(tracks=replace(tracks, alone=np.full(len(tracks), stamp))), people, Tracks.none()
    shared = in_one_place(tracks.joints.position, seen.placed, one_body.least_joints, one_body.thickness)
    shared |= _halves(seen, constants)
    oldest = np.lexsort((tracks.ids, -seen.trusted.sum(axis=1), tracks.born))
    gone, alone = np.zeros(len(tracks), bool), np.full(len(tracks), stamp)
    for i, person in enumerate(oldest):
        before = oldest[:i]
        if (shared[person, before] & ~gone[before]).any():
            alone[person] = tracks.alone[person]
            gone[person] = stamp - alone[person] >= constants.identity.gap
    tracks = replace(tracks, alone=alone)
    if not gone.any():
        return seen._replace(tracks=tracks), people, Tracks.none()
    kept = np.flatnonzero(~gone)
    real = gone & (tracks.alone - tracks.born >= constants.identity.gap)
    return (Completion(tracks.select(kept), seen.trusted[kept], seen.placed[kept], seen.sigma[kept]),
            people.select(kept), tracks.select(real))


def apart(hidden: Tracks, seen: Completion, constants: OneBodyConstants = METHOD.track.one_body) -> Tracks:
    """Return the hidden tracks that are in the place of no visible person."""
    if not len(hidden) or not len(seen.tracks):
        return hidden
    xyz = np.concatenate([hidden.joints.position, seen.tracks.joints.position])
    placed = np.concatenate([hidden.has, seen.placed])
    shared = in_one_place(xyz, placed, constants.least_joints, constants.thickness)
    return hidden.select(~shared[:len(hidden), len(hidden):].any(axis=1))
