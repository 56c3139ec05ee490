"""What is searched for people in which frame: parts of the image, within a budget of time."""
from collections import deque
from dataclasses import dataclass
from typing import Deque, Dict, List, NamedTuple, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class ScheduleConstants:
    """How the search of an image is spread over frames."""

    network_share: float = constant(
        0.7, "Share of a frame's time that the networks may take where people are followed; the rest is for what can "
             'not overlap with them, and for other programs.')
    least_work: float = constant(
        0.2, 'Share of a full search, with the expected number of people, for which there is time in any case: with '
             'less, people get lost, so on a slow processor the rate falls instead.')
    search_share: float = constant(0.3, 'Share of that which is kept for searching, whoever is followed.')
    search_time: float = constant(
        0.2, 'Beside other cameras, one is foreseen time to search its image once in this time.', unit='s')
    most_saved: float = constant(2.0, 'Frames whose time for searching can be saved.')
    recent_intervals: int = constant(10, 'Intervals between stamps of which the least tells the rate of the images.')
    overlap: float = constant(0.16, 'Overlap of neighbouring strips, as a share of the width of the image.')
    most_strips: int = constant(4, 'A pass is cut into this many strips at most.')
    changed: float = constant(3.0, 'A part in which the image changed outside of everybody waits this many times less.')
    lost: float = constant(6.0, 'A part in which somebody was lost waits this many times less.')
    grey_width: int = constant(96, 'Width of the grey images that are compared.', unit='px')
    grey_aspect: float = constant(4.0, 'They are at most this many times as high; those of longer images are narrower.')
    grey_levels: float = constant(10.0, 'Change of a pixel in them that counts, of 256 levels.')
    grey_pixels: int = constant(4, 'Number of such pixels that make a part changed.')
    round_people: float = constant(0.2, 'Share of its size by which the box of a person is enlarged for that.')


SCHEDULE = ScheduleConstants()


class Part(NamedTuple):
    """A strip of the image that one pass searches.

    Attributes:
        number: of the pass in the recipe.
        left, right: of the strip [px].
        width: of the image [px].
    """

    number: int
    left: int
    right: int
    width: int

    def holds(self, low: float, high: float) -> bool:
        """Return whether what reaches from one column to another is not cut by the strip."""
        return (self.left == 0 or low > self.left) and (self.right == self.width or high < self.right - 1)

    def meets(self, low: float, high: float) -> bool:
        """Return whether the strip has any of these columns."""
        return high >= self.left and low < self.right


def strips(width: int, count: int) -> List[Tuple[int, int]]:
    """Return left and right of a number of strips of one width that overlap, and together are an image."""
    side = round(width * (1 + (count - 1) * SCHEDULE.overlap) / count)
    lefts = np.linspace(0, width - side, count).round().astype(int)
    return [(int(left), int(left) + side) for left in lefts]


class Changes:
    """Where the image of a camera changes from frame to frame."""

    def __init__(self) -> None:
        self._last = np.zeros((0, 0), np.float32)

    def columns(self, bgr: np.ndarray, boxes: Sequence[np.ndarray]) -> np.ndarray:
        """Return the columns [px] where the image, (H, W, 3) uint8, changed outside of boxes, (N,).

        Args:
            boxes: least and greatest x and y of people, (2, 2) each [px].
        """
        scale = SCHEDULE.grey_width / max(bgr.shape[1], bgr.shape[0] / SCHEDULE.grey_aspect)
        size = (max(round(bgr.shape[1] * scale), 1), max(round(bgr.shape[0] * scale), 1))
        grey = cv2.cvtColor(cv2.resize(bgr, size, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY).astype(np.float32)
        last, self._last = self._last, grey
        if last.shape != grey.shape:
            return np.zeros(0)
        difference = grey - last
        changed = np.abs(difference - np.median(difference)) > SCHEDULE.grey_levels
        for low, high in boxes:
            more = SCHEDULE.round_people * (high - low).max()
            (left, top), (right, bottom) = ((low - more) * scale).astype(int), ((high + more) * scale).astype(int) + 1
            changed[max(top, 0):max(bottom, 0), max(left, 0):max(right, 0)] = False
        return (np.nonzero(changed)[1] + 0.5) / scale


class Schedule:
    """Which part of an image is searched next: what waits longest, sooner where something happened."""

    def __init__(self, parts: Sequence[Part]) -> None:
        self.parts = list(parts)
        self._since: Dict[Part, float] = {}
        self._urgency: Dict[Part, float] = {}

    def urge(self, low: float, high: float, factor: float) -> None:
        """Let the parts that have some of these columns wait less until they are searched."""
        for part in self.parts:
            if part.meets(low, high):
                self._urgency[part] = max(self._urgency.get(part, 1.0), factor)

    def changed(self, columns: np.ndarray) -> None:
        """Let the parts wait less in which enough pixels of `Changes` changed."""
        for part in self.parts:
            if ((columns >= part.left) & (columns < part.right)).sum() >= SCHEDULE.grey_pixels:
                self._urgency[part] = max(self._urgency.get(part, 1.0), SCHEDULE.changed)

    def order(self, stamp: float) -> List[Part]:
        """Return all parts, the most urgent first; those that were never searched come before all others."""
        def wait(part: Part) -> float:
            if part not in self._since:
                return float('inf')
            return max(stamp - self._since[part], 1e-3) * self._urgency.get(part, 1.0)
        return sorted(self.parts, key=wait, reverse=True)

    def done(self, part: Part, stamp: float) -> None:
        """Note that a part was searched."""
        self._since[part] = stamp
        self._urgency.pop(part, None)


def fair_share(own: float, *others: float) -> float:
    """Return which share of the time a camera has, by the shares that it and others would make use of.

    Who wants least has that, as long as it is no more than an equal share of what is left. What nobody wants is divided
    in proportion to what they want.
    """
    left, level = 1.0, 0.0
    wanted = sorted((own, *others))
    for number, one in enumerate(wanted):
        level = left / (len(wanted) - number)
        left -= min(one, level)
    if left <= 0:
        return min(own, level)
    return own / sum(wanted) if sum(wanted) > 0 else 1 / len(wanted)


class Budget:
    """How long the networks may take for a frame of a camera, and what is saved for searching.

    Args:
        rate: that is wanted [Hz]; 0: they may take any time.

    Attributes:
        spent: in the newest frame so far [s].
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._intervals: Deque[float] = deque(maxlen=SCHEDULE.recent_intervals)
        self._seconds = float('inf') if rate <= 0 else SCHEDULE.network_share / rate
        self._saved = float('inf') if rate <= 0 else 0.0
        self._crops = self._search = self.spent = 0.0

    def begin(self, interval: float, least: float = 0.0, crops: float = 0.0, search: float = 0.0,
              beside: Sequence['Budget'] = ()) -> None:
        """Begin a frame.

        Args:
            interval: since the one before [s]; 0: the first, or it does not tell how often images come.
            least: what there is time for in any case [s].
            crops, search: what it would take to look at everybody, and to search the whole image [s].
            beside: of the other cameras that show something.
        """
        self.spent = 0.0
        if self._rate > 0:
            if interval > 0:
                self._intervals.append(interval)
            self._crops, self._search = crops, search
            shortest = (1 + len(beside)) / self._rate
            share = fair_share(*(each._wanted(shortest) / SCHEDULE.network_share for each in (self, *beside)))
            self._seconds = max(SCHEDULE.network_share * share * self._interval(shortest), least)

    def _interval(self, shortest: float) -> float:
        # frames that are left out make intervals longer: the least is that of the camera
        return max(shortest, min(self._intervals, default=0.0))

    def _wanted(self, shortest: float) -> float:
        """Return the time that would be of use, per time."""
        interval = self._interval(shortest)
        return self._crops / interval + self._search / max(interval, SCHEDULE.search_time)

    def crops(self, seconds: float) -> int:
        """Return the number of people, one at least, for whom there is time, when each takes some seconds."""
        return max(int((1 - SCHEDULE.search_share) * min(self._seconds / max(seconds, 1e-9), 1e6)), 1)

    def save(self, spent: float) -> None:
        """Save what is left of the frame's time after crops took a part of it [s]."""
        self.spent += spent
        # a crop that takes longer than a frame does not take from the search
        left = max(self._seconds - spent, SCHEDULE.search_share * self._seconds)
        self._saved = min(self._saved + left, SCHEDULE.most_saved * self._seconds)

    def affords(self, seconds: float) -> bool:
        """Return whether enough is saved, or the most that can be: on a slow machine a part may take longer."""
        return self._saved >= min(seconds, SCHEDULE.most_saved * self._seconds)

    def spend(self, seconds: float) -> None:
        """Spend what was saved; a debt is one frame's time at most."""
        self.spent += seconds
        self._saved = max(self._saved - seconds, -self._seconds) if self._rate > 0 else self._saved
