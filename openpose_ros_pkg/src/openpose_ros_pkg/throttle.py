"""How often a repeated fault is reported."""
import threading
import time
from typing import Dict

# A fault of a kind is reported once in this time [s]; the others are counted.
WARNING_PERIOD = 5.0


class Throttle:
    """Tells which of many faults of a kind is reported: the first, then one in each period; thread-safe.

    Args:
        period: between two of a kind [s].
    """

    def __init__(self, period: float = WARNING_PERIOD) -> None:
        self._period, self._lock = period, threading.Lock()
        self._reported: Dict[str, float] = {}

    def is_due(self, kind: str) -> bool:
        """Return whether a fault of this kind is reported now."""
        with self._lock:
            now = time.monotonic()
            if now - self._reported.get(kind, -float('inf')) < self._period:
                return False
            self._reported[kind] = now
            return True
