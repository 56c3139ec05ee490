"""A detector for streams: it remembers, for each camera, who was seen where."""
import threading
from dataclasses import dataclass
from typing import Hashable, Optional

import numpy as np

from openpose_ros_pkg.detect.detector import ComputedFrame, Detector, PreparedFrame
from openpose_ros_pkg.detect.following import FollowingParams
from openpose_ros_pkg.detect.tracking import KeypointTracker, PerCamera, TrackingParams
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.fair_lock import FairLock


@dataclass(frozen=True)
class StreamFrame:
    """What was found in an image of a stream.

    Attributes:
        frame: what the networks gave.
        camera: which stream it is.
        stamp: of the image [s].
    """

    frame: ComputedFrame
    camera: Hashable
    stamp: float

    @property
    def network_seconds(self) -> float:
        """Time that the networks took [s]."""
        return self.frame.network_seconds


class StreamDetector:
    """Find people in the images of any number of cameras; they keep their ids. Any thread may call it.

    `detect` does it all. To prepare the next image and finish the last one while the networks are busy, call `prepare`,
    `compute` and `finish` separately, the latter two in the order of the frames of a camera.

    Args:
        detector: what finds the people.
        tracking: limits of following people.
        following: whether people are followed instead of being searched for in every image.
    """

    def __init__(self, detector: Detector, tracking: TrackingParams, following: FollowingParams) -> None:
        self.detector = detector
        self._tracking, self._following = tracking, following
        self._trackers = PerCamera(lambda: KeypointTracker(self._tracking))
        self._tracking_lock = threading.Lock()

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people."""
        return self.detector.skeleton

    @property
    def lock(self) -> FairLock:
        """To be held during `compute`."""
        return self.detector.lock

    def reconfigure(self, tracking: TrackingParams, following: FollowingParams) -> None:
        """Use other limits from the next frame on; ids stay."""
        with self._tracking_lock:
            self._tracking, self._following = tracking, following
            for tracker in self._trackers.all():
                tracker.reconfigure(tracking)

    def detect(self, bgr: np.ndarray, camera: Hashable, stamp: float, expected: Optional[People2D] = None) -> People2D:
        """Return the people in an image of a camera, with ids that they keep in its images.

        Args:
            bgr: (H, W, 3) uint8 BGR; not modified.
            camera: whatever tells the cameras apart.
            stamp: of the image [s].
            expected: where people who are followed in space are expected in the image, with their ids there; None:
                nobody is followed in space.

        Raises:
            BadInputError: not such an image, or an empty one.
        """
        prepared = self.prepare(bgr)
        with self.lock:
            computed = self.compute(prepared, camera, stamp, expected)
        return self.finish(computed)

    def prepare(self, bgr: np.ndarray) -> PreparedFrame:
        """Check an image and bring it to the sizes that the networks want; see `detect`."""
        return self.detector.prepare(bgr)

    def compute(self, frame: PreparedFrame, camera: Hashable, stamp: float, expected: Optional[People2D] = None
                ) -> StreamFrame:
        """Compute the networks for a prepared image, with `lock` held; see `detect`."""
        return StreamFrame(self.detector.compute(frame), camera, stamp)

    def finish(self, computed: StreamFrame) -> People2D:
        """Return the people of a computed image; see `detect`."""
        people = self.detector.finish(computed.frame)
        with self._tracking_lock:
            return self._trackers.of(computed.camera).update(people, computed.stamp)
