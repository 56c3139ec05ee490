"""Pair two streams by stamp: a message filter in the place of message_filters.ApproximateTimeSynchronizer.

That one pairs wrongly when frames drop, since it takes the first pair within its slop, and calls back while holding
its lock, so that an exception in the callback stops it for good.
"""
import math
import threading
import time
from typing import Any, Optional, Sequence, Tuple

import message_filters

from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.input_watch import PATIENCE, InputWatch
from openpose_ros_pkg.stream.pairing import PairingParams, StampMatcher, pairing_report


class StampSynchronizer(message_filters.SimpleFilter):
    """Passes on pairs of images and points, messages with a header, of the same moment.

    Callbacks are called with (image, points), by the thread that brought the later of the two, with no lock held.

    Args:
        inputs: two filters, that of the images and that of the points: whatever has registerCallback.
        params: slop and queue size; None: the defaults.
        health: counts what can not be paired; None: one for this filter alone.
        names: what /diagnostics calls messages of each input that found no partner.

    Attributes:
        pairs: number of pairs that were found.
    """

    def __init__(self, inputs: Sequence[Any], params: Optional[PairingParams] = None,
                 health: Optional[Health] = None, names: Tuple[str, str] = ('images', 'points')) -> None:
        super().__init__()
        self._matcher = StampMatcher(params or PairingParams())
        self._lock = threading.Lock()
        self._unpaired_events = [f'{name} without a partner' for name in names]
        self._health = health or Health()
        self.pairs = 0
        self._arrivals = [-math.inf, -math.inf]  # newest message of each input since the last pair
        self._unpaired_since = math.inf
        self.connectInput(inputs)

    def connectInput(self, inputs: Sequence[Any]) -> None:  # noqa: N802 - as other message filters call it
        """Take messages of two more filters, that of the images and that of the points."""
        for stream, source in enumerate(inputs):
            source.registerCallback(self._add, stream)

    def watch_pairs(self, watch: InputWatch, inputs: Sequence[InputSubscriber], setting: str) -> None:
        """Have it told when messages of these inputs come but do not pair; `setting`: see `PairingReport.text`."""
        names = [source.resolved_name for source in inputs]

        def pairs_nothing() -> bool:
            """Tell whether both inputs came for a while without a pair: lately, or there never was one."""
            now = time.monotonic()
            return (all(source.subscribed for source in inputs) and now - self._unpaired_since >= PATIENCE
                    and (self.pairs == 0 or now - min(self._arrivals) < PATIENCE))

        def why() -> str:
            with self._lock:
                report = pairing_report(self._matcher)
            return f'stamps of {" and ".join(names)} jump' if report is None else report.text(names, setting)

        watch.add('no pairs', pairs_nothing, why)

    def _add(self, message: Any, stream: int) -> None:
        stamp, matcher = message.header.stamp, self._matcher
        if stamp.is_zero():
            self._health.warn('stamp 0', f'a {message._type} has no stamp and can not be paired: the driver has to '
                                         'fill header.stamp')
            return
        with self._lock:
            before = (matcher.resets, matcher.out_of_order, *matcher.unpaired)
            pair = matcher.add(stream, stamp.to_nsec(), message)
            after = (matcher.resets, matcher.out_of_order, *matcher.unpaired)
            self.pairs += pair is not None
            self._note_arrival(stream, pair is not None)
        jumped, stale, *unpaired = (now - then for now, then in zip(after, before))
        for event, number in zip(self._unpaired_events, unpaired):
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
            self._arrivals, self._unpaired_since = [-math.inf, -math.inf], math.inf
            return
        self._arrivals[stream] = now = time.monotonic()
        if self._unpaired_since == math.inf and min(self._arrivals) > -math.inf:
            self._unpaired_since = now
