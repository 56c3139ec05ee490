"""What is reported, by how far and how long its definition holds."""
import numpy as np

from openpose_ros_signals.constants import SIGNALS
from openpose_ros_signals.geometry import TICK

_HOLD = SIGNALS.hold


class Held:
    """One signal of one person over time: begins and ends with hysteresis, and never for a moment.

    Attributes:
        on: whether it is reported.
        since: when it began to hold, before it was reported [s].
        confidence: mean degree of late.

    Args:
        begin: it is reported when it has held for this long [s].
        at_once: it is reported at once when it holds wholly, after a part of `begin` when it holds less.
    """

    def __init__(self, begin: float = _HOLD.begin, at_once: bool = False) -> None:
        self._begin, self._at_once = begin, at_once
        self.on = False
        self.since = self.confidence = np.nan
        self._from = self._until = self._before = np.nan

    def update(self, stamp: float, degree: float) -> None:
        """Take how far it holds at a time [s]; NaN: its joints are hidden."""
        if np.isnan(degree):
            if stamp - self._before > _HOLD.hidden:
                self.on, self._from = False, np.nan
            return
        if self.on:
            share = min((stamp - self._before) / _HOLD.memory, 1.0)
            self.confidence += share * (degree - self.confidence)
            self._until = np.nan if degree >= _HOLD.unsure else _first(self._until, stamp)
            unseen = stamp - self._before > _HOLD.hidden
            self.on = np.isnan(self._until) or not (unseen or stamp - self._until >= _HOLD.end - TICK)
            self._from = np.nan
        else:
            self._from = _first(self._from, stamp) if degree >= _HOLD.sure else np.nan
            part = min((1 - degree) / (1 - _HOLD.sure), 1.0) if self._at_once else 1.0
            if stamp - self._from >= part * self._begin - TICK:
                self.on, self.since, self.confidence, self._until = True, self._from, degree, np.nan
        self._before = stamp


def _first(earlier: float, stamp: float) -> float:
    return stamp if np.isnan(earlier) else earlier
