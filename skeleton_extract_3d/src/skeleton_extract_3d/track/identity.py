"""Data association: which person of a frame is which track, decided for all at once."""
from dataclasses import replace
from typing import NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.people import People2D
from skeleton_extract_3d.body.measures import stature_spread
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.settings import IdentityParams
from skeleton_extract_3d.track.appearance import Clothes, clothes_evidence, colour_distances
from skeleton_extract_3d.track.constants import IdentityConstants
from skeleton_extract_3d.track.tracks import Tracks

# Greatest log likelihood ratio of another depth.
_MOST_AGAINST = 1e3


class TrackComparison(NamedTuple):
    """T tracks beside P people: median distance of keypoints from the track across the view at its depth, (T, P) [m],
    infinite without a common joint; log likelihood ratio of another depth of the trunk to the track's, (T, P); and
    whether the person was seen on the track's crop, (T, P) bool.
    """

    across: np.ndarray
    against: np.ndarray
    own: np.ndarray


def compare(tracks: Tracks, observed: ObservedPeople, given: np.ndarray, method: MethodConstants = METHOD
            ) -> TrackComparison:
    """Return the comparison of tracks, predicted to this frame, with the people of the frame.

    Args:
        given: ids of the tracks that expected the detections, by the numbers that `observed` has as ids.
    """
    own = tracks.ids[:, None] == given[observed.people_2d.ids]
    return TrackComparison(_distances_across(tracks, observed), _evidence_against(tracks, observed, method), own)


def assign(tracks: Tracks, clothes: Clothes, compared: TrackComparison, stamp: float, params: IdentityParams,
           constants: IdentityConstants = METHOD.track.identity) -> np.ndarray:
    """Return the row of each person's track, predicted to this frame, -1 where there is none, (P,) int64."""
    across, against, own = compared
    rows = np.full(across.shape[1], -1, np.int64)
    if not across.size:
        return rows
    away = (stamp - tracks.last_seen)[:, None]
    cost = across + constants.evidence_cost * against - constants.own_crop * own
    if params.use_clothes:
        cost += constants.colour_cost * colour_distances(tracks.clothes, clothes)
        away = np.where(clothes_evidence(tracks.clothes, clothes)[0] < constants.other_clothes, 0.0, away)
    allowed = across <= constants.gate + constants.walking_speed * away
    allowed &= (against <= constants.most_evidence) | (across < constants.same_place)
    for track, person in match(cost, allowed):
        rows[person] = track
    return rows


def joined(tracks: Tracks, observed: ObservedPeople, compared: TrackComparison, row: np.ndarray,
           method: MethodConstants = METHOD) -> Tuple[People2D, np.ndarray]:
    """Return the people of a frame with halves of one person put together, and the rows (P,) of their tracks.

    Networks split a person where an object lies across the body, or at the border of the image. A person without a
    track is a part of a tracked person who lacks its joints, where the track, predicted to this frame, expects them.
    """
    constants, people, new = method.track.identity, observed.people_2d, np.flatnonzero(row < 0)
    if not len(new) or len(new) == len(row):
        return people, row
    across = compared.across[:, new]
    allowed = (across < constants.same_place) & (compared.against[:, new] <= constants.most_evidence)
    # an occluder in front of a half may be nearer, but the half's own surfaces are not farther away
    behind = surfaces.lower_median(observed.samples[new])[None] - tracks.joints.position[:, None, :, 2]
    allowed &= ~(surfaces.lower_median(np.where(tracks.has[:, None], behind, np.nan)) > method.trunk.reach)
    nearest = np.where(allowed, across, np.inf).argmin(axis=0)
    keypoints, known, kept = people.keypoints.copy(), observed.known.copy(), np.ones(len(row), bool)
    points = None if people.points is None else people.points.copy()
    for part, track, possible in zip(new, nearest, allowed.any(axis=0)):
        owner = row == track
        if possible and owner.any() and (known[owner] & known[part]).sum() < method.track.one_body.least_joints:
            there = keypoints[owner, :, 2:] > 0
            if points is not None:
                points[owner] = np.where(points[owner, :, 2:] > 0, points[owner], points[part])
            whole = np.where(there, keypoints[owner], keypoints[part])
            keypoints[owner], known[owner], kept[part] = whole, known[owner] | known[part], False
    if kept.all():
        return people, row
    return replace(people, keypoints=keypoints, points=points).select(np.flatnonzero(kept)), row[kept]


def _distances_across(tracks: Tracks, observed: ObservedPeople) -> np.ndarray:
    """Return the distances of `TrackComparison`, (T, P) [m]."""
    rays, position = observed.rays, tracks.joints.position[:, None]
    z = position[..., 2]
    off_x, off_y = rays[..., 0] * z - position[..., 0], rays[..., 1] * z - position[..., 1]
    both = tracks.has[:, None] & observed.known[None]
    distance = surfaces.lower_median(np.where(both, np.sqrt(off_x * off_x + off_y * off_y), np.nan))
    return np.where(np.isfinite(distance), distance, np.inf)


def _evidence_against(tracks: Tracks, observed: ObservedPeople, method: MethodConstants) -> np.ndarray:
    """Return the log likelihood ratios of `TrackComparison`, (T, P)."""
    depths = method.trunk.depths
    size = observed.adult_depth[None] * (tracks.sizes.stature / method.body.adult_stature)[:, None]
    spread = stature_spread(tracks.sizes, method)[:, None]
    total = observed.trunk_evidence[None] + surfaces.size_evidence(size, spread, method)
    depth = np.maximum(tracks.root.position[:, 0, 2], method.trunk.nearest)
    near = np.abs(np.log(depths / depth[:, None])) < method.sizes.known
    there = np.where(near[:, None], total, -np.inf).max(axis=2)
    return np.minimum(total.max(axis=2) - there, _MOST_AGAINST)
