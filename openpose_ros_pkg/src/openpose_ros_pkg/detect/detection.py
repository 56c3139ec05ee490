"""Detection: from an image to the people in it, with track ids. Networks implement it, and a client of the service."""
import threading
from dataclasses import dataclass
from typing import Any, Callable, Hashable, NamedTuple, Optional, Protocol, Tuple

import numpy as np

from openpose_ros_pkg.detect.tracking import KeypointTracker, PerCamera, TrackingParams
from openpose_ros_pkg.people import ExpectedPeople, People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.fair_lock import FairLock


@dataclass(frozen=True, eq=False)
class DepthView:
    """Depth of the view that an image shows."""

    # (h, w) float32 [m], along the optical axis; NaN where missing. Of the same view as the image, at any size.
    depth: np.ndarray
    focal: float  # focal length, in pixels of `depth`


class Head(NamedTuple):
    """What looks like a head: its middle [px of the depth], and its depth [m]."""

    x: float
    y: float
    depth: float


@dataclass(frozen=True, eq=False)
class ImageFrame:
    """An image of a camera."""

    camera: Hashable  # tells the cameras apart
    stamp: float  # of the image [s]; 0 or less: the image has no history
    bgr: np.ndarray  # (H, W, 3) uint8 BGR; not modified
    depth: Optional[DepthView] = None  # of the image; None: unknown
    follow: bool = True  # False: the image is searched in full, whatever was seen before
    source: Any = None  # what the frame was made from, such as a message; not used here
    # in a stream, since the image that came before, whatever became of that one [s], inf: the first; None: no stream,
    # as the next image may wait for the people of this one
    interval: Optional[float] = None


Wanted = Callable[[float], bool]
"""Whether the networks are wanted for another image within a time [s]."""


def never_wanted(seconds: float) -> bool:
    """Say that no other image comes."""
    return False


class Detection(Protocol):
    """Finds the people in images. Any thread may call it.

    To pipeline, a thread prepares the next image and finishes the last one while another one computes, and searches an
    image that is finished; `compute`, `search` and `finish` take the frames of a camera in order. What passes between
    the stages belongs to the implementation.
    """

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people."""

    @property
    def lock(self) -> FairLock:
        """To be held during `compute` and `search`."""

    def prepare(self, frame: ImageFrame) -> Any:
        """Check an image and bring it to the sizes that the networks want.

        Raises:
            BadInputError: not such an image, or an empty one.
        """

    def compute(self, prepared: Any, expected: Optional[ExpectedPeople] = None) -> Any:
        """Find the people who are expected, with `lock` held; all people where none is.

        Args:
            expected: where tracks in space expect people in the image, with their ids there; None: no such tracks.
        """

    def search(self, computed: Any, wanted: Wanted = never_wanted) -> bool:
        """Look for other people in the newest computed image, who are then expected in the next one, with `lock` held.

        Args:
            wanted: whether another image needs the networks within a time, which puts the search off.

        Returns:
            Whether a part of the image was searched.
        """

    def finish(self, computed: Any) -> People2D:
        """Return the people of a computed image, with ids that they keep in the images of a camera."""


Search = Tuple[ImageFrame, Callable[[Optional[ExpectedPeople]], People2D]]
"""An image, and what returns its people, given the people that tracks in space expect in it."""


class IndependentDetection:
    """A `Detection` that searches each image in full; several at a time, where `search` begins that.

    Args:
        search: called when an image is prepared; what it returns is called when its turn comes, with the people that
            tracks in space expect in the image, and returns the people, whose ids do not count.
        tracking: limits of tracking in the image.
    """

    def __init__(self, skeleton: SkeletonModel,
                 search: Callable[[ImageFrame], Callable[[Optional[ExpectedPeople]], People2D]],
                 tracking: TrackingParams) -> None:
        self.skeleton, self._search = skeleton, search
        self.lock = FairLock()
        self._trackers = PerCamera(lambda: KeypointTracker(tracking))
        self._tracking_lock = threading.Lock()

    def prepare(self, frame: ImageFrame) -> Search:
        return frame, self._search(frame)

    def compute(self, prepared: Search, expected: Optional[ExpectedPeople] = None) -> Tuple[ImageFrame, People2D]:
        frame, result = prepared
        return frame, result(expected)

    def search(self, computed: Tuple[ImageFrame, People2D], wanted: Wanted = never_wanted) -> bool:
        """Do nothing: no person is expected."""
        return False

    def finish(self, computed: Tuple[ImageFrame, People2D]) -> People2D:
        frame, people = computed
        with self._tracking_lock:
            return self._trackers.of(frame.camera).update(people, frame.stamp)
