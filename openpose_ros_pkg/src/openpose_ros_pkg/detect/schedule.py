"""Schedule of the search: which part of the image is searched in which frame, within a budget of time."""
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Iterable, List, Mapping, NamedTuple, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class ScheduleConstants:
    """How the search of an image is spread over frames."""

    followed_share: float = constant(
        0.7, "Share of a frame's time that the networks may take where people are followed; the rest is for what can "
             'not overlap with them, and for other programs.')
    search_share: float = constant(0.3, 'Share of the budget that is kept for searching.')
    search_time: float = constant(
        0.2, 'Beside other cameras, each has time to search its image once in this time.', unit='s')
    most_saved: float = constant(2.0, 'Budget for searching that can be saved.', unit='frames')
    recent_intervals: int = constant(10, 'Intervals between stamps of which the least tells the rate of the images.')
    overlap: float = constant(0.1, 'Overlap of neighbouring strips, as a share of the width of the image.')
    most_strips: int = constant(5, 'A pass is cut into this many strips at most.')
    strip_time: float = constant(
        0.015, 'A pass is cut into as many strips as make one take no longer: by so much it delays the next image.',
        unit='s')
    patience: float = constant(
        0.15, 'An image that waits puts a search off for this long; then one part is searched before it.', unit='s')
    urgent: float = constant(
        4.0, 'Factor on the urgency of a part where a person was lost, or the image changed outside of all people.')
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

    def meets(self, low: float, high: float) -> bool:
        """Return whether the strip has any of these columns."""
        return high >= self.left and low < self.right


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
    period: int = 1  # without a rate, every image of this number is searched in full
    frames: int = 0  # since the image was searched in full
    constants: ScheduleConstants = SCHEDULE

    def lost(self, boxes: Iterable[np.ndarray]) -> 'Schedule':
        """Return the schedule after people were lost in boxes: least and greatest x and y, (2, 2) each [px]."""
        return self._urged([part for low, high in boxes for part in self.parts if part.meets(low[0], high[0])])

    def changed(self, columns: np.ndarray) -> 'Schedule':
        """Return the schedule after the image changed in columns, (N,) [px], see `changed_columns`."""
        return self._urged([part for part in self.parts if ((columns >= part.left) & (columns < part.right)).sum()
                            >= self.constants.grey_pixels])

    def done(self, part: Part, stamp: float) -> 'Schedule':
        """Return the schedule after a part was searched."""
        searched = {**self.searched, part: stamp}
        in_full = all(searched.get(one) == stamp for one in self.parts)
        return replace(self, searched=searched, frames=0 if in_full else self.frames,
                       urgency={one: factor for one, factor in self.urgency.items() if one != part})

    def all_done(self, stamp: float) -> 'Schedule':
        """Return the schedule after the image was searched in full."""
        return replace(self, searched=dict.fromkeys(self.parts, stamp), urgency={}, frames=0)

    def due(self, stamp: float, in_any_case: bool) -> List[Part]:
        """Return the parts to search, the most urgent first; where not `in_any_case`, only at the end of the period."""
        return self.order(stamp) if in_any_case or self.frames >= self.period else []

    def order(self, stamp: float) -> List[Part]:
        """Return all parts, the most urgent first; those that were never searched come before all others."""
        def wait(part: Part) -> Tuple[float, float]:
            urgency = self.urgency.get(part, 1.0)
            # a late image is older than what was searched
            waited = max(stamp - self.searched[part], 0.0) if part in self.searched else float('inf')
            return waited * urgency, urgency
        return sorted(self.parts, key=wait, reverse=True)

    @property
    def newest(self) -> float:
        """Stamp of the newest image of which a part was searched [s]."""
        return max(self.searched.values(), default=-float('inf'))

    def _urged(self, parts: Sequence[Part]) -> 'Schedule':
        return replace(self, urgency={**self.urgency, **dict.fromkeys(parts, self.constants.urgent)})


def fair_share(own: float, *others: float) -> float:
    """Return which share of the time a camera has, by the shares that it and others want.

    All get what they want up to an equal level; what is left over is divided in proportion to the wants.
    """
    left, level = 1.0, 0.0
    wanted = sorted((own, *others))
    for number, one in enumerate(wanted):
        level = left / (len(wanted) - number)
        left -= min(one, level)
    if left <= 0:
        return min(own, level)
    return own / sum(wanted) if sum(wanted) > 0 else 1 / len(wanted)


class Costs(NamedTuple):
    """What the work on a frame takes the networks."""

    crops: float = 0.0  # the crops of all people [s]
    parts: Mapping[Part, float] = MappingProxyType({})  # each part of the image [s]

    @property
    def search(self) -> float:
        """All parts of the image [s]."""
        return sum(self.parts.values())


NO_COSTS = Costs()


@dataclass(frozen=True)
class Budget:
    """Time of the networks for a frame of a camera, and what is saved for searching."""

    rate: float  # that is wanted [Hz]; 0: any time
    intervals: Tuple[float, ...] = ()  # the recent ones between frames [s]
    costs: Costs = NO_COSTS  # of the newest frame
    seconds: float = float('inf')  # for a frame
    saved: float = float('inf')  # for searching [s]
    spent: float = 0.0  # in the newest frame so far [s]
    constants: ScheduleConstants = SCHEDULE

    @classmethod
    def of_rate(cls, rate: float, constants: ScheduleConstants = SCHEDULE, search: bool = False) -> 'Budget':
        """Return the budget before the first frame; with `search`, as much as can be is saved for searching."""
        if rate <= 0:
            return cls(rate, constants=constants)
        seconds = constants.followed_share / rate
        return cls(rate, seconds=seconds, saved=constants.most_saved * seconds * search, constants=constants)

    def begun(self, interval: float, costs: Costs = NO_COSTS, beside: Sequence['Budget'] = ()) -> 'Budget':
        """Return the budget at the begin of a frame.

        Args:
            interval: since the last frame [s]; 0: unknown, or no measure of the rate of the images.
            beside: budgets of the other cameras in use.
        """
        if self.rate <= 0:
            return replace(self, spent=0.0, costs=costs)
        intervals = self.intervals
        if 0 < interval < np.inf:
            intervals = (*intervals, interval)[-self.constants.recent_intervals:]
        own = replace(self, spent=0.0, intervals=intervals, costs=costs)
        shortest = (1 + len(beside)) / self.rate
        share = fair_share(*(each._wanted(shortest) / self.constants.followed_share for each in (own, *beside)))
        return replace(own, seconds=self.constants.followed_share * share * own._interval(shortest))

    def _interval(self, shortest: float) -> float:
        # skipped frames make intervals longer: the least one is that of the camera
        return max(shortest, min(self.intervals, default=0.0))

    def _wanted(self, shortest: float) -> float:
        """Return the time that would be of use, per time."""
        interval = self._interval(shortest)
        return self.costs.crops / interval + self.costs.search / max(interval, self.constants.search_time)

    def crops(self, seconds: float) -> int:
        """Return for how many people, one at least, there is time, at some seconds each."""
        return max(round((1 - self.constants.search_share) * min(self.seconds / max(seconds, 1e-9), 1e6)), 1)

    def crops_of(self, people: int, seconds: float, interval: float, longest_wait: float) -> int:
        """Return how many of the expected people, one at least, get a crop, at some seconds each.

        All do where frames are so rare (`interval` [s] since the last one) that a person who waited for the next one
        would no longer be reported, after `longest_wait` [s].
        """
        fits = people * seconds <= self.constants.followed_share * interval
        if interval > longest_wait or (fits and 2 * interval > longest_wait):
            return people
        return min(self.crops(seconds), people)

    def after_crops(self, spent: float) -> 'Budget':
        """Return the budget with what crops left of the frame's time saved [s]."""
        # a crop that takes longer than a frame does not take from the search
        left = max(self.seconds - spent, self.constants.search_share * self.seconds)
        return replace(self, spent=self.spent + spent,
                       saved=min(self.saved + left, self.constants.most_saved * self.seconds))

    def affords(self, seconds: float) -> bool:
        """Return whether enough is saved, or the most that can be: on a slow machine a part may take longer."""
        return self.saved >= min(seconds, self.constants.most_saved * self.seconds)

    def after(self, seconds: float) -> 'Budget':
        """Return the budget after spending what was saved; a debt is one frame's time at most."""
        saved = max(self.saved - seconds, -self.seconds) if self.rate > 0 else self.saved
        return replace(self, spent=self.spent + seconds, saved=saved)
