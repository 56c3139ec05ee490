"""One set of people out of what several cameras see: the order of all steps."""
import itertools
from typing import Dict, Mapping, Sequence

import numpy as np

from openpose_ros_fusion.association import CameraPerson, Matches, associate, merge
from openpose_ros_fusion.constants import FUSION, FusionConstants
from openpose_ros_fusion.correction import corrected
from openpose_ros_fusion.observations import KeypointOffsets, Sighting
from openpose_ros_fusion.rays import place_by_size, tracks_where_rays_meet
from openpose_ros_fusion.tracks import Tracks
from openpose_ros_pkg.people import FIRST_ID
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import MISSING, People3D


class PeopleFusion:
    """Tracks people with several cameras; not thread-safe.

    Attributes:
        known: ids of the fused people by the persons of the cameras.
    """

    def __init__(self, constants: FusionConstants = FUSION) -> None:
        self._ids = itertools.count(FIRST_ID)
        self._constants, self._offsets = constants, KeypointOffsets(constants.shape)
        self._tracks = Tracks.empty(0.0)
        self.known: Mapping[CameraPerson, int] = {}

    def update(self, sightings: Sequence[Sighting], stamp: float) -> People3D:
        """Return the people at a time.

        Args:
            sightings: of each camera one at most, new since the last time; those with other stamps are moved as their
                people move.
            stamp: [s]; a time before the last one begins anew.
        """
        constants = self._constants
        if stamp < self._tracks.stamp or not len(self._tracks):
            self._tracks, self.known = Tracks.empty(stamp), {}
        tracks = self._tracks.predicted(stamp, constants.motion)
        tracks = tracks.select(stamp - tracks.seen <= constants.motion.most_gap)
        distinct = [sighting.distinct() for sighting in sightings]
        tracks, matches = associate(tracks, distinct, self.known, self._ids, constants)
        if not matches.all_have_depth:
            tracks, matches = tracks_where_rays_meet(tracks, matches, self.known, self._ids, constants)
        tracks, matches = merge(tracks, matches, constants.association)
        if not matches.all_have_depth:
            tracks = place_by_size(tracks, matches, constants)
        self._tracks, status, confidence = corrected(tracks, matches, self._offsets, constants)
        self.known = _persons_of(self._tracks, matches, self.known)
        return _reported(self._tracks, status, confidence, constants)


def _persons_of(tracks: Tracks, matches: Matches, before: Mapping[CameraPerson, int]) -> Mapping[CameraPerson, int]:
    """Return the ids of tracks by the persons of the cameras: the newest one of each camera and track."""
    new: Dict[CameraPerson, int] = {
        (sighting.camera, person): int(tracks.ids[row]) for sighting, rows in matches.pairs
        for person, row in zip(sighting.ids.tolist(), rows.tolist()) if row >= 0}
    replaced, alive = {(camera, track) for (camera, _), track in new.items()}, set(tracks.ids.tolist())
    return {**{person: track for person, track in before.items()
               if track in alive and (person[0], track) not in replaced}, **new}


def _reported(tracks: Tracks, status: np.ndarray, confidence: np.ndarray, constants: FusionConstants) -> People3D:
    """Return the people that are seen now, or not for long, by two cameras or for some time."""
    gap = constants.motion.reported_gap
    kept = np.flatnonzero((tracks.stamp - tracks.seen <= gap)
                          & ((tracks.cameras > 1) | (tracks.seen - tracks.born >= gap)))
    missing = status[kept] == MISSING
    sigma = np.sqrt(3 * (tracks.variance[kept] + constants.estimate.common_sigma ** 2))
    xyz, velocity = (np.where(missing[..., np.newaxis], np.nan, values[kept])
                     for values in (tracks.positions, tracks.velocities))
    return People3D(COCO_18, xyz, confidence[kept], status[kept], np.where(missing, np.nan, sigma), tracks.ids[kept],
                    velocity)
