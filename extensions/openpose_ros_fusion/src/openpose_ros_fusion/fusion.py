"""One set of people out of what several cameras see: the order of all steps."""
import itertools
from dataclasses import replace
from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.association import CameraPerson, associate, pair_rays, ray_distances
from openpose_ros_fusion.constants import FUSION
from openpose_ros_fusion.estimate import Measurements, estimate_joints
from openpose_ros_fusion.innovations import Innovations
from openpose_ros_fusion.observations import Sighting, is_inferred
from openpose_ros_fusion.shape import depth_offsets, keypoint_offsets, with_bones, with_size
from openpose_ros_fusion.tracks import Tracks
from openpose_ros_fusion.triangulation import moved_onto_rays
from openpose_ros_pkg.people import FIRST_ID
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.measures import expected_lengths
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

_JOINTS = len(COCO_18.joints)
# People of two cameras are different ones where their rays pass by each other by this many gates.
_STRANGERS = 2.0


class _Assigned(NamedTuple):
    """People of a sighting and the rows of their fused people, (P,); -1: nobody's."""

    sighting: Sighting
    rows: np.ndarray


class _Seen(NamedTuple):
    """What an update says of the joints of F people.

    Attributes:
        status: (F, 18) uint8.
        confidence: (F, 18).
        variance: (F, 18), mean over the axes [m^2].
    """

    status: np.ndarray
    confidence: np.ndarray
    variance: np.ndarray


class PeopleFusion:
    """Follows people whom several cameras see; not thread-safe.

    Args:
        ids: where new people's ids come from; None: 1, 2, 3, ...
    """

    def __init__(self, ids: Optional[Iterator[int]] = None) -> None:
        self._ids = itertools.count(FIRST_ID) if ids is None else ids
        self._tracks = Tracks.empty(0.0)
        self._known: Dict[CameraPerson, int] = {}
        # when a camera saw each of them last [s]
        self._known_at: Dict[CameraPerson, float] = {}

    @property
    def known(self) -> Mapping[CameraPerson, int]:
        """Ids of the fused people by the persons of the cameras."""
        return self._known

    def update(self, sightings: Sequence[Sighting], stamp: float) -> People3D:
        """Return the people at a time.

        Args:
            sightings: of each camera one at most, new since the last time; those with other stamps are moved as their
                people move.
            stamp: [s]; a time before the last one begins anew.
        """
        if stamp < self._tracks.stamp or not len(self._tracks):
            self._tracks, self._known, self._known_at = Tracks.empty(stamp), {}, {}
        tracks = self._tracks.predicted(stamp)
        tracks = tracks.select(stamp - tracks.seen <= FUSION.motion.most_gap)
        tracks, assigned = _merged(*self._assign(tracks, sightings))
        for sighting, rows in assigned:
            for person, row in zip(sighting.ids.tolist(), rows.tolist()):
                if row >= 0:
                    self._known[sighting.camera, person] = int(tracks.ids[row])
                    self._known_at[sighting.camera, person] = stamp
        if not all(sighting.has_depth for sighting in sightings):
            tracks = _at_the_distance_of_rays(tracks, assigned)
        self._tracks, seen = _corrected(tracks, assigned)
        self._forget()
        return _reported(self._tracks, seen)

    def _forget(self) -> None:
        """Forget the persons of cameras that were not seen for long, or whose fused people are gone."""
        alive = set(self._tracks.ids.tolist())
        self._known_at = {person: at for person, at in self._known_at.items() if self._known[person] in alive
                          and self._tracks.stamp - at <= FUSION.motion.most_gap}
        self._known = {person: self._known[person] for person in self._known_at}

    def _assign(self, tracks: Tracks, sightings: Sequence[Sighting]) -> Tuple[Tracks, List[_Assigned]]:
        """Return the tracks with new ones, and who is who; cameras that measure depth come first."""
        assigned: List[_Assigned] = []
        for sighting in sorted(sightings, key=lambda one: not one.has_depth):
            rows = self._rows(tracks, sighting)
            known = np.isfinite(sighting.positions).all(axis=2).sum(axis=1)
            # a person with fewer joints would not be recognized, and take a new id in each frame
            new = np.flatnonzero((rows < 0) & (known >= FUSION.association.least_joints))
            if sighting.has_depth and len(new) and not _is_late(sighting, tracks):
                rows[new] = len(tracks) + np.arange(len(new))
                tracks = tracks.joined(self._begun(tracks.stamp, sighting.positions[new]))
            assigned.append(_Assigned(sighting, rows))
        if all(sighting.has_depth for sighting in sightings):
            return tracks, assigned
        return self._begin_from_rays(tracks, assigned)

    def _rows(self, tracks: Tracks, sighting: Sighting) -> np.ndarray:
        constants = FUSION.association
        gates = np.minimum(constants.gate + constants.gate_growth * abs(sighting.stamp - tracks.seen),
                           constants.most_gate)
        return associate(sighting, tracks.at(sighting.stamp), tracks.ids, gates, self._known)

    def _begin_from_rays(self, tracks: Tracks, assigned: List[_Assigned]) -> Tuple[Tracks, List[_Assigned]]:
        """Find people where the rays of two cameras meet, and assign them in the other cameras.

        They are new, or a track whose place nobody knows: one that no camera sees, or one alone and without depth.
        """
        _part_strangers(len(tracks), assigned)
        for (first, rows), (second, others) in itertools.combinations(assigned, 2):
            if any(one.has_depth or _is_late(one, tracks) for one in (first, second)):
                continue
            # the last entry is for those who are nobody yet
            alone = np.append(_seen_by(len(tracks), assigned)[:-1] == 1, True)
            free, free_others = np.flatnonzero(alone[rows]), np.flatnonzero(alone[others])
            pairs = pair_rays(_select(first, free), _select(second, free_others))
            for one, other in zip(free[pairs[0]], free_others[pairs[1]]):
                if rows[one] >= 0 and others[other] >= 0:
                    continue  # each is somebody already
                measured = Measurements(np.zeros(2, int), np.concatenate([first.points(np.array([one])),
                                                                          second.points(np.array([other]))]),
                                        _ray_information(first, one, second, other))
                positions = estimate_joints(1, measured, FUSION.estimate).positions
                row = max(rows[one], others[other])
                if row < 0:
                    row = _unseen_near(positions[0], tracks, _seen_by(len(tracks), assigned)[:-1])
                if row < 0:
                    row, tracks = len(tracks), tracks.joined(self._begun(tracks.stamp, positions))
                else:
                    tracks = tracks.placed(row, positions[0])
                rows[one] = others[other] = row
            for sighting, more in assigned:
                left = np.flatnonzero(more < 0)
                if len(left) and len(pairs[0]):
                    more[left] = self._rows(tracks, _select(sighting, left))
        return tracks, assigned

    def _begun(self, stamp: float, positions: np.ndarray) -> Tracks:
        """Return tracks of people (N, 18, 3) who were not seen before; their joints are known by what follows."""
        return Tracks.begun(stamp, np.array([next(self._ids) for _ in positions], np.int64), positions)


def _is_late(sighting: Sighting, tracks: Tracks) -> bool:
    return tracks.stamp - sighting.stamp > FUSION.association.most_late


def _merged(tracks: Tracks, assigned: Sequence[_Assigned]) -> Tuple[Tracks, Sequence[_Assigned]]:
    """Return the tracks without those that are at the place of an older one, and who is who among the rest.

    Two people whom one camera sees at once are two.
    """
    apart = np.linalg.norm(tracks.positions[:, np.newaxis] - tracks.positions, axis=3)
    finite = np.isfinite(apart)
    near = (np.where(finite, apart < FUSION.association.same_place, False).sum(axis=2) > 0.5 * finite.sum(axis=2))
    becomes = np.arange(len(tracks))
    for older, newer in zip(*np.nonzero(np.triu(near, 1))):
        both = any(older in rows and newer in rows for _, rows in assigned)
        if not both and becomes[older] == older and becomes[newer] == newer:
            becomes[newer] = older
            assigned = [_Assigned(one, np.where(rows == newer, older, rows)) for one, rows in assigned]
    kept = np.flatnonzero(becomes == np.arange(len(tracks)))
    if len(kept) < len(tracks):
        place = np.cumsum(becomes == np.arange(len(tracks))) - 1
        tracks = tracks.select(kept)
        assigned = [_Assigned(one, np.where(rows < 0, -1, place[rows])) for one, rows in assigned]
    return tracks, assigned


def _select(sighting: Sighting, rows: np.ndarray) -> Sighting:
    """Return some of the people of a sighting."""
    return replace(sighting, ids=sighting.ids[rows], positions=sighting.positions[rows],
                   directions=sighting.directions[rows], sigma=sighting.sigma[rows], status=sighting.status[rows],
                   confidence=sighting.confidence[rows])


def _ray_information(first: Sighting, one: int, second: Sighting, other: int) -> np.ndarray:
    """Return the information of two people's rays for joints 3 m from the cameras, (2, 18, 3, 3)."""
    return np.concatenate([sighting.information(sighting.origin + 3.0 * sighting.directions[[row]], np.array([row]))
                           for sighting, row in ((first, one), (second, other))])


def _part_strangers(tracks: int, assigned: Sequence[_Assigned]) -> None:
    """Let nobody see tracks of which cameras without depth see different people: their rays do not meet."""
    meet, miss = ([np.zeros(len(rows), int) for _, rows in assigned] for _ in range(2))
    has_depth = [np.isin(np.arange(tracks), rows) for sighting, rows in assigned if sighting.has_depth]
    known = np.any(has_depth, axis=0) if has_depth else np.zeros(tracks, bool)
    for (i, (first, rows)), (j, (second, others)) in itertools.combinations(enumerate(assigned), 2):
        if first.has_depth or second.has_depth:
            continue
        near = ray_distances(first, second) <= _STRANGERS * FUSION.association.ray_gate
        for one, other in np.argwhere((rows[:, np.newaxis] == others) & (rows >= 0)[:, np.newaxis]):
            if not known[rows[one]]:
                counts = meet if near[one, other] else miss
                counts[i][one] += 1
                counts[j][other] += 1
    for (_, rows), met, missed in zip(assigned, meet, miss):
        rows[missed > met] = -1


def _unseen_near(joints: np.ndarray, tracks: Tracks, seen_by: np.ndarray) -> int:
    """Return the row of the track that nobody sees and that is nearest to joints (18, 3) [m]; -1: none is near."""
    distances = np.linalg.norm(tracks.positions - joints, axis=2)
    near = np.array([np.median(each[np.isfinite(each)]) if np.isfinite(each).any() else np.inf for each in distances])
    near[seen_by > 0] = np.inf
    return int(near.argmin()) if near.min(initial=np.inf) <= FUSION.association.most_gate else -1


def _seen_by(tracks: int, assigned: Sequence[_Assigned]) -> np.ndarray:
    """Return how many cameras see each track, (F + 1,) int; one with depth counts as two, as it tells the distance.

    The last entry is 0, for people who are nobody's (row -1).
    """
    seen_by = np.zeros(tracks + 1, int)
    for sighting, rows in assigned:
        np.add.at(seen_by, rows[rows >= 0], 2 if sighting.has_depth else 1)
    return seen_by


def _at_the_distance_of_rays(tracks: Tracks, assigned: Sequence[_Assigned]) -> Tracks:
    """Return the tracks with those whom one camera alone sees, and without depth, where their size puts them.

    People are moved as they are expected, without a change of pose and as large as they are known to be, to where their
    joints are nearest to the rays: how large they look tells how far away they are.
    """
    seen_by = _seen_by(len(tracks), assigned)
    for sighting, rows in assigned:
        for person in np.flatnonzero(seen_by[rows] == 1):
            row = rows[person]
            body = with_size(tracks.positions[row], expected_lengths(tracks.sizes.select(np.array([row])))[0])
            moved = moved_onto_rays(body, sighting, person)
            if moved is not None:
                distance = float(np.linalg.norm(np.nanmean(body, axis=0) + moved - sighting.origin))
                tracks = tracks.moved(row, body + moved, (FUSION.estimate.size_error * distance) ** 2)
    return tracks


def _corrected(tracks: Tracks, assigned: Sequence[_Assigned]) -> Tuple[Tracks, _Seen]:
    """Return the tracks with what cameras saw, and what that says of their joints."""
    number = len(tracks)
    confidence, cameras = np.zeros((number, _JOINTS)), np.zeros(number, np.int64)
    measured_by = np.zeros((number, _JOINTS), np.int64)
    with_depth = np.zeros((number, _JOINTS), bool)
    for sighting, rows in assigned:
        people = np.flatnonzero(rows >= 0)
        owner = rows[people]
        seen = sighting.status[people] == MEASURED
        np.add.at(measured_by, owner, seen * (2 if sighting.has_depth else 1))
        np.add.at(cameras, owner, 1)
        with_depth[owner] |= sighting.has_depth & (sighting.status[people] != MISSING)
        np.fmax.at(confidence, owner, sighting.confidence[people])
    measured = _measurements(tracks, assigned, measured_by)
    old = (tracks.born < tracks.stamp)[:, np.newaxis] & np.isfinite(tracks.positions).all(axis=2)
    place = tracks.covariance[..., 0]
    expected = Measurements(np.arange(number), tracks.assumed_positions,
                            np.where(old, 1 / place, 0.0)[..., np.newaxis, np.newaxis] * np.eye(3))
    joints = estimate_joints(number, Measurements(*map(np.concatenate, zip(expected, measured))), FUSION.estimate)
    sizes, positions = with_bones(tracks.sizes, joints.positions, joints.covariance, measured_by >= 2, confidence)
    # bones would be bent along the rays of a camera that is alone and measures no depth
    alone = _seen_by(number, assigned)[:-1] == 1
    positions[alone] = joints.positions[alone]
    known = np.isfinite(positions).all(axis=2)
    status = np.where(known, np.where(measured_by >= 2, MEASURED, INFERRED), MISSING).astype(np.uint8)
    innovations = Innovations(number, measured, joints.trust[number:], expected.points, tracks.variance, old)
    shares = innovations.averaged(tracks.innovations, tracks.stamp - tracks.seen)
    filtered = np.where(known, np.trace(joints.covariance, axis1=2, axis2=3) / 3, place)
    variance = innovations.variances(shares, 1 - joints.leverage[:number], place, filtered)
    # The filter never gets surer than with independent errors. Along the rays of two cameras a position is worse than
    # on the mean, and one of them may be alone in the next frame.
    worst = np.linalg.eigvalsh(np.where(known[..., np.newaxis, np.newaxis], joints.covariance, 0.0))[..., -1]
    worst = np.where(known, worst, place)
    independent = np.where(with_depth, 1 / (1 / place + 1 / innovations.measured), worst)
    after = tracks.corrected(positions, np.where(with_depth, np.maximum(variance, independent), worst), independent)
    after = replace(after, sizes=sizes, variance=variance, innovations=shares,
                    seen=np.where(cameras > 0, tracks.stamp, after.seen), cameras=np.maximum(after.cameras, cameras))
    return after, _Seen(status, confidence, variance)


def _measurements(tracks: Tracks, assigned: Sequence[_Assigned], measured_by: np.ndarray) -> Measurements:
    """Return what cameras measured of the joints of tracks, moved to their stamp.

    Args:
        measured_by: (F, 18), how often each joint was measured, and not inferred.
    """
    beside, assumed = keypoint_offsets(tracks.positions), tracks.assumed_positions
    owners, points, information = ([np.zeros((0, *shape))] for shape in ((), (_JOINTS, 3), (_JOINTS, 3, 3)))
    for sighting, rows in assigned:
        people = np.flatnonzero(rows >= 0)
        owner = rows[people]
        moved = -tracks.moves(sighting.stamp - tracks.stamp)[owner]
        factor = np.where(is_inferred(sighting)[people] & (measured_by[owner] > 0), FUSION.estimate.inferred ** -2, 1.0)
        # the variance is divided by the factor with that of the measurement
        between = factor * tracks.spread_after(abs(tracks.stamp - sighting.stamp))[owner]
        owners.append(owner)
        points.append(sighting.points(people) + moved - beside[owner])
        if sighting.has_depth:
            points[-1] -= depth_offsets(sighting.directions[people])
        information.append(factor[..., np.newaxis, np.newaxis] * sighting.information(assumed[owner], people, between))
    return Measurements(np.concatenate(owners).astype(np.int64), np.concatenate(points), np.concatenate(information))


def _reported(tracks: Tracks, seen: _Seen) -> People3D:
    motion = FUSION.motion
    kept = np.flatnonzero((tracks.stamp - tracks.seen <= motion.reported_gap)
                          & ((tracks.cameras > 1) | (tracks.seen - tracks.born >= motion.confirmed)))
    status = np.where(np.isfinite(tracks.positions).all(axis=2), seen.status, MISSING)[kept]
    missing = status == MISSING
    xyz = np.where(missing[..., np.newaxis], np.nan, tracks.positions[kept])
    sigma = np.sqrt(3 * (seen.variance[kept] + FUSION.estimate.common_sigma ** 2))
    return People3D(COCO_18, xyz, seen.confidence[kept], status, np.where(missing, np.nan, sigma), tracks.ids[kept],
                    np.where(missing[..., np.newaxis], np.nan, tracks.velocities[kept]))
