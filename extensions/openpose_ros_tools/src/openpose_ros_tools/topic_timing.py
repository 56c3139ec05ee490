"""Rate of a topic, and delay of its frames from header.stamp to the recording."""
from typing import List, NamedTuple, Optional, Sequence

import numpy as np
import pandas as pd

# Stamps of a median delay beyond this [s] are of another clock: nodes drop frames rather than fall behind by seconds.
OTHER_CLOCK = 10.0


class TopicTiming(NamedTuple):
    """The messages of a topic; those with one stamp, as one per person, are a frame."""

    topic: str
    kind: str  # type of the messages
    messages: int
    arrivals: np.ndarray  # (F,) int64 [ns] when the last message of each frame was recorded
    # (F,) int64 [ns] ascending; empty where the messages have no header or no stamp: then each message is a frame
    stamps: np.ndarray

    @property
    def rate(self) -> float:
        """Frames per second between the first and the last arrival [Hz]; NaN of less than two."""
        span = float(np.ptp(self.arrivals)) * 1e-9 if len(self.arrivals) else 0.0
        return (len(self.arrivals) - 1) / span if span > 0 else float('nan')

    @property
    def delays(self) -> np.ndarray:
        """(F,) float64 [ms], from the stamp to the arrival; (0,) without stamps."""
        return (self.arrivals - self.stamps) * 1e-6 if len(self.stamps) else np.zeros(0)


def topic_timing(topic: str, kind: str, stamps: Sequence[Optional[int]], arrivals: Sequence[int]) -> TopicTiming:
    """Return the timing of messages.

    Args:
        stamps: (M,) [ns]; None or 0: the message has none.
        arrivals: (M,) [ns] times of recording.
    """
    known, arrived = np.array([stamp or 0 for stamp in stamps], np.int64), np.array(arrivals, np.int64)
    if not (known > 0).any():
        return TopicTiming(topic, kind, len(arrived), arrived, np.zeros(0, np.int64))
    last = pd.Series(arrived[known > 0]).groupby(known[known > 0]).max()
    return TopicTiming(topic, kind, len(arrived), last.to_numpy(), last.index.to_numpy())


def timing_table(timings: Sequence[TopicTiming]) -> pd.DataFrame:
    """Return a row per topic; rate and delays are NaN where not known.

    The rows are in the order of the median delay, topics without delay last: the way of a frame through the nodes. 95 %
    of the delays are at most '95 % [ms]', linearly interpolated.
    """
    rows = []
    for one in timings:
        delays = pd.Series(one.delays, dtype=np.float64)
        rows.append({'topic': one.topic, 'type': one.kind, 'messages': one.messages, 'frames': len(one.arrivals),
                     'rate [Hz]': one.rate, 'median [ms]': delays.median(), 'mean [ms]': delays.mean(),
                     '95 % [ms]': delays.quantile(0.95), 'max [ms]': delays.max(), 'min [ms]': delays.min()})
    return pd.DataFrame(rows, columns=list(rows[0])).sort_values(['median [ms]', 'topic'])


def notes(timings: Sequence[TopicTiming], other_clock: float = OTHER_CLOCK) -> List[str]:
    """Return what a reader of the delays has to know.

    Args:
        other_clock: median delay beyond which the stamps are of another clock [s].
    """
    found = []
    stamped = [one for one in timings if len(one.stamps)]
    # no recorder gets messages in no time
    written = [one.topic for one in stamped if not one.delays.any()]
    if written:
        found.append(f"{', '.join(written)}: the messages have exactly the times of their stamps, as process_bag and "
                     'images_to_bag write them: no live recording.')
    other = [one.topic for one in stamped if abs(np.median(one.delays)) > 1000 * other_clock]
    if other:
        found.append(f"{', '.join(other)}: the stamps are of another clock than the times of recording. The recording "
                     'was played without its clock, or the clocks of the computers differ; differences between topics '
                     'are still the delays between them.')
    ahead = [one.topic for one in stamped if one.topic not in other and one.delays.min() < 0]
    if ahead:
        found.append(f"{', '.join(ahead)}: messages were recorded before their stamp: the clock that stamps is ahead, "
                     'or the driver stamps into the future. Delays are too small by at least this.')
    return found
