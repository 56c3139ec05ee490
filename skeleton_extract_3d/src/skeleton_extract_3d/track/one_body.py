"""Two bodies cannot be in one place: of people who fill the same space, one stays."""
import numpy as np

from skeleton_extract_3d.body.body import JOINTS, SWAP
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.surfaces import lower_median
from skeleton_extract_3d.track.completion import Completion
from skeleton_extract_3d.track.constants import OneBodyConstants, TrackConstants
from skeleton_extract_3d.track.tracks import IN_TRUNK, Tracks

_SIDES = np.array([np.arange(len(JOINTS)), SWAP])  # the joints as they are, and with left and right exchanged


def in_one_place(xyz: np.ndarray, placed: np.ndarray, least_joints: int, reach: float, exchanged: bool = True
                 ) -> np.ndarray:
    """Return which people fill the same space, (P, P) bool: most joints are near.

    Args:
        placed: (P, 18) bool, joints that count; both must have `least_joints`.
        reach: greatest median distance in one place [m].
        exchanged: left and right may be exchanged: two who hug are then up to 0.2 m nearer to each other.
    """
    sides = _SIDES if exchanged else _SIDES[:1]
    off = xyz[:, None, None] - xyz[:, sides]
    common = placed[:, None, None] & placed[:, sides]
    distance = np.where(common, np.sqrt(np.einsum('...i,...i', off, off)), np.nan)
    return ((common.sum(axis=3) >= least_joints) & (lower_median(distance) < reach)).any(axis=2)


def sharing(seen: Completion, looked: np.ndarray, constants: TrackConstants = METHOD.track) -> np.ndarray:
    """Return which people are in the place of another one who is likelier to be there, (P,) bool.

    A surface belongs to one body: such a person's detection is that of the other.

    Args:
        looked: (P,) bool, people that a network saw.
    """
    one_body, tracks = constants.one_body, seen.tracks
    taken = np.zeros(len(tracks), bool)
    if len(tracks) < 2:
        return taken
    position, least = tracks.joints.position, one_body.least_joints
    shared = in_one_place(position, seen.placed, least, one_body.thickness)
    # halves of one person have few joints in common, and the trunk in one place
    few = (seen.trusted[:, None] & seen.trusted[None]).sum(axis=2) < least
    if few.any():
        shared |= few & in_one_place(position, seen.placed & IN_TRUNK, least, constants.identity.same_place)
    unsure = tracks.existence < one_body.sure
    near = in_one_place(position, seen.placed, least, constants.identity.same_place, exchanged=False)
    shared |= near & (unsure | unsure[:, None])
    likeliest = np.lexsort((tracks.ids, -seen.trusted.sum(axis=1), tracks.born, ~looked))
    for i, person in enumerate(likeliest):
        before = likeliest[:i]
        taken[person] = (shared[person, before] & ~taken[before]).any()
    return taken


def apart(hidden: Tracks, seen: Completion, constants: OneBodyConstants = METHOD.track.one_body) -> Tracks:
    """Return the hidden tracks that are in the place of no visible person."""
    if not len(hidden) or not len(seen.tracks):
        return hidden
    xyz = np.concatenate([hidden.joints.position, seen.tracks.joints.position])
    placed = np.concatenate([hidden.has, seen.placed])
    shared = in_one_place(xyz, placed, constants.least_joints, constants.thickness)
    return hidden.select(~shared[:len(hidden), len(hidden):].any(axis=1))
