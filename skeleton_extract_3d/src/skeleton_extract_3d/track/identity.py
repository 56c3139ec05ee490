"""Who is who: which person of a frame is which track, decided for all at once."""
from dataclasses import replace
from typing import Tuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from openpose_ros_pkg.people import People2D
from skeleton_extract_3d.body.measures import Sizes
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.settings import IdentityParams
from skeleton_extract_3d.track.appearance import Clothes, colour_distances
from skeleton_extract_3d.track.tracks import Tracks

_BODY, _IDENTITY = METHOD.body, METHOD.track.identity
_FORBIDDEN = 1e3


def assign(tracks: Tracks, seen: ObservedPeople, clothes: Clothes, stamp: float, params: IdentityParams
           ) -> np.ndarray:
    """Return the row of each person's track, -1 where there is none, (P,) int64.

    Args:
        tracks: predicted to this frame.
        seen: people of the frame.
        clothes: of these people.
        stamp: [s].
    """
    rows = np.full(len(seen), -1, np.int64)
    if not len(tracks) or not len(rows):
        return rows
    against = evidence_against(seen, tracks)
    across = distances_across(tracks.joints.position, tracks.has, seen.rays, seen.known)
    away = (stamp - tracks.last_seen)[:, None]
    allowed = across <= params.track_gate + params.walking_speed * away
    allowed &= (against <= _IDENTITY.most_evidence) | (across < _IDENTITY.same_place)
    cost = across / _IDENTITY.distance_unit + against / _IDENTITY.evidence_unit
    if params.use_clothes:
        colour = colour_distances(tracks.clothes, clothes) / _IDENTITY.colour_unit
        cost += (np.where(away > _IDENTITY.away, 1.0, _IDENTITY.present_share)
                 * np.minimum(colour, _IDENTITY.most_colour))
    track, person = linear_sum_assignment(np.where(allowed, cost, _FORBIDDEN))
    agreed = allowed[track, person]
    rows[person[agreed]] = track[agreed]
    return rows


def joined(tracks: Tracks, seen: ObservedPeople, row: np.ndarray) -> Tuple[People2D, np.ndarray]:
    """Return the people of a frame with halves of one person put together, and the rows of their tracks.

    Networks find somebody in two pieces where something lies across the body, or the border of the image does. A
    person without a track is a piece of another if it has joints that the other lacks, where the track of that one
    expects them.

    Args:
        tracks: predicted to this frame.
        seen: people of the frame.
        row: (P,) of their tracks; -1: none.
    """
    people, strangers = seen.people_2d, np.flatnonzero(row < 0)
    if not len(strangers) or len(strangers) == len(row):
        return people, row
    pieces = seen.select(strangers)
    across = distances_across(tracks.joints.position, tracks.has, pieces.rays, pieces.known)
    allowed = (across < _IDENTITY.same_place) & (evidence_against(pieces, tracks) <= _IDENTITY.most_evidence)
    # what covers a half may be nearer, but its own surfaces are not farther away
    behind = surfaces.lower_median(pieces.samples)[None] - tracks.joints.position[:, None, :, 2]
    with np.errstate(invalid='ignore'):
        allowed &= ~(surfaces.lower_median(np.where(tracks.has[:, None], behind, np.nan)) > _IDENTITY.halves_behind)
    nearest = np.where(allowed, across, np.inf).argmin(axis=0)
    keypoints, known, kept = people.keypoints.copy(), seen.known.copy(), np.ones(len(row), bool)
    for piece, track, possible in zip(strangers, nearest, allowed.any(axis=0)):
        owner = row == track
        if possible and owner.any() and (known[owner] & known[piece]).sum() <= _IDENTITY.halves_common:
            whole = np.where(keypoints[owner, :, 2:] > 0, keypoints[owner], keypoints[piece])
            keypoints[owner], known[owner], kept[piece] = whole, known[owner] | known[piece], False
    if kept.all():
        return people, row
    return replace(people, keypoints=keypoints).select(np.flatnonzero(kept)), row[kept]


def distances_across(position: np.ndarray, has: np.ndarray, rays: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the median distance of keypoints from tracks, across the view at the track's depth, (T, P) [m].

    Infinite where they have no joint in common.

    Args:
        position: (T, 18, 3) [m] of the tracks.
        has: (T, 18) bool, joints that the tracks have.
        rays: (P, 18, 3) of the keypoints, z = 1.
        known: (P, 18) bool, joints with a keypoint.
    """
    x, y, z = np.moveaxis(position[:, None], 3, 0)
    off_x, off_y = rays[None, ..., 0] * z - x, rays[None, ..., 1] * z - y
    both = has[:, None] & known[None]
    distance = surfaces.lower_median(np.where(both, np.sqrt(off_x * off_x + off_y * off_y), np.nan))
    return np.where(np.isfinite(distance), distance, np.inf)


def evidence_against(seen: ObservedPeople, tracks: Tracks) -> np.ndarray:
    """Return by how much another depth of the trunk is likelier than the track's, (T, P) log likelihood."""
    size = seen.adult_depth[None] * (tracks.sizes.stature / _BODY.adult_stature)[:, None]
    spread = np.broadcast_to(stature_spread(tracks.sizes)[:, None], size.shape)
    total = seen.trunk_evidence[None] + surfaces.size_evidence(size, spread)
    depth = np.maximum(tracks.root.position[:, 0, 2], 0.1)
    near = np.abs(np.log(surfaces.ROOT_DEPTHS / depth[:, None])) < _IDENTITY.same_depth
    there = np.where(near[:, None], total, -np.inf).max(axis=2)
    return np.minimum(total.max(axis=2) - there, _FORBIDDEN)


def stature_spread(sizes: Sizes) -> np.ndarray:
    """Return the standard deviation of each track's stature, as a share, (T,)."""
    return np.where(sizes.stature_weight > _IDENTITY.measured_frames, _IDENTITY.measured_spread, _BODY.stature_spread)
