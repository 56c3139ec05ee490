"""Rate of a topic, and delay of its frames from header.stamp to the recording."""
from dataclasses import astuple, dataclass
from typing import List, Optional, Sequence, Tuple

import numpy as np

# Stamps of a median delay beyond this [s] are of another clock: nodes drop frames rather than fall behind by seconds.
OTHER_CLOCK = 10.0
COLUMNS = ('topic', 'type', 'messages', 'frames', 'rate [Hz]', 'median [ms]', 'mean [ms]', '95 % [ms]', 'max [ms]',
           'min [ms]')
_TEXT_COLUMNS = 2


@dataclass(frozen=True)
class Spread:
    """Statistics of durations [ms], NaN of none; p95: 95 % are at most this, linearly interpolated."""

    median: float
    mean: float
    p95: float
    greatest: float
    least: float

    @classmethod
    def of(cls, values: np.ndarray) -> 'Spread':
        """Return the statistics of (N,) values."""
        if not len(values):
            return cls(*[float('nan')] * 5)
        return cls(*map(float, (np.median(values), values.mean(), np.percentile(values, 95), values.max(),
                                values.min())))


@dataclass(frozen=True)
class TopicTiming:
    """The messages of a topic; those with one stamp, as one per person, are a frame."""

    topic: str
    kind: str  # type of the messages
    messages: int
    arrivals: np.ndarray  # (F,) int64 [ns] when the last message of each frame was recorded
    # (F,) int64 [ns] ascending; empty where the messages have no header or no stamp: then each message is a frame
    stamps: np.ndarray

    @classmethod
    def of_messages(cls, topic: str, kind: str, stamps: Sequence[Optional[int]], arrivals: Sequence[int]
                    ) -> 'TopicTiming':
        """Return the timing of messages.

        Args:
            stamps: (M,) [ns]; None or 0: the message has none.
            arrivals: (M,) [ns] times of recording.
        """
        known = np.array([stamp or 0 for stamp in stamps], np.int64)
        arrived = np.array(arrivals, np.int64)
        if not (known > 0).any():
            return cls(topic, kind, len(arrived), arrived, np.zeros(0, np.int64))
        frames, number = np.unique(known[known > 0], return_inverse=True)
        last = np.zeros(len(frames), np.int64)
        np.maximum.at(last, number, arrived[known > 0])
        return cls(topic, kind, len(arrived), last, frames)

    @property
    def rate(self) -> float:
        """Frames per second between the first and the last arrival [Hz]; NaN of less than two."""
        span = float(np.ptp(self.arrivals)) * 1e-9 if len(self.arrivals) else 0.0
        return (len(self.arrivals) - 1) / span if span > 0 else float('nan')

    @property
    def delays(self) -> np.ndarray:
        """(F,) float64 [ms], from the stamp to the arrival; (0,) without stamps."""
        return (self.arrivals - self.stamps) * 1e-6 if len(self.stamps) else np.zeros(0)

    @property
    def delay(self) -> Spread:
        """Statistics of the delays."""
        return Spread.of(self.delays)

    @property
    def is_written(self) -> bool:
        """Whether a program wrote the messages with the times of their stamps: no recorder gets them in no time."""
        return bool(len(self.stamps)) and not self.delays.any()


def in_order(timings: Sequence[TopicTiming]) -> List[TopicTiming]:
    """Return the topics by median delay, those without delay last: the way of a frame through the nodes."""
    return sorted(timings, key=lambda one: (not len(one.stamps), one.delay.median if len(one.stamps) else 0.0,
                                            one.topic))


def cells(timing: TopicTiming) -> Tuple[str, ...]:
    """Return the texts of COLUMNS; empty where a figure is not known."""
    figures = (timing.rate, *astuple(timing.delay))
    return (timing.topic, timing.kind, str(timing.messages), str(len(timing.arrivals)),
            *(f'{value:.3f}' if np.isfinite(value) else '' for value in figures))


def notes(timings: Sequence[TopicTiming], other_clock: float = OTHER_CLOCK) -> List[str]:
    """Return what a reader of the delays has to know.

    Args:
        other_clock: median delay beyond which the stamps are of another clock [s].
    """
    found = []
    written = [one.topic for one in timings if one.is_written]
    if written:
        found.append(f"{', '.join(written)}: the messages have exactly the times of their stamps, as process_bag and "
                     'images_to_bag write them: no live recording.')
    other = [one.topic for one in timings if abs(one.delay.median) > 1000 * other_clock]
    if other:
        found.append(f"{', '.join(other)}: the stamps are of another clock than the times of recording. The recording "
                     'was played without its clock, or the clocks of the computers differ; differences between topics '
                     'are still the delays between them.')
    ahead = [one.topic for one in timings if one.topic not in other and one.delay.least < 0]
    if ahead:
        found.append(f"{', '.join(ahead)}: messages were recorded before their stamp: the clock that stamps is ahead, "
                     'or the driver stamps into the future. Delays are too small by at least this.')
    return found


def markdown(timings: Sequence[TopicTiming]) -> str:
    """Return the topics as a table in Markdown with aligned columns."""
    rows = [COLUMNS, *map(cells, timings)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(COLUMNS))]
    lines = ['| ' + ' | '.join(cell.ljust(width) if column < _TEXT_COLUMNS else cell.rjust(width)
                               for column, (cell, width) in enumerate(zip(row, widths))) + ' |' for row in rows]
    rule = '|' + '|'.join('-' * (width + 1) + ('-' if column < _TEXT_COLUMNS else ':')
                          for column, width in enumerate(widths)) + '|'
    return '\n'.join([lines[0], rule, *lines[1:]]) + '\n'
