"""What an estimator knows when a frame comes."""
from dataclasses import dataclass, field
from typing import Optional, Tuple

from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.frame import CameraFrame, View
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.settings import IdentityParams
from skeleton_extract_3d.track.tracks import Tracks, frame_change

_MEMORY = METHOD.track.memory


@dataclass(frozen=True, eq=False)
class Memory:
    """What is remembered from frame to frame.

    Attributes:
        tracks: of the people, at `stamp`, in the frame of the points then.
        stamp: of the newest frame [s]; None before the first.
        camera: of the points; None until they tell.
        tracking_from_points: from the points to where the room stands still; None: the camera does not move.
    """

    tracks: Tracks = field(default_factory=Tracks.none)
    stamp: Optional[float] = None
    camera: Optional[CameraModel] = None
    tracking_from_points: Optional[Transform] = None

    def at(self, frame: CameraFrame, camera: CameraModel, params: IdentityParams) -> Tuple['Memory', View]:
        """Return what is remembered at the time and the place of a frame, and these.

        Nobody has moved yet; people who were not detected for too long are forgotten.

        Args:
            camera: of the points.
        """
        stamp, pose = frame.stamp, frame.tracking_from_points
        before = self.stamp
        if not params.tracking or (before is not None and stamp < before - _MEMORY.greatest_backstep):
            before = None
        tracks = Tracks.none()
        if before is not None:
            tracks = self.tracks.kept(stamp - self.tracks.last_seen <= params.track_timeout)
            if pose is not None and self.tracking_from_points is not None:
                tracks = tracks.transformed(*frame_change(self.tracking_from_points, pose))
        memory = Memory(tracks, stamp if before is None else max(stamp, before), camera, pose)
        elapsed = 0.0 if before is None else max(stamp - before, 0.0)
        return memory, View(frame.points, camera, stamp, elapsed, frame.floor)
