"""How often a fault that repeats is told."""
import threading
import time
from typing import Callable, Dict

# A fault of a kind is told once in this time [s]; the others are counted.
WARNING_PERIOD = 5.0


class Throttle:
    """Says which of many equal faults is told: the first, and then one in each period. Any thread may call it.

    Args:
        period: between two of a kind [s].
        now: the time [s]; only differences count.
    """

    def __init__(self, period: float = WARNING_PERIOD, now: Callable[[], float] = time.monotonic) -> None:
        self._period, self._now = period, now
        self._lock = threading.Lock()
        self._told: Dict[str, float] = {}

    def is_due(self, kind: str) -> bool:
        """Return whether a fault of this kind is told now."""
        with self._lock:
            now = self._now()
            if now - self._told.get(kind, -float('inf')) < self._period:
                return False
            self._told[kind] = now
            return True
