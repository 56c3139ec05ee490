"""Why two streams do not pair, and which slop would pair them, by the stamps that came."""
import math
from typing import Dict, NamedTuple, Optional, Sequence

import numpy as np

from openpose_ros_pkg.stream.pairing import StampMatcher, mutual_nearest

# Factor on a suggested value, before it is rounded up to one digit.
_ROOM = 1.2
_MOST_SLOP = 10.0  # greatest value of the parameter [s]
# Stamps of one stream that are behind those of the other by more are of another clock, or came late [s].
_SAME_CLOCK = 1.0


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
