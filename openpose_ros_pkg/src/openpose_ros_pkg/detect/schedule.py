"""Schedule of the search: which part of the image is searched in which frame, within a budget of time."""
from dataclasses import dataclass, field, replace
from typing import Iterable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class ScheduleConstants:
    """How the search of an image is spread over frames, and which people are looked at in each."""

    followed_share: float = constant(
        0.7, "Share of a camera's time that the networks take while no frame waits; the rest is for what can not "
             'overlap with them, and for other programs.')
    search_time: float = constant(
        0.5, 'The whole image is searched once in this time, also where frames wait: frames are left out then. After a '
             'longer time without an image it is searched before it is decided who is there.', unit='s')
    search_share: float = constant(0.3, 'Greatest share of the time that this may take.')
    most_saved: float = constant(0.3, 'Time for searching that can be saved, or owed.', unit='s')
    look_interval: float = constant(
        0.13, 'People in free view are looked at again after this time at the latest; of those who are hidden in part, '
             'after this by the share that is visible.', unit='s')
    least_visibility: float = constant(0.25, 'Least such share: where a hidden person comes out is not known exactly.')
    overlap: float = constant(0.1, 'Overlap of neighbouring strips, as a share of the width of the image.')
    most_strips: int = constant(5, 'A pass is cut into this many strips at most.')
    strip_time: float = constant(
        0.015, 'A pass is cut into as many strips as make one take no longer: by so much it delays the next image.',
        unit='s')
    urgent: float = constant(
        4.0, 'Factor on the wait of a part where a person was lost or is hidden, or the image changed outside of all '
             'people.')
    grey_side: int = constant(96, 'Longer side of the grey images that are compared.', unit='px')
    grey_levels: float = constant(10.0, 'Change of a pixel in them that counts, of 256 levels.')
    grey_pixels: int = constant(4, 'Number of such pixels that make a part changed.')
    round_people: float = constant(0.2, 'Share of its size by which the box of a person is enlarged for that.')


SCHEDULE = ScheduleConstants()
NO_GREY = np.zeros((0, 0), np.float32)


class Part(NamedTuple):
    """A strip of the image that one pass searches."""

    number: int  # of the pass in the recipe
    left: int  # of the strip [px]
    right: int
    width: int  # of the image [px]

    def contains(self, low: float, high: float) -> bool:
        """Return whether the strip does not cut what reaches from one column to another."""
        return (self.left == 0 or low > self.left) and (self.right == self.width or high < self.right - 1)


def strips(width: int, count: int, constants: ScheduleConstants = SCHEDULE) -> List[Tuple[int, int]]:
    """Return left and right of a number of overlapping strips of one width that cover an image."""
    side = round(width * (1 + (count - 1) * constants.overlap) / count)
    lefts = np.linspace(0, width - side, count).round().astype(int)
    return [(int(left), int(left) + side) for left in lefts]


def small_grey(bgr: np.ndarray, constants: ScheduleConstants = SCHEDULE) -> np.ndarray:
    """Return a small grey image of an image, (H, W, 3) uint8, as (h, w) float32."""
    scale = constants.grey_side / max(bgr.shape[:2])
    size = (max(round(bgr.shape[1] * scale), 1), max(round(bgr.shape[0] * scale), 1))
    return cv2.cvtColor(cv2.resize(bgr, size, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY).astype(np.float32)


def changed_columns(grey: np.ndarray, last: np.ndarray, size: Tuple[int, int], boxes: Sequence[np.ndarray],
                    constants: ScheduleConstants = SCHEDULE) -> np.ndarray:
    """Return the columns [px] where an image changed outside of boxes, (N,); none if the grey images differ in size.

    Args:
        grey, last: of this image and the last one, see `small_grey`.
        size: (width, height) of the image [px].
        boxes: least and greatest x and y of people, (2, 2) each [px].
    """
    if last.shape != grey.shape:
        return np.zeros(0)
    scale = constants.grey_side / max(size)
    difference = grey - last
    changed = np.abs(difference - np.median(difference)) > constants.grey_levels
    for low, high in boxes:
        more = constants.round_people * (high - low).max()
        (left, top), (right, bottom) = ((low - more) * scale).astype(int), ((high + more) * scale).astype(int) + 1
        changed[max(top, 0):max(bottom, 0), max(left, 0):max(right, 0)] = False
    return (np.nonzero(changed)[1] + 0.5) / scale


@dataclass(frozen=True, eq=False)
class Schedule:
    """Order in which the parts of an image are searched: the longest wait first, sooner where something happened."""

    parts: Tuple[Part, ...] = ()
    searched: Mapping[Part, float] = field(default_factory=dict)  # when each part was searched last [s]
    urgency: Mapping[Part, float] = field(default_factory=dict)  # factors on the waits of parts
    constants: ScheduleConstants = SCHEDULE

    def in_boxes(self, boxes: Iterable[np.ndarray]) -> 'Schedule':
        """Return the schedule where people may come out of boxes: least and greatest x and y, (2, 2) each [px]."""
        return self._urged([part for low, high in boxes for part in self.parts
                            if high[0] >= part.left and low[0] < part.right])

    def changed(self, columns: np.ndarray) -> 'Schedule':
        """Return the schedule after the image changed in columns, (N,) [px], see `changed_columns`."""
        return self._urged([part for part in self.parts if ((columns >= part.left) & (columns < part.right)).sum()
                            >= self.constants.grey_pixels])

    def done(self, part: Part, stamp: float) -> 'Schedule':
        """Return the schedule after a part was searched."""
        return replace(self, searched={**self.searched, part: stamp},
                       urgency={one: factor for one, factor in self.urgency.items() if one != part})

    def next(self, stamp: float) -> Optional[Part]:
        """Return the most urgent part that was not searched in the image of a stamp [s]; None: all were.

        Parts that were never searched, or not for twice `search_time`, come before all others.
        """
        def wait(part: Part) -> Tuple[float, float, float]:
            urgency, waited = self.urgency.get(part, 1.0), stamp - self.searched.get(part, -np.inf)
            return waited if waited > 2 * self.constants.search_time else 0.0, waited * urgency, urgency
        left = [part for part in self.parts if not self.searched.get(part, -np.inf) >= stamp]
        return max(left, key=wait, default=None)

    def _urged(self, parts: Sequence[Part]) -> 'Schedule':
        return replace(self, urgency={**self.urgency, **dict.fromkeys(parts, self.constants.urgent)})


@dataclass(frozen=True)
class Budget:
    """Time of the networks that a camera has left for searching."""

    saved: float = 0.0  # while no frame waits [s]
    owed: float = 0.0  # also where a frame waits [s]
    constants: ScheduleConstants = SCHEDULE

    def after_frame(self, interval: float, spent: float, whole: float, cameras: int) -> 'Budget':
        """Return the budget after the crops of a frame.

        Args:
            interval: since the last frame [s].
            spent: time of the networks for the crops [s].
            whole: that a search of the whole image takes [s].
            cameras: number of cameras in use.
        """
        constants, share = self.constants, min(interval, self.constants.search_time) / cameras
        owed = min(self.owed + min(constants.search_share, whole / constants.search_time) * share, constants.most_saved)
        saved = self.saved + max(constants.followed_share * share - spent, 0.0)
        return replace(self, owed=owed, saved=min(max(saved, owed), constants.most_saved))

    def after_part(self, spent: float) -> 'Budget':
        """Return the budget after a part took some time of the networks [s]; of parts before it nothing is owed."""
        return replace(self, saved=self.saved - spent, owed=max(self.owed, 0.0) - spent)

    def with_more(self, seconds: float) -> 'Budget':
        """Return the budget with more time [s], and without debt."""
        return replace(self, saved=max(self.saved, 0.0) + seconds, owed=max(self.owed, 0.0) + seconds)

    def at_most(self, other: 'Budget') -> 'Budget':
        """Return the budget with no more time than another one."""
        return replace(self, saved=min(self.saved, other.saved), owed=min(self.owed, other.owed))

    def affords(self, seconds: float) -> bool:
        """Return whether there is time for a part of some seconds while no frame waits."""
        return self.saved >= min(seconds, self.constants.most_saved)

    def owes(self, seconds: float) -> bool:
        """Return whether a part of some seconds is due also where a frame waits."""
        return self.owed >= min(seconds, self.constants.most_saved)
