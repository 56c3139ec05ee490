"""The end of an input is noticed once, and again after more came."""
import threading
import time

from openpose_ros_signals.ros.input_end import InputEnd

SILENCE, TIMEOUT = 0.3, 30.0


class Ends:
    """Counts the ends of an input; the first one raises."""

    def __init__(self):
        self.count, self._changed = 0, threading.Condition()
        self.input = InputEnd(self._ended, SILENCE)

    def _ended(self):
        with self._changed:
            self.count += 1
            self._changed.notify()
        if self.count == 1:
            raise OSError('first')

    def come(self, number, timeout=TIMEOUT):
        """Return whether the input has ended so often, or does so within a time [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: self.count >= number, timeout)


def test_each_end_is_noticed_once_also_after_one_failed():
    """An input of a long period has not ended between its messages, but for the first one."""
    ends = Ends()
    assert ends.input.has_ended  # it has not begun
    begin = time.monotonic()
    ends.input.heard()
    assert not ends.input.has_ended
    assert ends.come(1) and time.monotonic() - begin > SILENCE
    for _ in range(3):
        ends.input.heard()
        assert not ends.come(2, 2 * SILENCE)
    assert ends.come(2) and not ends.come(3, 2 * SILENCE)
