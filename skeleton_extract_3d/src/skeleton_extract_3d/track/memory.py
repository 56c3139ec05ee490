"""The state of an estimator between frames."""
from dataclasses import dataclass, field, replace
from typing import Mapping, Optional, Tuple

import numpy as np

from openpose_ros_pkg.detect.existence import EXISTENCE
from openpose_ros_pkg.detect.tracking import TRACKING
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.people import ExpectedPeople, keypoints_in
from openpose_ros_pkg.skeletons import COCO_18, SkeletonModel
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import Frame, FrameView
from skeleton_extract_3d.lift.agreement import Agreement
from skeleton_extract_3d.lift.registration import SeenBodies, Surface
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.plausibility import PointSummary, Stillness, stillness
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.settings import EstimatorSettings, IdentityParams
from skeleton_extract_3d.track.constants import TrackConstants
from skeleton_extract_3d.track.existence import after_time, views_of
from skeleton_extract_3d.track.feet import Feet
from skeleton_extract_3d.track.tracks import Tracks, frame_change


@dataclass(frozen=True, eq=False)
class Memory:
    """The state between frames; every step returns a new one.

    Attributes:
        tracks: of the people, at `stamp`, in the frame of the points then.
        stamp: of the newest frame [s]; None before the first.
        camera: of the newest points; None before points that tell it.
        tracking_from_points: see `Frame`.
        still: since when the depth is the same; None before the first frame with an image.
        agreement: of people with the depth.
        gone: tracks that ended and may be reidentified, at their last predicted place.
        waiting: since when a new person waits for an id without a break [s]; None: no person does.
        seen: the bodies of the newest frame; None before the first.
        surfaces: of the tracks that no network saw in it, by their ids.
        feet: of the people of the newest frame, where the network knows feet.
    """

    tracks: Tracks = field(default_factory=Tracks.none)
    stamp: Optional[float] = None
    camera: Optional[CameraModel] = None
    tracking_from_points: Optional[Transform] = None
    still: Optional[Stillness] = None
    agreement: Agreement = field(default_factory=Agreement)
    gone: Tracks = field(default_factory=Tracks.none)
    waiting: Optional[float] = None
    seen: Optional[SeenBodies] = None
    surfaces: Mapping[int, Surface] = field(default_factory=dict)
    feet: Feet = field(default_factory=Feet)

    def with_points(self, frame: Frame, summary: PointSummary, method: MethodConstants = METHOD) -> 'Memory':
        """Return the memory with the stillness of the points of a frame."""
        if frame.bgr is None:
            return self
        return replace(self, still=stillness(self.still, summary, frame.bgr, method.plausibility))

    def with_existence(self, others: Tracks) -> 'Memory':
        """Return the memory with the existence that other values of its tracks have; those that ended stay for `at`."""
        tracks, rows = self.tracks, {number: row for row, number in enumerate(others.ids.tolist())}
        there = np.array([number in rows for number in tracks.ids.tolist()], bool)
        row = np.array([rows[number] for number in tracks.ids[there].tolist()], np.int64)
        existence, looked = tracks.existence.copy(), tracks.looked.copy()
        existence[there], looked[there] = others.existence[row], others.looked[row]
        return replace(self, tracks=replace(tracks, existence=existence, looked=looked))

    def camera_of(self, size: Tuple[int, int]) -> Optional[CameraModel]:
        """Return the camera at a resolution, width and height [px]; None if it is not known, or has another view."""
        try:
            return self.camera and self.camera.scaled(*size)
        except BadInputError:  # the driver has another mode now, and the next points tell its camera
            return None

    def at(self, frame: Frame, camera: CameraModel, params: IdentityParams, constants: TrackConstants = METHOD.track
           ) -> Tuple['Memory', FrameView]:
        """Return the memory, without tracks that ended, in the frame of reference of a frame, and its view."""
        stamp, pose = frame.stamp, frame.tracking_from_points
        before = self.stamp
        if not params.tracking or (before is not None and stamp < before - TRACKING.reset_backstep):
            before = None
        tracks, gone, feet = Tracks.none(), Tracks.none(), Feet()
        if before is not None:
            (tracks, gone), feet = self._recent(stamp, params, constants), self.feet
            if pose is not None and self.tracking_from_points is not None:
                change = frame_change(self.tracking_from_points, pose)
                tracks, gone = tracks.transformed(*change), gone.transformed(*change)
                feet = feet.rotated(change[0])
        memory = replace(self, tracks=tracks, gone=gone, feet=feet, camera=camera, tracking_from_points=pose,
                         stamp=stamp if before is None else max(stamp, before))
        elapsed = 0.0 if before is None else max(stamp - before, 0.0)
        return memory, FrameView(frame.grid, camera, stamp, elapsed, frame.floor)

    def _recent(self, stamp: float, params: IdentityParams, constants: TrackConstants) -> Tuple[Tracks, Tracks]:
        """Return the tracks that go on, and those that ended within `return_timeout`."""
        tracks = self.tracks
        # what was detected goes on, whatever it is: a picture is to be known in the next frame, too
        recent = (stamp - tracks.last_seen <= params.track_timeout) & (
            (tracks.existence >= EXISTENCE.ended) | (tracks.last_seen == self.stamp))
        recent[:-TRACKING.most_tracks] = False
        gone = self.gone if recent.all() else self.gone.joined(tracks.select(~recent))
        gone = gone.select(np.argsort(gone.last_seen, kind='stable')[-constants.returning.most_gone:])
        return tracks.select(recent), gone.select(stamp - gone.last_seen <= params.return_timeout)

    def expected(self, frame: Frame, skeleton: SkeletonModel, settings: EstimatorSettings,
                 method: MethodConstants = METHOD) -> ExpectedPeople:
        """Return the tracks as people expected in or outside the image of a frame, with the joints of a skeleton.

        Tracks move with constant velocity since the newest frame. There are none after a gap that ends all tracks, when
        the clock was reset, and for an unknown camera.
        """
        points, elapsed = frame.grid, 0.0 if self.stamp is None else frame.image_time - self.stamp
        camera = self.camera_of((points.width, points.height))
        if (camera is None or self.stamp is None
                or not -TRACKING.reset_backstep <= elapsed <= settings.identity.track_timeout):
            return ExpectedPeople.none(skeleton)
        tracks = self.tracks.predicted(elapsed, settings.smoothing, method.body)
        stamp, position = max(frame.image_time, self.stamp), tracks.joints.position
        views = views_of(tracks, FrameView(points, camera, stamp, elapsed), method)
        uv = camera.project(position.reshape(-1, 3)).reshape(*position.shape[:2], 2)
        there = tracks.has & np.isfinite(uv).all(axis=2)
        scale = np.divide(frame.image_size, (points.width, points.height))
        keypoints = np.concatenate([np.where(there[..., None], (uv + 0.5) * scale - 0.5, np.nan), there[..., None]],
                                   axis=2).astype(np.float32)
        known = np.flatnonzero(there.any(axis=1))
        return ExpectedPeople(
            skeleton, keypoints_in(keypoints[known], COCO_18, skeleton), tracks.ids[known],
            after_time(tracks, views, stamp, settings.identity.track_timeout)[known], views.visible[known],
            (tracks.root.sigmas()[:, 0] / np.sqrt(3) / (tracks.sizes.stature / 2))[known])
