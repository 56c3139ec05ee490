"""The end of an input, for topics whose readers keep each list of people until the next one comes."""
import threading
import time
from typing import Callable

from openpose_ros_pkg.ros.threads import repeat

# An input from which nothing came for this long has ended [s]; by wall time, as simulated time may stand still.
SILENCE = 2.0
# One that comes more rarely has ended after this many of its periods, which count up to this length [s].
_PERIODS, _LONGEST_PERIOD = 3, 10.0


class Silence:
    """Whether an input is silent for at least a time [s]."""

    def __init__(self, least: float = SILENCE) -> None:
        self._least, self._period, self._newest = least, 0.0, -float('inf')

    def heard(self) -> None:
        """Take that something came."""
        now = time.monotonic()
        since = now - self._newest
        self._period, self._newest = 0.0 if since == float('inf') else min(since, _LONGEST_PERIOD), now

    @property
    def lasts(self) -> bool:
        """Whether the input has ended, or has not begun."""
        return time.monotonic() - self._newest > max(self._least, _PERIODS * self._period)


class InputEnd:
    """Calls a function once whenever an input has ended, in a thread of its own.

    Args:
        ended: is called; `heard` waits for it, so that what it publishes comes before what the next message brings.
        silence: see `SILENCE` [s].
    """

    def __init__(self, ended: Callable[[], None], silence: float = SILENCE) -> None:
        self._ended, self._silence = ended, Silence(silence)
        self._lock, self._has_ended = threading.Lock(), True
        repeat(self._check, 'input end', silence / 10)

    def heard(self) -> None:
        """Take that something came."""
        with self._lock:
            self._silence.heard()
            self._has_ended = False

    def _check(self) -> None:
        with self._lock:
            if not self._has_ended and self._silence.lasts:
                self._has_ended = True
                self._ended()
