"""What is reported, by how far and how long its definition holds."""
from typing import Optional

import numpy as np

from openpose_ros_signals.constants import HoldConstants
from openpose_ros_signals.geometry import TICK


class Held:
    """One signal of one person over time: begins and ends with hysteresis, and never for a moment.

    `on`: whether it is reported, `since` when it began to hold [s], before it was reported, with which `confidence`.
    It is reported after it held for `begin` [s]; `at_once`: what holds wholly at once, less after a part of that time.
    """

    def __init__(self, constants: HoldConstants, begin: Optional[float] = None, at_once: bool = False) -> None:
        self._constants, self._at_once = constants, at_once
        self._begin = constants.time if begin is None else begin
        self.on = False
        self.since = self.confidence = np.nan
        self._from = self._until = self._before = np.nan

    def take(self, stamp: float, degree: float) -> None:
        """Take how far it holds at a time [s]; NaN: its joints are hidden."""
        constants = self._constants
        if np.isnan(degree):
            if stamp - self._before > constants.hidden:
                self.on, self._from = False, np.nan
            return
        if self.on:
            self.confidence = degree
            self._until = np.nan if degree >= constants.unsure else _first(self._until, stamp)
            unseen = stamp - self._before > constants.hidden
            self.on = np.isnan(self._until) or not (unseen or stamp - self._until >= constants.time - TICK)
            self._from = np.nan
        else:
            self._from = _first(self._from, stamp) if degree >= constants.sure else np.nan
            part = min((1 - degree) / (1 - constants.sure), 1.0) if self._at_once else 1.0
            if stamp - self._from >= part * self._begin - TICK:
                self.on, self.since, self.confidence, self._until = True, self._from, degree, np.nan
        self._before = stamp


def _first(earlier: float, stamp: float) -> float:
    return stamp if np.isnan(earlier) else earlier
