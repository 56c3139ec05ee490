"""The one scheduler of frames: a thread that takes the newest frame of each camera, and searches while none waits."""
import time
from collections import deque
from concurrent.futures import Future
from dataclasses import dataclass, field
from statistics import median
from typing import Any, Callable, Deque, Dict, Hashable, Iterator, NamedTuple, Optional

import numpy as np

from openpose_ros_pkg.detect.detection import NextPart
from openpose_ros_pkg.errors import StoppedError
from openpose_ros_pkg.stream.worker import Worker

Handle = Callable[[Any], Optional[Iterator[Optional[NextPart]]]]
"""Computes and publishes an item, and returns its search, if any: each yield is what comes next; None: nothing long."""


ARRIVALS = 8  # newest arrivals of a camera whose median interval tells when the next frame comes
LATE = 2.0  # intervals without a frame after which none is expected any more


class Taken(NamedTuple):
    """An item whose turn has come, and what handles it."""

    item: Any
    handle: Handle
    answer: 'Optional[Future[Any]]' = None


@dataclass
class _Source:
    arrivals: Deque[float] = field(default_factory=lambda: deque(maxlen=ARRIVALS))  # [s]
    waiting: Optional[Taken] = None


class FrameQueue:
    """What waits for the networks: the newest item of each camera, and requests, none of which is dropped.

    Not thread-safe, and without a clock: all times [s] are arguments.
    """

    def __init__(self) -> None:
        self._sources: Dict[Hashable, _Source] = {}  # the one whose item was taken longest ago first
        self._requests: Deque[Taken] = deque()
        self._request_is_next = True

    @property
    def waits(self) -> bool:
        """Whether an item waits."""
        return bool(self._requests) or any(source.waiting is not None for source in self._sources.values())

    def submit(self, camera: Hashable, item: Taken, now: float) -> bool:
        """Add the newest item of a camera; return whether it replaces one that was not taken."""
        source = self._sources.setdefault(camera, _Source())
        replaces, source.waiting = source.waiting is not None, item
        source.arrivals.append(now)
        return replaces

    def request(self, item: Taken) -> None:
        """Add an item that is not dropped."""
        self._requests.append(item)

    def take(self) -> Optional[Taken]:
        """Return the item whose turn it is: requests and cameras take turns; None: none waits."""
        camera = next((one for one, source in self._sources.items() if source.waiting is not None), None)
        if self._requests and (self._request_is_next or camera is None):
            self._request_is_next = False
            return self._requests.popleft()
        if camera is None:
            return None
        self._request_is_next = True
        source = self._sources.pop(camera)
        self._sources[camera], item, source.waiting = source, source.waiting, None
        return item

    def goes_on(self, part: Optional[NextPart], now: float) -> bool:
        """Return whether a search goes on with a part: no item waits, or is expected before its end; or it is owed."""
        if part is None or part.owed:
            return part is not None or not self.waits
        return not self.waits and not any(self._comes_within(source, part.seconds, now)
                                          for source in self._sources.values())

    def _comes_within(self, source: _Source, seconds: float, now: float) -> bool:
        if len(source.arrivals) < 2:
            return False
        since, interval = now - source.arrivals[-1], median(np.diff(list(source.arrivals)))
        return since < LATE * interval and since + seconds > interval


class FrameLoop:
    """A thread that handles one item after the other: it publishes, then searches until the next item comes.

    Args:
        on_error: called with any exception of an item that is no request; the loop goes on.
        name: of the thread.
    """

    def __init__(self, on_error: Callable[[Exception], object], clock: Callable[[], float] = time.monotonic,
                 name: str = 'frames') -> None:
        self._queue, self._clock = FrameQueue(), clock
        self._worker = Worker(name, self._step, on_error)
        self._changed = self._worker.condition
        self._worker.start()

    def submit(self, camera: Hashable, item: Any, handle: Handle) -> bool:
        """Give the newest item of a camera; return at once, whether it replaces one that was not computed."""
        with self._changed:
            self._changed.notify_all()
            return self._queue.submit(camera, Taken(item, handle), self._clock())

    def request(self, item: Any, handle: Callable[[Any, 'Future[Any]'], Optional[Iterator[Optional[NextPart]]]]) -> Any:
        """Return what `handle` sets as the result of an item, raise what it raises; waits for its turn.

        Raises:
            StoppedError: the loop was stopped.
        """
        answer: Future = Future()
        with self._changed:
            if self._worker.stopped:
                raise StoppedError('the node is shutting down')
            self._queue.request(Taken(item, lambda one: handle(one, answer), answer))
            self._changed.notify_all()
        return answer.result()

    def call(self, action: Callable[[], Any]) -> Any:
        """Return what an action returns that is done between two items, such as other parameters."""
        return self.request(None, lambda _, answer: answer.set_result(action()))

    def stop(self) -> None:
        """Let the item in progress end, begin none any more, and end the thread."""
        self._worker.stop()
        for taken in iter(self._queue.take, None):
            if taken.answer is not None:
                taken.answer.set_exception(StoppedError('the node is shutting down'))

    def _step(self) -> bool:
        with self._changed:
            self._changed.wait_for(lambda: self._worker.stopped or self._queue.waits)
            if self._worker.stopped:
                return False
            taken = self._queue.take()
        if taken is not None:
            self._handle(taken)
        return True

    def _handle(self, taken: Taken) -> None:
        try:
            for part in taken.handle(taken.item) or ():
                with self._changed:
                    if self._worker.stopped or not self._queue.goes_on(part, self._clock()):
                        break
        except Exception as error:
            if taken.answer is None or taken.answer.done():
                raise
            taken.answer.set_exception(error)


class NewestWinsWorker:
    """Hands items from callbacks to a thread; of the items that wait, only the newest is kept.

    Args:
        work: called in the worker thread with the newest item.
        on_error: called in the worker thread with any exception of `work`; the worker goes on.
        name: of the thread.

    Attributes:
        replaced: number of items that a newer one replaced before the worker took them.
    """

    def __init__(self, work: Callable[[Any], None], on_error: Callable[[Exception], object], name: str) -> None:
        self._work, self._loop, self.replaced = work, FrameLoop(on_error, name=name), 0

    def submit(self, item: Any) -> None:
        """Give the worker a new item; return at once."""
        self.replaced += self._loop.submit('', item, self._work)

    def stop(self) -> None:
        """Let the current item finish, drop the waiting one and end the thread."""
        self._loop.stop()
