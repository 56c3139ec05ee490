"""Pair the messages of two streams by their stamps.

Every message pairs with the nearest of the other stream or stays alone; a message whose partner was lost must not take
its neighbour. The streams tell what "near" is: their period, and the usual difference between the stamps of a pair.
"""
from collections import deque
from dataclasses import dataclass
from typing import Any, Deque, List, Optional, Tuple

import numpy as np

from openpose_ros_pkg.params.parameters import Parameters, parameter

# Share of the shorter period that a pair may deviate from the usual difference: below a half, so that no message lies
# within reach of two of the other stream; far enough below it that jitter of a tenth of the period does no harm.
_SLOP_SHARE = 0.4
# Slop until period and usual difference are known, and the least ever [s].
_FIRST_SLOP = 0.005
_LEAST_SLOP = 0.0005
# Stamps of each stream to learn from, and how many differences are needed before what they say is believed.
_HISTORY = 64
_MIN_PERIODS = 4
_MIN_OFFSETS = 7
# Differences between stamps beyond this share of the period belong to a lost partner: not to be learnt from.
_OFFSET_SHARE = 0.6
# Lost messages lengthen differences but never shorten them, so the shortest quarter's end is the period.
_PERIOD_RANK = 0.25
# Stamps that go back by more are a new beginning (bag loop, restarted clock), by less a late message [ns].
_RESET_BACKSTEP = 500_000_000
# Derived bounds of the queues: seconds worth of messages, least and greatest number. Images may wait a second for a
# late cloud. A cloud of 960 x 540 points takes 16 MB, so at most 15 (250 MB) wait for late images.
_QUEUE_BOUNDS = ((1.0, 2, 30), (0.5, 2, 15))


@dataclass(frozen=True)
class PairingParams(Parameters):
    """How images and clouds are paired."""

    slop: float = parameter(
        0.0, 'Largest deviation of the stamps of a pair from the usual difference between the two streams; '
             '0: 0.4 of the shorter frame period, learnt from the stamps.', unit='s', minimum=0.0, maximum=10.0)
    queue_size: int = parameter(
        0, 'Images and clouds (16 MB each at 960 x 540) that may wait for their partner; 0: one second of images '
           '(at most 30) and half a second of clouds (at most 15).', minimum=0, maximum=1000)


class StampMatcher:
    """Pairs the messages of stream 0 and stream 1; not thread-safe.

    Attributes:
        unpaired: messages of each stream that were given up without a partner.
        out_of_order: messages older than, or as old as, the one before them in their stream; they are not used.
        resets: times that stamps jumped back and everything waiting was forgotten.
    """

    def __init__(self, params: PairingParams) -> None:
        self._params = params
        self._queues: Tuple[Deque[Tuple[int, Any]], ...] = (deque(), deque())
        self._stamps: Tuple[Deque[int], ...] = (deque(maxlen=_HISTORY), deque(maxlen=_HISTORY))
        self._periods: List[Optional[float]] = [None, None]
        self._offset: Optional[float] = None
        self.unpaired = [0, 0]
        self.out_of_order = 0
        self.resets = 0

    @property
    def slop(self) -> float:
        """Largest deviation from the usual difference that pairs at present [s]."""
        return self._params.slop or self._sure_slop

    @property
    def offset(self) -> float:
        """Usual stamp of stream 1 minus that of stream 0 in a pair, as learnt [s]."""
        return (self._offset or 0.0) * 1e-9

    @property
    def periods(self) -> Tuple[Optional[float], Optional[float]]:
        """Period of each stream as learnt [s], None while unknown."""
        first, second = (None if period is None else period * 1e-9 for period in self._periods)
        return first, second

    def add(self, stream: int, stamp: int, item: Any) -> Optional[Tuple[Any, Any]]:
        """Take a message and return a pair (item of stream 0, item of stream 1) if there is one now.

        A pair is returned at once when no message to come can be nearer to either of the two. Messages older than
        those of a returned pair are given up; no message is returned twice.

        Args:
            stream: 0 or 1.
            stamp: [ns].
        """
        last = self._stamps[stream][-1] if self._stamps[stream] else None
        if last is not None and stamp < last - _RESET_BACKSTEP:
            self._reset()
        elif last is not None and stamp <= last:
            self.out_of_order += 1
            return None
        self._stamps[stream].append(stamp)
        self._learn(stream)
        self._queues[stream].append((stamp, item))
        pair = self._take_pair()
        self._give_up_hopeless()
        return pair

    def restart(self) -> None:
        """Forget all messages and counts; what was learnt of period and offset stays."""
        self._reset()
        self.unpaired = [0, 0]
        self.out_of_order = self.resets = 0

    def finish(self) -> List[Tuple[Any, Any]]:
        """Return the pairs among what waits, now that nothing is to come; the rest is given up."""
        pairs = []
        while True:
            pair = self._take_pair(ended=True)
            if pair is None:
                break
            pairs.append(pair)
        for stream in (0, 1):
            self.unpaired[stream] += len(self._queues[stream])
            self._queues[stream].clear()
        return pairs

    @property
    def _shorter_period(self) -> Optional[float]:
        """Shorter period of the two [ns], None while one is unknown."""
        first, second = self._periods
        return None if first is None or second is None else min(first, second)

    @property
    def _sure_slop(self) -> float:
        """Slop within which no message has two candidates [s]."""
        period = self._shorter_period
        if period is None:
            return _FIRST_SLOP
        derived = max(_SLOP_SHARE * period * 1e-9, _LEAST_SLOP)
        return min(derived, _FIRST_SLOP) if self._offset is None else derived

    def _reset(self) -> None:
        """Forget all messages; period and offset stay, as the devices are the same."""
        self.resets += 1
        for stream in (0, 1):
            self.unpaired[stream] += len(self._queues[stream])
            self._queues[stream].clear()
            self._stamps[stream].clear()

    def _learn(self, stream: int) -> None:
        if len(self._stamps[stream]) > _MIN_PERIODS:
            differences = np.sort(np.diff(np.array(self._stamps[stream])))
            self._periods[stream] = float(differences[int(_PERIOD_RANK * len(differences))])
        period = self._shorter_period
        if period is None or not all(self._stamps):
            return
        origin = self._stamps[0][0]
        first, second = (np.array([stamp - origin for stamp in stamps], np.float64) for stamps in self._stamps)
        of_first, of_second = mutual_nearest(second[None, :] - first[:, None])
        offsets = second[of_second] - first[of_first]
        offsets = offsets[np.abs(offsets) < _OFFSET_SHARE * period]
        if len(offsets) >= _MIN_OFFSETS:
            self._offset = float(np.median(offsets))

    def _deviations(self) -> np.ndarray:
        """Return stamp difference minus offset of all that waits, (N0, N1) float64 [s]."""
        origin = self._queues[0][0][0]
        first, second = (np.array([stamp - origin for stamp, _ in queue], np.float64) for queue in self._queues)
        return (second[None, :] - first[:, None]) * 1e-9 - self.offset

    def _take_pair(self, ended: bool = False) -> Optional[Tuple[Any, Any]]:
        if not all(self._queues):
            return None
        deviations = self._deviations()
        for i, j in zip(*mutual_nearest(deviations)):
            deviation = abs(deviations[i, j])
            # with a generous slop the next message of either stream may be nearer: wait until both are there
            followed = ended or (i + 1 < len(self._queues[0]) and j + 1 < len(self._queues[1]))
            if deviation < self.slop and (deviation < self._sure_slop or followed):
                pair = (self._queues[0][i][1], self._queues[1][j][1])
                for stream, index in ((0, i), (1, j)):
                    self.unpaired[stream] += int(index)
                    for _ in range(index + 1):
                        self._queues[stream].popleft()
                return pair
        return None

    def _give_up_hopeless(self) -> None:
        """Drop what nothing to come can pair with, and what exceeds the queues."""
        for stream in (0, 1):
            queue = self._queues[stream]
            while queue and (len(queue) > self._bound(stream) or self._is_hopeless(stream, queue[0][0])):
                queue.popleft()
                self.unpaired[stream] += 1

    def _is_hopeless(self, stream: int, stamp: int) -> bool:
        """Tell whether the other stream has passed the partner's stamp and nothing near it waits."""
        if not self._stamps[1 - stream]:
            return False
        partner = self.offset if stream == 0 else -self.offset
        distances = [(other - stamp) * 1e-9 - partner for other, _ in self._queues[1 - stream]]
        passed = (self._stamps[1 - stream][-1] - stamp) * 1e-9 - partner >= self.slop
        return passed and all(abs(distance) >= self.slop for distance in distances)

    def _bound(self, stream: int) -> int:
        seconds, least, greatest = _QUEUE_BOUNDS[stream]
        if self._params.queue_size:
            return self._params.queue_size
        period = self._periods[stream]
        return greatest if not period else int(min(max(seconds * 1e9 / period, least), greatest))


def mutual_nearest(differences: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return rows and columns of the pairs in which each is the nearest to the other.

    Args:
        differences: (N, M), signed; N and M at least 1.

    Returns:
        rows, columns: ascending (n,) int.
    """
    distances = np.abs(differences)
    of_row, of_column = distances.argmin(axis=1), distances.argmin(axis=0)
    rows = np.flatnonzero(of_column[of_row] == np.arange(len(distances)))
    return rows, of_row[rows]
