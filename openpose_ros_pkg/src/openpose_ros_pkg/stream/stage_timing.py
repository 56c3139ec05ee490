"""Durations of the stages of a frame over a sliding window."""
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Deque, Dict, List, Sequence, Tuple

# Entries kept of each stage: more than any camera delivers within the window.
_MOST_ENTRIES = 2000


@dataclass(frozen=True)
class StageSummary:
    """How long one stage took; percentiles and mean are NaN without entries."""

    stage: str
    count: int  # entries within the window
    rate: float  # entries per second [Hz]
    p50: float
    p95: float  # percentiles of the duration [s], by nearest rank
    mean: float  # of the duration [s]


class Stopwatch:
    """Measures successive stages: `laps` has the duration of each [s]."""

    def __init__(self) -> None:
        self.laps: Dict[str, float] = {}
        self.restart()

    def restart(self) -> None:
        """Begin a stage now; the time since the last one is not measured."""
        self._begin = time.perf_counter()

    def lap(self, stage: str) -> None:
        """End a stage, and begin the next one."""
        end = time.perf_counter()
        self.laps[stage] = end - self._begin
        self._begin = end


class StageTiming:
    """Collects how long each stage took, within a window [s]; thread-safe. The time comes from the caller."""

    def __init__(self, stages: Sequence[str], window: float) -> None:
        self.window, self._lock = window, threading.Lock()
        self._entries: Dict[str, Deque[Tuple[float, float]]] = {stage: deque(maxlen=_MOST_ENTRIES)
                                                                for stage in stages}

    def add(self, stage: str, seconds: float, now: float) -> None:
        """Add a stage that ended at `now` and took `seconds` [s]."""
        with self._lock:
            self._entries[stage].append((now, seconds))

    def summaries(self, now: float) -> List[StageSummary]:
        """Return a summary of every stage."""
        with self._lock:
            entries = {stage: [entry for entry in kept if now - entry[0] <= self.window]
                       for stage, kept in self._entries.items()}
        return [_summary(stage, kept) for stage, kept in entries.items()]


def _summary(stage: str, entries: List[Tuple[float, float]]) -> StageSummary:
    if not entries:
        return StageSummary(stage, 0, 0.0, float('nan'), float('nan'), float('nan'))
    durations, count = sorted(seconds for _, seconds in entries), len(entries)
    span = entries[-1][0] - entries[0][0]
    p50, p95 = (durations[min(int(share * count), count - 1)] for share in (0.5, 0.95))
    return StageSummary(stage, count, (count - 1) / span if span > 0 else 0.0, p50, p95, sum(durations) / count)
