"""The state of the tracker between frames."""
from dataclasses import dataclass, field, replace
from typing import Mapping, Optional

import numpy as np

from skeleton_extract_3d.lift.registration import SeenBodies, Surface
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.track.feet import Feet
from skeleton_extract_3d.track.tracks import Tracks, frame_change


@dataclass(frozen=True, eq=False)
class Memory:
    """The state between frames; every step returns a new one.

    Attributes:
        tracks: of the people, at `stamp`, in the frame of the points then.
        stamp: of the newest frame [s]; None before the first.
        tracking_from_points: see `Frame`.
        gone: tracks that ended and may be reidentified, at their last predicted place.
        waiting: since when a new person waits for an id without a break [s]; None: no person does.
        seen: the bodies of the newest frame; None before the first.
        surfaces: of the tracks that no network saw in it, by their ids.
        feet: of the people of the newest frame, where the network knows feet.
    """

    tracks: Tracks = field(default_factory=Tracks.none)
    stamp: Optional[float] = None
    tracking_from_points: Optional[Transform] = None
    gone: Tracks = field(default_factory=Tracks.none)
    waiting: Optional[float] = None
    seen: Optional[SeenBodies] = None
    surfaces: Mapping[int, Surface] = field(default_factory=dict)
    feet: Feet = field(default_factory=Feet)

    def in_frame_of(self, pose: Optional[Transform]) -> 'Memory':
        """Return the memory in the frame of the points of a camera that moved since, see `Frame`."""
        if pose is None or self.tracking_from_points is None:
            return replace(self, tracking_from_points=pose)
        change = frame_change(self.tracking_from_points, pose)
        return replace(self, tracks=self.tracks.transformed(*change), gone=self.gone.transformed(*change),
                       feet=replace(self.feet, axes=change[0] @ self.feet.axes), tracking_from_points=pose)

    def with_existence(self, others: Tracks) -> 'Memory':
        """Return the memory with the existence that other values of its tracks have."""
        tracks = self.tracks
        there, row = np.nonzero(tracks.ids[:, None] == others.ids)
        existence, looked = tracks.existence.copy(), tracks.looked.copy()
        existence[there], looked[there] = others.existence[row], others.looked[row]
        return replace(self, tracks=replace(tracks, existence=existence, looked=looked))
