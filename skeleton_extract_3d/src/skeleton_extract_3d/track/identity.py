"""Who is who: which person of a frame is which track, decided for all at once."""
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from openpose_ros_pkg.params.parameters import Parameters, parameter
from skeleton_extract_3d import compiled
from skeleton_extract_3d.body.body import ADULT_STATURE, STATURE_SPREAD
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.observation import ObservedPeople
from skeleton_extract_3d.track import appearance
from skeleton_extract_3d.track.tracks import Tracks

# The depth of the trunk is compared within this share of the track's.
_SAME_DEPTH = 0.08
# What one unit of cost is: this distance across the view [m], this log likelihood of the depth, this difference of
# colour.
_DISTANCE_UNIT, _EVIDENCE_UNIT, _COLOUR_UNIT = 0.3, 6.7, 25.0
# Colours count fully for those who were away this long [s], and always by the lesser share.
_AWAY, _PRESENT_SHARE = 0.3, 0.3
# Quite other colours do not say more than this: they may be those of what covers somebody.
_MOST_COLOUR = 2.0
# The surfaces may speak against a track's depth up to here (log likelihood), but not at all where the keypoints are
# this near to where they are expected [m]: of somebody who is almost hidden, most surfaces are another person's.
_MOST_EVIDENCE, _JUST_THERE = 20.0, 0.25
_FORBIDDEN = 1e3
# Two people whose joints are so near to each other are one [m], by so many joints.
_SAME_PERSON, _SHARED_JOINTS = 0.22, 2


@dataclass(frozen=True)
class IdentityParams(Parameters):
    """Who keeps which person_ID."""

    tracking: bool = parameter(
        True, 'Follow people from frame to frame in space. false: person_ID is that of the detection service, nothing '
              'is remembered, nothing is smoothed.')
    track_timeout: float = parameter(
        2.0, 'Somebody who is not detected for this long is forgotten and comes back with a new person_ID. Longer '
             'bridges longer occlusions.', unit='s', minimum=0.0, maximum=60.0)
    track_gate: float = parameter(
        0.5, 'Greatest median distance, across the view, of the joints from where they are expected, at which it is '
             'still the same person.', unit='m', minimum=0.05, maximum=5.0)
    walking_speed: float = parameter(
        1.2, 'The gate grows by this for each second that somebody was not detected.', unit='m/s', minimum=0.0,
        maximum=10.0)
    birth_joints: int = parameter(
        3, 'So many joints have to be measured before somebody gets a person_ID; fewer if no more can be measured.',
        minimum=1, maximum=18)
    use_clothes: bool = parameter(True, 'Tell people apart by the colours of their clothes as well.')


class Clothes:
    """Colours of the clothes of the people of one frame.

    Attributes:
        colours: (P, 2, 3) CIELAB of the upper and the lower part; known: (P, 2) bool.
    """

    def __init__(self, people: int) -> None:
        self.colours, self.known = np.zeros((people, 2, 3)), np.zeros((people, 2), bool)


def assign(tracks: Tracks, seen: ObservedPeople, clothes: Clothes, stamp: float, params: IdentityParams) -> np.ndarray:
    """Return the row of each person's track, -1 where there is none, (P,) int64.

    Args:
        tracks: predicted to this frame.
        seen: people of the frame.
        clothes: of these people.
        stamp: [s].
    """
    rows = np.full(len(seen.known), -1, np.int64)
    if not len(tracks) or not len(rows):
        return rows
    across = distances_across(tracks.joints.position, tracks.has, seen.rays, seen.known)
    against = evidence_against(seen.trunk_evidence, seen.adult_depth, tracks.stature / ADULT_STATURE,
                               stature_spread(tracks), tracks.root.position[:, 0, 2])
    away = (stamp - tracks.last_seen)[:, None]
    allowed = across <= params.track_gate + params.walking_speed * away
    allowed &= (against <= _MOST_EVIDENCE) | (across < _JUST_THERE)
    cost = across / _DISTANCE_UNIT + against / _EVIDENCE_UNIT
    if params.use_clothes:
        other = appearance.colour_distances(tracks.clothes, tracks.clothes_weight > 0, clothes.colours, clothes.known)
        other = np.minimum(other / _COLOUR_UNIT, _MOST_COLOUR)
        cost += np.where(away > _AWAY, 1.0, _PRESENT_SHARE) * other
    for track, person in zip(*linear_sum_assignment(np.where(allowed, cost, _FORBIDDEN))):
        if allowed[track, person]:
            rows[person] = track
    return rows


def repeated(xyz: np.ndarray, known: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return which people stand where another one stands who was followed before, (P,) bool.

    Args:
        xyz: (P, 18, 3) [m]; known: (P, 18) joints with a keypoint.
        kept: (P,) who was followed before.
    """
    if kept.all():
        return ~kept
    both = known[:, None] & known[None]
    distance = np.where(both, np.linalg.norm(xyz[:, None] - xyz[None], axis=3), np.inf)
    with np.errstate(invalid='ignore'):
        same = (both.sum(axis=2) >= _SHARED_JOINTS) & (surfaces.lower_median(distance) < _SAME_PERSON)
    return ~kept & (same & kept[None]).any(axis=1)


def distances_across(position: np.ndarray, has: np.ndarray, rays: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the median distance of keypoints from tracks, across the view at the track's depth, (T, P) [m].

    Infinite where they have no joint in common.

    Args:
        position: (T, 18, 3) [m], has: (T, 18) joints of the tracks.
        rays: (P, 18, 3) with z = 1, known: (P, 18) keypoints.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.distances_across(position, has, rays, known)
    off = rays[None, ..., :2] * position[:, None, :, 2:] - position[:, None, :, :2]
    both = has[:, None] & known[None]
    distance = surfaces.lower_median(np.where(both, np.sqrt((off * off).sum(axis=3)), np.nan))
    return np.where(np.isfinite(distance), distance, np.inf)


def evidence_against(evidence: np.ndarray, size: np.ndarray, scale: np.ndarray, spread: np.ndarray, z: np.ndarray
                     ) -> np.ndarray:
    """Return by how much another depth of the trunk is likelier than the track's, (T, P) log likelihood.

    Args:
        evidence: (P, depths) what the surfaces say.
        size: (P,) depth at which an adult looks as large [m].
        scale: (T,) stature in statures of an adult; spread: (T,) how well it is known, as a share.
        z: (T,) depth of the tracks' trunks [m].
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.evidence_against(evidence, size, scale, spread, z, same_depth=_SAME_DEPTH, most=_FORBIDDEN,
                                     **surfaces.SIZE_CONSTANTS)
    size = size[None] * scale[:, None]
    total = evidence[None] + surfaces.size_evidence(size, np.broadcast_to(spread[:, None], size.shape))
    near = np.abs(np.log(surfaces.ROOT_DEPTHS / np.maximum(z, 0.1)[:, None])) < _SAME_DEPTH
    there = np.where(near[:, None], total, -np.inf).max(axis=2)
    return np.minimum(total.max(axis=2) - there, _FORBIDDEN)


# A stature that was measured in so many frames is known to this share.
_MEASURED_FRAMES, _MEASURED_SPREAD = 3, 0.06


def stature_spread(tracks: Tracks) -> np.ndarray:
    """Return how well each track's stature is known, as a share, (T,)."""
    return np.where(tracks.stature_weight > _MEASURED_FRAMES, _MEASURED_SPREAD, STATURE_SPREAD)
