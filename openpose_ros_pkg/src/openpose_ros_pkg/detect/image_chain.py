"""From images to the people in them, with ids: what nodes and programs for files run where there is no depth."""
import itertools
from typing import Iterator, Optional

from openpose_ros_pkg.detect.detection import Detection, ImageFrame, NextPart
from openpose_ros_pkg.detect.tracking import ImageTracker, Mounting, PerCamera, TrackingParams
from openpose_ros_pkg.people import FIRST_ID, People2D


class ImageChain:
    """The people in the images of any number of cameras; ids are unique over all of them.

    Args:
        detection: finds the people.
        tracking: limits of tracks.

    Attributes:
        mounting: how the camera of the newest image seems to be turned, see `Mounting`.
    """

    def __init__(self, detection: Detection, tracking: TrackingParams) -> None:
        self._detection, self._tracking = detection, tracking
        self._ids = itertools.count(FIRST_ID)
        self._trackers = PerCamera(lambda: ImageTracker(self._tracking, self._ids))
        self._mountings, self.mounting = PerCamera(Mounting), ''
        self._newest: Optional[ImageFrame] = None

    def reconfigure(self, tracking: TrackingParams) -> None:
        """Use other limits from the next image on; ids stay."""
        self._tracking = tracking
        for tracker in self._trackers.all():
            tracker.params = tracking

    def look(self, frame: ImageFrame, in_full: bool = False) -> People2D:
        """Return the people of an image; with `in_full`, after a search of all of it.

        Raises:
            BadInputError: not such an image, or an empty one.
        """
        tracker = self._trackers.of(frame.camera)
        expected = tracker.expected(frame.stamp, frame.size, self._detection.skeleton)
        looks = self._detection.look(frame, expected, in_full)
        people = tracker.update(looks, frame.stamp, frame.size)
        self._detection.remember(frame, people.ids[:len(looks.people)])
        self.mounting = self._mountings.of(frame.camera).fault(people)
        self._newest = frame
        return people

    def update(self, frame: ImageFrame) -> People2D:
        """Return the people of an image after a search of all of it; errors as `look`."""
        return self.look(frame, in_full=True)

    def search(self) -> Iterator[NextPart]:
        """Search the rest of the newest image; see `Detection.search`."""
        return iter(()) if self._newest is None else self._detection.search(self._newest)
