"""Which person of a camera is which track."""
from dataclasses import dataclass
from typing import Iterator, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.constants import AssociationConstants, FusionConstants
from openpose_ros_fusion.observations import Sighting
from openpose_ros_fusion.tracks import Tracks
from openpose_ros_pkg.assignment import match
from skeleton_extract_3d.people import MEASURED

# More than any distance [m].
FAR = 1e6
# A person of a camera: its name and the id there.
CameraPerson = Tuple[str, int]
KnownIds = Mapping[CameraPerson, int]


@dataclass(frozen=True, eq=False)
class Matches:
    """Which people of the cameras are which of F tracks.

    Attributes:
        tracks: F.
        pairs: sightings, each with the tracks of its people, (P,) int; -1: no track.
    """

    tracks: int
    pairs: Tuple[Tuple[Sighting, np.ndarray], ...]

    @property
    def all_have_depth(self) -> bool:
        """Whether no camera sees rays alone."""
        return all(sighting.has_depth for sighting, _ in self.pairs)

    @property
    def views(self) -> np.ndarray:
        """How many cameras see each track, (F,) int; one with depth counts as two, as it tells the distance."""
        views = np.zeros(self.tracks, int)
        for sighting, rows in self.pairs:
            views += (2 if sighting.has_depth else 1) * np.bincount(rows[rows >= 0], minlength=self.tracks)
        return views


def associate(tracks: Tracks, sightings: Sequence[Sighting], known: KnownIds, ids: Iterator[int],
              constants: FusionConstants) -> Tuple[Tracks, Matches]:
    """Return the tracks with new ones, and the matches; cameras with depth come first, and alone begin tracks.

    Args:
        known: ids of tracks by persons of cameras, as they were matched before.
        ids: where the ids of new tracks come from.
    """
    pairs: List[Tuple[Sighting, np.ndarray]] = []
    for sighting in sorted(sightings, key=lambda one: not one.has_depth):
        rows = match_people(sighting, tracks, known, constants)
        joints = np.isfinite(sighting.positions).all(axis=2).sum(axis=1)
        # a person with fewer joints would not be recognized, and take a new id in each frame
        new = (rows < 0) & (joints >= constants.association.least_joints)
        if tracks.stamp - sighting.stamp <= constants.motion.reported_gap and new.any():
            rows = np.where(new, len(tracks) + np.cumsum(new) - 1, rows)
            tracks = tracks.joined(Tracks.begun(tracks.stamp, ids, sighting.positions[new]))
        pairs.append((sighting, rows))
    return tracks, Matches(len(tracks), tuple(pairs))


def match_people(sighting: Sighting, tracks: Tracks, known: KnownIds, constants: FusionConstants,
                 matched: Optional[np.ndarray] = None) -> np.ndarray:
    """Return the track of each person, (P,) int; -1: none. Those that are `matched` already keep their tracks."""
    association = constants.association
    rows = np.full(len(sighting), -1) if matched is None else matched.copy()
    people = np.flatnonzero(rows < 0)
    if not len(people) or not len(tracks):
        return rows
    before = np.array([known.get((sighting.camera, number), -1) for number in sighting.ids.tolist()])
    was = tracks.ids == before[:, np.newaxis]
    # a person that was known before is recognized by any joint
    distances = median_distances(sighting, tracks.at(sighting.stamp, constants.motion), association.least_joints,
                                 np.where(was, 1, association.least_joints))
    for person, row in match(distances[people], (distances <= association.gate)[people]):
        rows[people[person]] = row
    return rows


def median_distances(sighting: Sighting, joints: np.ndarray, least: int, common: np.ndarray) -> np.ndarray:
    """Return the median distance of people, or of their rays, from tracks, (P, F) [m]; far where they share little.

    Measured joints count, or all, where fewer than `least` were measured.

    Args:
        joints: (F, 18, 3) [m] of the tracks.
        common: (P, F) joints that two must share.
    """
    distances = sighting.distances(joints)
    found = np.isfinite(distances)
    measured = found & (sighting.status == MEASURED)[:, np.newaxis]
    use = np.where((measured.sum(axis=2) >= least)[..., np.newaxis], measured, found)
    count = use.sum(axis=2)
    ordered = np.sort(np.where(use, distances, FAR), axis=2)
    people, fused = np.ogrid[:len(sighting), :len(joints)]
    medians = (ordered[people, fused, np.maximum(count - 1, 0) // 2] + ordered[people, fused, count // 2]) / 2
    return np.where(count >= common, medians, FAR)


def merge(tracks: Tracks, matches: Matches, constants: AssociationConstants) -> Tuple[Tracks, Matches]:
    """Return the tracks without those that are at the place of an older one, and the matches with the rest.

    Two people that one camera sees at once are two.
    """
    distances = np.linalg.norm(tracks.positions[:, np.newaxis] - tracks.positions, axis=3)
    finite = np.isfinite(distances)
    near = np.where(finite, distances < constants.same_place, False).sum(axis=2) > 0.5 * finite.sum(axis=2)
    becomes, pairs = np.arange(len(tracks)), matches.pairs
    for older, newer in zip(*np.nonzero(np.triu(near, 1))):
        both = any(older in rows and newer in rows for _, rows in pairs)
        if not both and becomes[older] == older and becomes[newer] == newer:
            becomes[newer] = older
            pairs = tuple((sighting, np.where(rows == newer, older, rows)) for sighting, rows in pairs)
    kept = becomes == np.arange(len(tracks))
    if kept.all():
        return tracks, matches
    place = np.cumsum(kept) - 1
    pairs = tuple((sighting, np.where(rows < 0, -1, place[rows])) for sighting, rows in pairs)
    return tracks.select(np.flatnonzero(kept)), Matches(int(kept.sum()), pairs)
