"""Pair the messages of two streams by their stamps, and tell why they do not pair.

Every message pairs with the nearest one of the other stream or stays alone: if its partner was lost, it must not take
the next one. The largest deviation follows from the period of the streams and the usual difference of stamps in a pair.
"""
import math
from collections import deque
from dataclasses import dataclass
from typing import Any, Deque, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class PairingConstants:
    """How period and usual difference of two streams are learnt, and which stamps pair."""

    slop_share: float = constant(
        0.4, 'Largest deviation of a pair from the usual difference, as a share of the shorter period: below a half, '
             'so that no message has two candidates; jitter of a tenth of the period is tolerated.')
    first_slop: float = constant(0.005, 'Largest deviation until period and difference are known.', unit='s')
    history: int = constant(64, 'Stamps of each stream to learn from, and by which a report says why none pair.')
    min_offsets: int = constant(7, 'Pairs that the usual difference needs, and stamps that a period needs.')
    offset_share: float = constant(
        0.6, 'Pairs with a greater difference, as a share of the period, lack their partners: not learnt from.')
    period_rank: float = constant(
        0.25, 'The period is this quantile of the differences: lost messages lengthen differences, never shorten them.')
    reset_backstep: int = constant(
        500_000_000, 'Stamps that go back by more start a new recording (bag loop, restarted clock); by less: late '
                     'messages.', unit='ns')
    queue: Tuple[int, int] = constant(
        (30, 15), 'Images and clouds that may wait for their partner: 15 clouds of 960 x 540 points take 250 MB.')


PAIRING = PairingConstants()
# Factor on a suggested value, before it is rounded up to one digit.
_ROOM = 1.2
_MOST_SLOP = 10.0  # greatest value of the parameter [s]
# Stamps of one stream that are behind those of the other by more are of another clock, or came late [s].
_SAME_CLOCK = 1.0


@dataclass(frozen=True)
class PairingParams(Parameters):
    """How images and clouds are paired."""

    slop: float = parameter(
        0.0, 'Largest deviation of the stamps of a pair from the usual difference between the two streams; '
             '0: 0.4 of the shorter frame period, learnt from the stamps.', unit='s', minimum=0.0, maximum=10.0)
    queue_size: int = parameter(
        0, 'Images and clouds (16 MB each at 960 x 540) that may wait for their partner; 0: 30 images and 15 '
           'clouds.', minimum=0, maximum=1000)


class StampMatcher:
    """Pairs the messages of stream 0 and stream 1; not thread-safe.

    Attributes:
        unpaired: messages of each stream that were dropped without a partner.
        out_of_order: messages not newer than the one before them in their stream; they are not used.
        resets: number of times that stamps jumped back and all waiting messages were dropped.
        arrivals: stream and stamp of the latest messages, in the order of their arrival.
    """

    def __init__(self, params: PairingParams, constants: PairingConstants = PAIRING) -> None:
        self.params, self.constants = params, constants
        self._queues: Tuple[Deque[Tuple[int, Any]], ...] = (deque(), deque())
        self._stamps: Tuple[Deque[int], ...] = tuple(deque(maxlen=constants.history) for _ in range(2))
        self._periods: List[Optional[float]] = [None, None]
        self._offset: Optional[float] = None
        self.arrivals: Deque[Tuple[int, int]] = deque(maxlen=2 * constants.history)
        self.unpaired = [0, 0]
        self.out_of_order = 0
        self.resets = 0

    @property
    def slop(self) -> float:
        """Largest deviation from the usual difference that pairs at present [s]."""
        return self.params.slop or self._sure_slop

    @property
    def offset(self) -> float:
        """Usual stamp of stream 1 minus that of stream 0 in a pair, as learnt [s]."""
        return (self._offset or 0.0) * 1e-9

    def add(self, stream: int, stamp: int, item: Any) -> Optional[Tuple[Any, Any]]:
        """Take a message; return a pair (item of stream 0, item of stream 1) as soon as no later one can be nearer.

        Messages older than those of a returned pair are dropped; no message is returned twice.

        Args:
            stream: 0 or 1.
            stamp: [ns].
        """
        last = self._stamps[stream][-1] if self._stamps[stream] else None
        if last is not None and stamp < last - self.constants.reset_backstep:
            self._reset()
        elif last is not None and stamp <= last:
            self.out_of_order += 1
            return None
        self._stamps[stream].append(stamp)
        self.arrivals.append((stream, stamp))
        self._learn(stream)
        self._queues[stream].append((stamp, item))
        pair = self._take_pair()
        self._drop_unpairable()
        return pair

    def restart(self) -> None:
        """Forget all messages and counts, but not the learnt period and offset."""
        self._reset()
        self.unpaired = [0, 0]
        self.out_of_order = self.resets = 0

    def finish(self) -> List[Tuple[Any, Any]]:
        """Return the pairs among the waiting messages at the end of the streams; the rest is dropped."""
        pairs = list(iter(lambda: self._take_pair(ended=True), None))
        self._clear_queues()
        return pairs

    @property
    def _shorter_period(self) -> Optional[float]:
        """Shorter period of the two [ns]; None while one is unknown."""
        first, second = self._periods
        return None if first is None or second is None else min(first, second)

    @property
    def _sure_slop(self) -> float:
        """Largest deviation at which no message has two candidates [s]."""
        period, constants = self._shorter_period, self.constants
        if period is None:
            return constants.first_slop
        derived = constants.slop_share * period * 1e-9
        return min(derived, constants.first_slop) if self._offset is None else derived

    def _reset(self) -> None:
        """Forget all messages; period and offset stay, as the devices are the same."""
        self.resets += 1
        self.arrivals.clear()
        self._clear_queues()
        for stamps in self._stamps:
            stamps.clear()

    def _clear_queues(self) -> None:
        for stream, queue in enumerate(self._queues):
            self.unpaired[stream] += len(queue)
            queue.clear()

    def _learn(self, stream: int) -> None:
        if len(self._stamps[stream]) >= self.constants.min_offsets:
            differences = np.sort(np.diff(np.array(self._stamps[stream])))
            self._periods[stream] = float(differences[int(self.constants.period_rank * len(differences))])
        period = self._shorter_period
        if period is None or not all(self._stamps):
            return
        origin = self._stamps[0][0]
        first, second = (np.array([stamp - origin for stamp in stamps], np.float64) for stamps in self._stamps)
        of_first, of_second = mutual_nearest(second[None, :] - first[:, None])
        offsets = second[of_second] - first[of_first]
        offsets = offsets[np.abs(offsets) < self.constants.offset_share * period]
        if len(offsets) >= self.constants.min_offsets:
            self._offset = float(np.median(offsets))

    def _deviations(self) -> np.ndarray:
        """Return stamp difference minus offset of all waiting messages, (N0, N1) float64 [s]."""
        origin = self._queues[0][0][0]
        first, second = (np.array([stamp - origin for stamp, _ in queue], np.float64) for queue in self._queues)
        return (second[None, :] - first[:, None]) * 1e-9 - self.offset

    def _take_pair(self, ended: bool = False) -> Optional[Tuple[Any, Any]]:
        if not all(self._queues):
            return None
        deviations = self._deviations()
        for i, j in zip(*mutual_nearest(deviations)):
            deviation = abs(deviations[i, j])
            # with a generous slop the next message of either stream may be nearer: wait for both
            followed = ended or (i + 1 < len(self._queues[0]) and j + 1 < len(self._queues[1]))
            if deviation < self.slop and (deviation < self._sure_slop or followed):
                pair = (self._queues[0][i][1], self._queues[1][j][1])
                for stream, index in ((0, i), (1, j)):
                    self.unpaired[stream] += int(index)
                    for _ in range(index + 1):
                        self._queues[stream].popleft()
                return pair
        return None

    def _drop_unpairable(self) -> None:
        """Drop messages that no later one can pair with, and those beyond the bounds of the queues."""
        for stream, queue in enumerate(self._queues):
            most = self.params.queue_size or self.constants.queue[stream]
            while queue and (len(queue) > most or self._is_unpairable(stream, queue[0][0])):
                queue.popleft()
                self.unpaired[stream] += 1

    def _is_unpairable(self, stream: int, stamp: int) -> bool:
        """Return whether the other stream has passed the partner's stamp, and no message near that stamp waits."""
        if not self._stamps[1 - stream]:
            return False
        partner = self.offset if stream == 0 else -self.offset
        distances = [(other - stamp) * 1e-9 - partner for other, _ in self._queues[1 - stream]]
        passed = (self._stamps[1 - stream][-1] - stamp) * 1e-9 - partner >= self.slop
        return passed and all(abs(distance) >= self.slop for distance in distances)


def mutual_nearest(differences: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return ascending rows and columns, (n,), of the pairs in differences (N, M) that are nearest to each other."""
    distances = np.abs(differences)
    of_row, of_column = distances.argmin(axis=1), distances.argmin(axis=0)
    rows = np.flatnonzero(of_column[of_row] == np.arange(len(distances)))
    return rows, of_row[rows]


class PairingReport(NamedTuple):
    """Why two streams do not pair."""

    difference: float  # of the nearest stamps, the median of each message's [s]
    allowed: float  # largest difference that pairs at present [s]
    behind: float  # newest stamp of stream 0 minus that of stream 1 [s]
    settings: Dict[str, float]  # the slop that would pair them; empty: none, or the present one when more messages come

    def text(self, names: Sequence[str], setting: str) -> str:
        """Return the report in a line.

        Args:
            names: of the two streams.
            setting: format of a key and a value, as '{}:={}'; empty: parameters can not be set.
        """
        parts = [f'the nearest stamps of {names[0]} and {names[1]} differ by {self.difference:.2g} s, allowed are '
                 f'{self.allowed:.2g} s']
        is_behind = abs(self.behind) > _SAME_CLOCK
        if is_behind:
            late, early = names if self.behind < 0 else names[::-1]
            parts.append(f'{late} is {abs(self.behind):.3g} s behind {early}: does its clock differ?')
        elif self.difference < self.allowed and not self.settings:
            parts.append('they wait for the next messages, which may be nearer: is queue_size too small?')
        if setting and self.settings:
            values = ' '.join(setting.format(*each) for each in self.settings.items())
            parts.append(f'{values} pairs them')
        return '; '.join(parts)


def pairing_report(matcher: StampMatcher) -> Optional[PairingReport]:
    """Return why the latest messages did not pair; None: only one stream has messages."""
    stamps = [np.array([stamp for of, stamp in matcher.arrivals if of == stream], np.int64) for stream in (0, 1)]
    if not all(map(len, stamps)):
        return None
    first, second = ((of_stream - stamps[0][0]) * 1e-9 for of_stream in stamps)
    differences = second[None, :] - first[:, None] - matcher.offset
    nearest = np.abs(differences[mutual_nearest(differences)])
    behind, difference = float(first[-1] - second[-1]), float(np.median(nearest))
    slop = _rounded_up(float(np.quantile(nearest, 0.9)))
    suggested = difference >= matcher.slop and abs(behind) <= _SAME_CLOCK and slop <= _MOST_SLOP
    return PairingReport(difference, matcher.slop, behind, {'slop': slop} if suggested else {})


def _rounded_up(value: float) -> float:
    """Return a value with room, rounded up to one digit."""
    digits = 1 - math.ceil(math.log10(max(_ROOM * value, 1e-6)))
    return math.ceil(_ROOM * value * 10**digits) / 10**digits
