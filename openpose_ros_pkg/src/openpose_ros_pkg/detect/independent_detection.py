"""Detection that searches each image for itself; people keep their ids by where they are in the images of a camera."""
import threading
from typing import Callable, Optional, Tuple

from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.tracking import KeypointTracker, PerCamera, TrackingParams
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.fair_lock import FairLock

Search = Tuple[ImageFrame, Callable[[], People2D]]
"""An image that is being searched, and what waits for its people and returns them."""


class IndependentDetection:
    """A `Detection` for images that are searched without history, several at a time and in any order.

    Args:
        skeleton: joint set of the people.
        search: begins to search an image; what it returns waits for the people, whose ids do not count.
        tracking: limits of tracking in the image.
    """

    def __init__(self, skeleton: SkeletonModel, search: Callable[[ImageFrame], Callable[[], People2D]],
                 tracking: TrackingParams) -> None:
        self.skeleton, self._search = skeleton, search
        self.lock = FairLock()
        self._trackers = PerCamera(lambda: KeypointTracker(tracking))
        self._tracking_lock = threading.Lock()

    def prepare(self, frame: ImageFrame) -> Search:
        """See `Detection`."""
        return frame, self._search(frame)

    def compute(self, prepared: Search, expected: Optional[People2D] = None) -> Tuple[ImageFrame, People2D]:
        """See `Detection`; where people are expected is not used."""
        frame, result = prepared
        return frame, result()

    def finish(self, computed: Tuple[ImageFrame, People2D]) -> People2D:
        """See `Detection`."""
        frame, people = computed
        with self._tracking_lock:
            return self._trackers.of(frame.camera).update(people, frame.stamp)
