"""The end of an input, for topics whose readers keep each list of people until the next one comes."""
import math
import threading
import time
from typing import Callable, Optional

# An input from which nothing came for this long has ended [s]; by wall time, as simulated time may stand still.
SILENCE = 2.0
# One that comes more rarely has ended after this many of its periods, which count up to this length [s].
_PERIODS, _LONGEST_PERIOD = 3, 10.0


class InputEnd:
    """Calls a function once whenever an input has ended, in a thread of its own.

    Args:
        ended: is called; `heard` waits for it, so that what it publishes comes before what the next message brings.
        on_error: called with any exception of `ended`; the thread goes on.
        silence: see `SILENCE` [s].
    """

    def __init__(self, ended: Callable[[], None], on_error: Callable[[Exception], None], silence: float = SILENCE
                 ) -> None:
        self._ended, self._on_error, self._silence = ended, on_error, silence
        self._lock = threading.Lock()
        self._last: Optional[float] = None
        self._newest, self._period = -math.inf, 0.0
        threading.Thread(target=self._watch, name='input end', daemon=True).start()

    def heard(self) -> None:
        """Take that something came."""
        with self._lock:
            now = time.monotonic()
            self._period = min(now - self._newest, _LONGEST_PERIOD) if self._newest > -math.inf else 0.0
            self._last = self._newest = now

    @property
    def silent(self) -> bool:
        """Whether the input has ended, or has not begun."""
        last = self._last
        return last is None or time.monotonic() - last > max(self._silence, _PERIODS * self._period)

    def _watch(self) -> None:
        while True:
            time.sleep(self._silence / 10)
            with self._lock:
                if self._last is None or not self.silent:
                    continue
                self._last = None
                try:
                    self._ended()
                except Exception as error:  # what fails once must not end the thread
                    self._on_error(error)
