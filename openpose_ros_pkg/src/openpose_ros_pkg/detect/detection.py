"""Detection: from an image to the people in it. Networks implement it, and a client of the service."""
from dataclasses import dataclass, replace
from typing import Any, Callable, Hashable, Iterator, NamedTuple, Optional, Protocol, Tuple

import numpy as np

from openpose_ros_pkg.people import ExpectedPeople, People2D
from openpose_ros_pkg.skeletons import SkeletonModel


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
    source: Any = None  # what the frame was made from, such as a message; not used here

    @property
    def size(self) -> Tuple[int, int]:
        """Width and height [px]."""
        return self.bgr.shape[1], self.bgr.shape[0]


class Looks(NamedTuple):
    """What was looked at in an image, and what was found there.

    Attributes:
        people: the P detections; `ids` are those of the expected people on whose crops they were found, -1: new people.
        missed: (M,) int64 ids of the expected people who were looked at and not found. Expected people who are neither
            here nor among the detections were not looked at.
    """

    people: People2D
    missed: np.ndarray

    @classmethod
    def of_all(cls, people: People2D, expected: ExpectedPeople) -> 'Looks':
        """Return the detections of a search of the whole image, which found no expected person by a crop."""
        return cls(people, expected.ids)


class NextPart(NamedTuple):
    """What a search does next, unless it is stopped before."""

    seconds: float  # that it will take [s]
    owed: bool = False  # whether it is to be done also where a frame waits


class Detection(Protocol):
    """Finds the people in images; one thread at a time uses it, with the frames of each camera in order."""

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people."""

    @property
    def gives_ids(self) -> bool:
        """Whether its people have ids of another tracker, which are kept where people are not tracked in space."""

    def look(self, frame: ImageFrame, expected: ExpectedPeople, in_full: bool = True) -> Looks:
        """Look at the expected people; with `in_full`, and where no older image helps, search the whole image too.

        Raises:
            BadInputError: not such an image, or an empty one.
        """

    def remember(self, frame: ImageFrame, ids: np.ndarray) -> None:
        """Learn which ids, (P,), the tracker gave to the detections in the newest image of a camera; -1: none."""

    def search(self, frame: ImageFrame) -> Iterator[NextPart]:
        """Search the rest of the newest image of a camera, for people of its next image.

        Each part is announced and then searched, by the following `next`; iteration may stop at any time.
        """


class KnownPeople:
    """A `Detection` that is told who is in an image, in place of networks.

    Args:
        people_of: returns the people of an image; their ids do not count.
    """

    gives_ids = False

    def __init__(self, skeleton: SkeletonModel, people_of: Callable[[ImageFrame], People2D]) -> None:
        self.skeleton, self._people_of = skeleton, people_of

    def look(self, frame: ImageFrame, expected: ExpectedPeople, in_full: bool = True) -> Looks:
        people = self._people_of(frame)
        return Looks.of_all(replace(people, ids=np.full(len(people), -1)), expected)

    def remember(self, frame: ImageFrame, ids: np.ndarray) -> None:
        """Do nothing: no look depends on another one."""

    def search(self, frame: ImageFrame) -> Iterator[NextPart]:
        return iter(())
