"""Cameras without depth: people are where their rays meet; one alone places them by their size."""
import itertools
from dataclasses import replace
from typing import Iterator, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from openpose_ros_fusion.association import FAR, KnownIds, Matches, match_people
from openpose_ros_fusion.constants import AssociationConstants, FusionConstants, SingleViewConstants
from openpose_ros_fusion.estimate import Measurements, estimate_joints
from openpose_ros_fusion.observations import Sighting
from openpose_ros_fusion.tracks import Tracks
from skeleton_extract_3d.body.body import SATISFIED_BONES
from skeleton_extract_3d.body.measures import expected_lengths

# The person that each of some cameras sees: indices of people by indices of sightings.
_Meeting = Mapping[int, int]


def tracks_where_rays_meet(tracks: Tracks, matches: Matches, known: KnownIds, ids: Iterator[int],
                           constants: FusionConstants) -> Tuple[Tracks, Matches]:
    """Return the tracks with people where the rays of cameras meet, and the matches, also of the other cameras.

    They are new, or a track whose place is not known: one that one camera alone sees, without depth.
    """
    matches = _without_strangers(matches, constants.association)
    met = _meetings(tracks, matches, constants)
    if not met:
        return tracks, matches
    for meeting in met:
        tracks, matches = _with_meeting(tracks, matches, meeting, ids, constants)
    # people that are placed now have not moved since
    near = replace(constants, association=replace(constants.association, gate=constants.association.same_place))
    return tracks, Matches(len(tracks), tuple(
        (sighting, match_people(sighting, tracks, known, near, rows)) for sighting, rows in matches.pairs))


def _meetings(tracks: Tracks, matches: Matches, constants: FusionConstants) -> List[_Meeting]:
    """Return the people whose rays meet, of those of cameras without depth that have no track or are in one view alone.

    Groups of people, one of each camera at most, grow from those that meet best, as long as the mean distance between
    two of them is within the gate (average linkage).
    """
    # the last entry is for people without a track, of row -1
    alone = np.append(matches.views == 1, True)
    people = [(number, person) for number, (sighting, rows) in enumerate(matches.pairs)
              if not sighting.has_depth and tracks.stamp - sighting.stamp <= constants.motion.reported_gap
              for person in np.flatnonzero(alone[rows]).tolist()]
    if len({camera for camera, _ in people}) < 2:
        return []
    camera, person = np.array(people).T
    cost = np.full((len(people), len(people)), FAR)
    for first, second in itertools.combinations(np.unique(camera), 2):
        one, other = np.flatnonzero(camera == first), np.flatnonzero(camera == second)
        cost[np.ix_(one, other)] = ray_distances(matches.pairs[first][0].select(person[one]),
                                                 matches.pairs[second][0].select(person[other]), constants.association)
    cost = np.minimum(cost, cost.T)
    groups = fcluster(linkage(cost[np.triu_indices(len(cost), 1)], 'average'), constants.association.same_place,
                      'distance')
    meetings = [dict(zip(camera[groups == group].tolist(), person[groups == group].tolist()))
                for group in np.unique(groups)]
    return [meeting for meeting in meetings if len(meeting) > 1]


def _with_meeting(tracks: Tracks, matches: Matches, meeting: _Meeting, ids: Iterator[int], constants: FusionConstants
                  ) -> Tuple[Tracks, Matches]:
    """Return the tracks and matches with a person where rays meet."""
    before = {int(matches.pairs[camera][1][person]) for camera, person in meeting.items()} - {-1}
    if len(before) > 1:
        return tracks, matches  # they have tracks of their own
    positions = _where_rays_meet([(matches.pairs[camera][0], np.array([person]))
                                  for camera, person in meeting.items()], constants)
    row = before.pop() if before else len(tracks)
    tracks = (tracks.placed(row, positions[0]) if row < len(tracks) else
              tracks.joined(Tracks.begun(tracks.stamp, ids, positions)))
    pairs = tuple((sighting, np.where(np.arange(len(rows)) == meeting.get(number, -1), row, rows))
                  for number, (sighting, rows) in enumerate(matches.pairs))
    return tracks, Matches(len(tracks), pairs)


def _where_rays_meet(seen: Sequence[Tuple[Sighting, np.ndarray]], constants: FusionConstants) -> np.ndarray:
    """Return the joints (1, 18, 3) [m] of a person that cameras see: by rays of equal weight, then of equal angles."""
    owner = np.zeros(len(seen), int)
    points = np.concatenate([sighting.points(person) for sighting, person in seen])
    at = np.concatenate([sighting.origin + sighting.directions[person] for sighting, person in seen])
    for _ in range(2):
        information = np.concatenate([sighting.information(at[[row]], person)
                                      for row, (sighting, person) in enumerate(seen)])
        positions = estimate_joints(1, Measurements(owner, points, information), constants.estimate).positions
        at = np.broadcast_to(positions, points.shape)
    return positions


def _without_strangers(matches: Matches, constants: AssociationConstants) -> Matches:
    """Return the matches without tracks of which cameras without depth see different people: their rays do not meet."""
    rays = [number for number, (sighting, _) in enumerate(matches.pairs) if not sighting.has_depth]
    meet, miss = ({number: np.zeros(len(matches.pairs[number][1]), int) for number in rays} for _ in range(2))
    has_depth = np.zeros(matches.tracks + 1, bool)
    for sighting, rows in matches.pairs:
        has_depth[rows] |= sighting.has_depth
    has_depth[-1] = True  # people without a track
    for first, second in itertools.combinations(rays, 2):
        (sighting, rows), (other_sighting, other_rows) = matches.pairs[first], matches.pairs[second]
        near = ray_distances(sighting, other_sighting, constants) <= constants.same_place
        compared = (rows[:, np.newaxis] == other_rows) & ~has_depth[rows][:, np.newaxis]
        for counts, found in ((meet, compared & near), (miss, compared & ~near)):
            counts[first] += found.sum(axis=1)
            counts[second] += found.sum(axis=0)
    return Matches(matches.tracks, tuple(
        (sighting, np.where(miss[number] > meet[number], -1, rows) if number in meet else rows)
        for number, (sighting, rows) in enumerate(matches.pairs)))


def ray_distances(first: Sighting, second: Sighting, constants: AssociationConstants) -> np.ndarray:
    """Return how far the rays of two cameras' people pass by each other, (P, Q) [m]; far where they can not meet.

    It is the distance within which those of `ray_share` of the joints meet: joints that are as high as the cameras meet
    those of other people too.
    """
    gaps, in_front = ray_gaps(first.origin, first.directions[:, np.newaxis], second.origin, second.directions)
    common = np.isfinite(gaps).sum(axis=2)
    usable = np.isfinite(gaps) & in_front
    count = usable.sum(axis=2)
    ordered = np.sort(np.where(usable, gaps, FAR), axis=2)
    last = np.maximum(np.ceil(constants.ray_share * count).astype(int) - 1, 0)[..., np.newaxis]
    meet = (count >= constants.least_joints) & (count >= constants.ray_share * common)
    return np.where(meet, np.take_along_axis(ordered, last, axis=2)[..., 0], FAR)


def ray_gaps(origin: np.ndarray, rays: np.ndarray, other: np.ndarray, others: np.ndarray
             ) -> Tuple[np.ndarray, np.ndarray]:
    """Return how near rays come to each other, (..., K) [m], and whether that is before both cameras, (..., K) bool.

    Args:
        origin, other: (3,) [m], where the rays begin.
        rays, others: (..., K, 3), unit vectors; NaN where missing.
    """
    base = other - origin
    cosine = (rays * others).sum(axis=-1)
    along, along_other = rays @ base, others @ base
    with np.errstate(invalid='ignore', divide='ignore'):
        scale = 1.0 - cosine ** 2
        depth = (along - cosine * along_other) / scale
        depth_other = (cosine * along - along_other) / scale
        gap = np.linalg.norm(depth[..., np.newaxis] * rays - base - depth_other[..., np.newaxis] * others, axis=-1)
        return np.where(scale > 1e-4, gap, np.nan), (depth > 0) & (depth_other > 0)


def place_by_size(tracks: Tracks, matches: Matches, constants: FusionConstants) -> Tracks:
    """Return the tracks with those in the view of one camera alone, without depth, where their size puts them.

    They are moved as predicted, without a change of pose and as large as they are known to be, to where their joints
    are nearest to the rays.
    """
    alone, lengths = np.append(matches.views == 1, False), expected_lengths(tracks.sizes)
    for sighting, rows in matches.pairs:
        for person in np.flatnonzero(alone[rows]):
            row = rows[person]
            body = with_size(tracks.positions[row], lengths[row], constants.single_view)
            shift = shift_onto_rays(body, sighting, person, constants)
            if shift is not None:
                distance = float(np.linalg.norm(np.nanmean(body, axis=0) + shift - sighting.origin))
                most = (constants.single_view.size_error * distance) ** 2
                share = np.minimum(most / np.maximum(tracks.covariance[row, :, :1], 1e-12), 1.0)
                # the body moves as one
                tracks = tracks.placed(row, body + shift, tracks.velocities[row].mean(axis=0),
                                       tracks.covariance[row] * np.hstack([share, share, np.ones_like(share)]))
    return tracks


def with_size(joints: np.ndarray, lengths: np.ndarray, constants: SingleViewConstants) -> np.ndarray:
    """Return a body (18, 3) [m] whose size is nearer to what lengths (8,) [m] of its bones say, in the same pose.

    A part of the difference is corrected at a time, since noise of single frames makes bones look longer.
    """
    starts, ends, kinds = SATISFIED_BONES.T
    found = np.linalg.norm(joints[starts] - joints[ends], axis=1)
    known = np.isfinite(found)
    scale = (lengths[kinds][known].sum() / found[known].sum()) ** constants.size_gain if known.any() else 1.0
    middle = np.nanmean(joints, axis=0)
    return middle + scale * (joints - middle)


def shift_onto_rays(joints: np.ndarray, sighting: Sighting, person: int, constants: FusionConstants
                    ) -> Optional[np.ndarray]:
    """Return by what (3,) [m] a body (18, 3) has to be moved so that its joints are nearest to the rays of a person.

    None: too few joints are visible. Robust least squares of the distances from the rays,
    t = (sum P_k)^-1 sum P_k (o - x_k) with P_k = 1 - d_k d_k'.
    """
    rays = sighting.directions[person]
    used = np.isfinite(joints).all(axis=1) & np.isfinite(rays).all(axis=1)
    if used.sum() < constants.single_view.least_joints:
        return None
    offsets, rays = sighting.origin - joints[used], rays[used]
    weights = np.ones(len(rays))
    for _ in range(constants.estimate.rounds):
        across = np.eye(3) - rays[:, :, np.newaxis] * rays[:, np.newaxis]
        shift = np.linalg.solve((weights[:, np.newaxis, np.newaxis] * across).sum(axis=0),
                                np.einsum('k,kij,kj->i', weights, across, offsets))
        left = np.linalg.norm(np.einsum('kij,kj->ki', across, offsets - shift), axis=1)
        weights = 1 / (1 + (left / constants.association.same_place) ** 2)
    return shift
