"""Pair two streams by stamp: a message filter in the place of message_filters.ApproximateTimeSynchronizer.

That one pairs wrongly when frames drop, since it takes the first pair within its slop, and calls back while holding
its lock, so that an exception in the callback stops it for good.
"""
import math
import threading
import time
from typing import Any, List, Optional, Sequence, Tuple

import message_filters

from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.input_watch import PATIENCE, InputWatch
from openpose_ros_pkg.stream.pairing import PairingParams, StampMatcher
from openpose_ros_pkg.stream.pairing_report import pairing_report


class StampSynchronizer(message_filters.SimpleFilter):
    """Passes on pairs of images and points, messages with a header, of the same moment.

    Callbacks are called with (image, points), by the thread that brought the later of the two, with no lock held: one
    that takes its time or fails does not stop the other input.

    Args:
        inputs: two filters, that of the images and that of the points: whatever has registerCallback.
        params: slop and queue size; None: the defaults.
        health: counts what can not be paired; None: one for this filter alone.
        names: what /diagnostics calls messages of each input that found no partner.
    """

    def __init__(self, inputs: Sequence[Any], params: Optional[PairingParams] = None,
                 health: Optional[Health] = None, names: Tuple[str, str] = ('images', 'points')) -> None:
        super().__init__()
        self._matcher = StampMatcher(params or PairingParams())
        self._lock = threading.Lock()
        self._alone = [f'{name} without a partner' for name in names]
        self._health = health or Health()
        self.received = (0, 0)
        """Messages with a stamp that came on each input."""
        self.pairs = 0
        """Pairs that were found."""
        self._came: List[float] = [-math.inf, -math.inf]  # newest message of each input since the last pair
        self._unpaired_since = math.inf
        self.connectInput(inputs)

    def connectInput(self, inputs: Sequence[Any]) -> None:  # noqa: N802 - as other message filters call it
        """Take messages of two more filters, that of the images and that of the points."""
        images, points = inputs
        images.registerCallback(self._add, 0)
        points.registerCallback(self._add, 1)

    def watch_pairs(self, watch: InputWatch, inputs: Sequence[InputSubscriber], setting: str) -> None:
        """Have it told when messages come on both inputs but do not pair.

        Args:
            inputs: from which the messages come.
            setting: how the user sets slop and queue size, see `PairingReport.text`.
        """
        names = [source.resolved_name for source in inputs]
        watch.add('no pairs', lambda: self._pairs_nothing() and all(source.subscribed for source in inputs),
                  lambda: self._why_unpaired(names, setting))

    def _pairs_nothing(self) -> bool:
        """Tell whether both inputs came for a while without a pair: lately, or there never was one."""
        now = time.monotonic()
        return now - self._unpaired_since >= PATIENCE and (self.pairs == 0 or now - min(self._came) < PATIENCE)

    def _why_unpaired(self, names: Sequence[str], setting: str) -> str:
        with self._lock:
            report = pairing_report(self._matcher)
        return f'stamps of {" and ".join(names)} jump' if report is None else report.text(names, setting)

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
            self._note_arrival(stream, pair is not None)
        for event, number in zip(self._alone, alone):
            if number:
                self._health.count(event, number)
        if stale:
            self._health.warn('stamp not newer', f'a {message._type} of {stamp.to_sec():.3f} s is as old as the one '
                                                 'before it, or older; it is not used')
        if jumped:
            self._health.warn('time jumped back', f'a {message._type} is older than those before it: a bag that began '
                                                  'again? Waiting messages are forgotten')
        if pair is not None:
            self.signalMessage(*pair)

    def _note_arrival(self, stream: int, pairs: bool) -> None:
        if pairs:
            self._came, self._unpaired_since = [-math.inf, -math.inf], math.inf
            return
        self._came[stream] = now = time.monotonic()
        if self._unpaired_since == math.inf and min(self._came) > -math.inf:
            self._unpaired_since = now
