"""Pair two streams by stamp: takes the place of message_filters.ApproximateTimeSynchronizer.

That one pairs wrongly when frames drop, since it takes the first pair within its slop, and calls back while holding
its lock, so that an exception in the callback stops it for good.
"""
import threading
from typing import Any, Callable, Tuple

from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.stream.pairing import PairingParams, StampMatcher

# What /diagnostics calls messages of each input that found no partner.
_ALONE = ('images without a partner', 'points without a partner')


class StampSynchronizer:
    """Pairs images and points, messages with a header, of the same moment.

    Args:
        params: slop and queue size.
        health: counts what can not be paired.
        callback: called with (first, second) for every pair.
    """

    def __init__(self, params: PairingParams, health: Health, callback: Callable[[Any, Any], None]) -> None:
        self._matcher = StampMatcher(params)
        self._lock = threading.Lock()
        self._health = health
        self._callback = callback
        self.received = (0, 0)
        """Messages with a stamp that came on each input."""
        self.pairs = 0
        """Pairs that were found."""

    @property
    def slop(self) -> float:
        """Largest difference of stamps that pairs at present [s]."""
        return self._matcher.slop

    def add_first(self, message: Any) -> None:
        """Take an image."""
        self._add(message, 0)

    def add_second(self, message: Any) -> None:
        """Take points."""
        self._add(message, 1)

    def _counts(self) -> Tuple[int, ...]:
        return (self._matcher.resets, self._matcher.out_of_order, *self._matcher.unpaired)

    def _add(self, message: Any, stream: int) -> None:
        stamp = message.header.stamp
        if stamp.is_zero():
            self._health.warn('stamp 0', f'a {message._type} has no stamp and can not be paired: the driver has to '
                                         'fill header.stamp')
            return
        with self._lock:
            before = self._counts()
            pair = self._matcher.add(stream, stamp.to_nsec(), message)
            jumped, stale, *alone = (now - then for now, then in zip(self._counts(), before))
            self.received = (self.received[0] + (stream == 0), self.received[1] + (stream == 1))
            self.pairs += pair is not None
        for event, number in zip(_ALONE, alone):
            if number:
                self._health.count(event, number)
        if stale:
            self._health.warn('stamp not newer', f'a {message._type} of {stamp.to_sec():.3f} s is as old as the one '
                                                 'before it, or older; it is not used')
        if jumped:
            self._health.warn('time jumped back', f'a {message._type} is older than those before it: a bag that began '
                                                  'again? Waiting messages are forgotten')
        if pair is not None:
            # outside the lock: whatever the callback does, the other stream goes on
            self._callback(*pair)
