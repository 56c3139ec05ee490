"""The end of an input is noticed once, and again after more came."""
import threading
import time

from openpose_ros_signals.ros.input_end import InputEnd, Silence

SILENCE, TIMEOUT = 0.3, 30.0


class Ends:
    """Counts the ends of an input; the first one raises."""

    def __init__(self):
        self.times, self._changed = [], threading.Condition()
        self.input = InputEnd(self._ended, SILENCE)

    def _ended(self):
        with self._changed:
            self.times.append(time.monotonic())
            self._changed.notify()
        if len(self.times) == 1:
            raise OSError('first')

    def come(self, number, timeout=TIMEOUT):
        """Return whether the input has ended so often, or does so within a time [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: len(self.times) >= number, timeout)


def test_each_end_is_noticed_once_also_after_one_failed():
    ends = Ends()
    for number in (1, 2):
        begin = time.monotonic()
        ends.input.heard()
        assert ends.come(number) and ends.times[-1] - begin > SILENCE
    assert not ends.come(3, 2 * SILENCE)


def test_an_input_of_a_long_period_has_not_ended_between_its_messages():
    """But for the first one, after which the period is not known."""
    ends = Ends()
    ends.input.heard()
    assert ends.come(1)
    for _ in range(3):
        ends.input.heard()
        assert not ends.come(2, 2 * SILENCE)
    assert ends.come(2)


def test_silence():
    silence = Silence(SILENCE)
    assert silence.lasts  # it has not begun
    silence.heard()
    assert not silence.lasts
