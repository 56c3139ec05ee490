"""The end of an input, for topics whose readers keep each list of people until the next one comes."""
import threading
import time
from typing import Callable

from openpose_ros_pkg.ros.threads import repeat

# An input from which nothing came for this long has ended [s]; by wall time, as simulated time may stand still.
SILENCE = 2.0
# One that comes more rarely has ended after this many of its periods, which count up to this length [s].
_PERIODS, _LONGEST_PERIOD = 3, 10.0


class InputEnd:
    """Calls a function once whenever an input has ended, in a thread of its own.

    Args:
        ended: is called; `heard` waits for it, so that what it publishes comes before what the next message brings.
        silence: see `SILENCE` [s].

    Attributes:
        has_ended: whether the input has, or has not begun.
    """

    def __init__(self, ended: Callable[[], None] = lambda: None, silence: float = SILENCE) -> None:
        self._ended, self._silence, self._lock = ended, silence, threading.Lock()
        self._period, self._newest, self.has_ended = 0.0, float('nan'), True
        repeat(self._check, 'input end', silence / 10)

    def heard(self) -> None:
        """Take that something came."""
        with self._lock:
            now = time.monotonic()
            period = now - self._newest
            self._period = min(period, _LONGEST_PERIOD) if period > 0 else 0.0  # NaN: the first
            self._newest, self.has_ended = now, False

    def _check(self) -> None:
        with self._lock:
            silent = time.monotonic() - self._newest > max(self._silence, _PERIODS * self._period)
            if silent and not self.has_ended:
                self.has_ended = True
                self._ended()
