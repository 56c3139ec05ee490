"""Why two streams do not pair, and which parameters would pair them: tried on the stamps that came."""
import math
from contextlib import suppress
from typing import Dict, Iterator, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.stream.pairing import PairingParams, StampMatcher, mutual_nearest

# Factor on a suggested value, before it is rounded up to one digit.
_ROOM = 1.2
# Share of the pairs within its slop that a suggestion has to make.
_LEAST_SHARE = 0.5
# Stamps of one stream that are behind those of the other by more are of another clock, or came late [s].
_SAME_CLOCK = 1.0


class PairingReport(NamedTuple):
    """Why two streams do not pair."""

    difference: float  # of the nearest stamps, the median of each message's [s]
    allowed: float  # largest difference that pairs at present [s]
    behind: float  # newest stamp of stream 0 minus that of stream 1 [s]
    # of PairingParams, which would pair them; empty: none would, or the present ones will when more messages come
    settings: Dict[str, float]

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
            parts.append('they wait for the next messages, which may be nearer')
        if setting and self.settings:
            values = ' '.join(setting.format(*each) for each in self.settings.items())
            parts.append(f'{"if it only comes late, " if is_behind else ""}{values} pairs them')
        return '; '.join(parts)


def pairing_report(matcher: StampMatcher) -> Optional[PairingReport]:
    """Return why the latest messages did not pair; None: only one stream has messages."""
    arrivals = list(matcher.arrivals)
    places = [[place for place, (of, _) in enumerate(arrivals) if of == stream] for stream in (0, 1)]
    if not all(places):
        return None
    first, second = (np.array([(arrivals[place][1] - arrivals[0][1]) * 1e-9 for place in of_stream])
                     for of_stream in places)
    differences = second[None, :] - first[:, None] - matcher.offset
    rows, columns = mutual_nearest(differences)
    nearest = np.abs(differences[rows, columns])
    # Number of messages of the same stream that come before the partner does.
    waiting = max(sum(of == arrivals[begin][0] for of, _ in arrivals[begin:end]) for begin, end in (
        sorted((places[0][i], places[1][j])) for i, j in zip(rows.tolist(), columns.tolist())))
    now = matcher.params
    slop, queue_size = _rounded_up(float(np.quantile(nearest, 0.9))), math.ceil(_rounded_up(waiting))
    settings: Dict[str, float] = {}
    for tried in _allowed((now.slop, now.queue_size), (slop, now.queue_size), (now.slop, queue_size),
                          (slop, queue_size)):
        within = np.count_nonzero(nearest < (tried.slop or matcher.slop))
        other = StampMatcher(tried, matcher.constants)
        pairs = sum(other.add(stream, stamp, None) is not None for stream, stamp in arrivals) + len(other.finish())
        if pairs >= max(_LEAST_SHARE * within, 1):
            settings = {key: value for key, value in vars(tried).items() if value != getattr(now, key)}
            break
    return PairingReport(float(np.median(nearest)), matcher.slop, float(first[-1] - second[-1]), settings)


def _allowed(*values: Tuple[float, int]) -> Iterator[PairingParams]:
    """Yield parameters of each slop and queue size that are in range."""
    for slop, queue_size in values:
        with suppress(ParameterError):
            yield PairingParams(slop, queue_size)


def _rounded_up(value: float) -> float:
    """Return a value with room, rounded up to one digit."""
    digits = 1 - math.ceil(math.log10(max(_ROOM * value, 1e-6)))
    return math.ceil(_ROOM * value * 10**digits) / 10**digits
