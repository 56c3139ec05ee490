"""Stages in threads of their own: the long stage never waits for the short ones."""
import time
from collections import deque
from dataclasses import dataclass
from statistics import median
from typing import Callable, Deque, Generic, Optional, TypeVar

import numpy as np

from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.stream.fair_lock import FairLock
from openpose_ros_pkg.stream.worker import Worker

Item = TypeVar('Item')
Prepared = TypeVar('Prepared')
Computed = TypeVar('Computed')
Finished = TypeVar('Finished')


@dataclass(frozen=True)
class PipelineConstants:
    """When the next item is prepared."""

    most_computed: int = constant(
        2, 'Maximum number of computed items that wait for the last stage; computing waits beyond it.')
    remembered: int = constant(
        8, 'Durations of each stage and arrivals from which the end of computing and the next item are predicted.')
    margin: float = constant(
        0.003, 'Preparation begins earlier by this than its longest duration needs, as threads wake late.', unit='s')


PIPELINE = PipelineConstants()


@dataclass(frozen=True)
class PipelineStages(Generic[Item, Prepared, Computed, Finished]):
    """The stages of a pipeline."""

    prepare: Callable[[Item], Prepared]  # called with the newest item
    compute: Callable[[Prepared], Computed]  # the long stage, called with the pipeline's lock held
    finish: Callable[[Computed], Finished]
    # called with the pipeline's lock held and the newest item, once that is finished or another one comes; the second
    # argument tells whether the lock is wanted for another item within a time [s]
    search: Optional[Callable[[Computed, Callable[[float], bool]], object]] = None
    # called with what `finish` returned; the search does not wait for it, the next `finish` does
    follow_up: Callable[[Finished], object] = lambda finished: None


class Pipeline(Generic[Item, Prepared, Computed, Finished]):
    """Prepares the newest item and finishes the last one while the one between is computed; in idle time it searches.

    Of the items that wait for a stage, only the newest is kept. Preparing begins only when computing is expected to end
    soon: the next item that is computed is the newest, and no item is prepared to be replaced. Results come in the
    order of the items.

    Args:
        on_error: called with any exception of a stage, whose item is dropped.
        lock: shared with others that compute.
        lead: time that another process works on what `prepare` has sent until it can be computed [s]. Preparing begins
            earlier by this, and an item that was sent is always computed. 0: `prepare` does all.

    Attributes:
        replaced: number of items that a newer one replaced before they were computed.
    """

    def __init__(self, stages: PipelineStages[Item, Prepared, Computed, Finished],
                 on_error: Callable[[Exception], None], lock: FairLock, lead: float = 0.0,
                 constants: PipelineConstants = PIPELINE) -> None:
        self._stages = stages
        self._lock, self._lead, self._constants = lock, lead, constants
        self.replaced = 0
        self._submitted: Deque[Item] = deque(maxlen=1)
        self._prepared: Deque[Prepared] = deque(maxlen=1)
        self._computed: Deque[Computed] = deque()
        self._arrivals: Deque[float] = deque(maxlen=constants.remembered)  # times of the newest items [s]
        self._preparing = False
        self._unsearched: Optional[Computed] = None  # the newest computed item
        self._finished: Optional[Computed] = None  # the newest finished item
        self._prepare_from = -float('inf')
        self._prepare_seconds: Deque[float] = deque(maxlen=constants.remembered)
        self._compute_seconds: Deque[float] = deque(maxlen=constants.remembered)
        self._worker = Worker({'prepare': self._prepare_next, 'compute': self._compute_next,
                               'finish': self._finish_next}, on_error)
        self._changed = self._worker.condition
        self._worker.start()

    def submit(self, item: Item) -> None:
        """Give the pipeline a new item; return at once."""
        with self._changed:
            self.replaced += len(self._submitted)
            self._arrivals.append(time.monotonic())
            self._submitted.append(item)
            self._changed.notify_all()

    def stop(self) -> None:
        """Let the stages finish their items, drop what waits and end the threads."""
        self._worker.stop()

    def _prepare_next(self) -> bool:
        with self._changed:
            while not self._worker.stopped and not (self._may_prepare() and self._too_early() <= 0):
                self._changed.wait(self._too_early() if self._may_prepare() else None)
            if self._worker.stopped:
                return False
            item = self._submitted.popleft()
            self._preparing = True
        begin = time.monotonic()
        try:
            prepared = self._stages.prepare(item)
        except Exception:
            with self._changed:
                self._preparing = False
            raise
        with self._changed:
            self._preparing = False
            self._prepare_seconds.append(time.monotonic() - begin)
            self.replaced += len(self._prepared)
            self._prepared.append(prepared)
            self._changed.notify_all()
        return True

    def _compute_next(self) -> bool:
        with self._changed:
            self._changed.wait_for(lambda: self._worker.stopped or self._may_compute() or self._may_search())
            if self._worker.stopped:
                return False
        self._lock.acquire(self._may_compute)
        try:
            self._search()
            if not self._may_compute():
                return True
            computed = self._compute()
        finally:
            self._lock.release()
        with self._changed:
            self._computed.append(computed)
            self._unsearched = computed
            self._changed.notify_all()
        return True

    def _compute(self) -> Computed:
        # Taken only now: a newer item may have come while the lock was held elsewhere.
        begin = time.monotonic()
        with self._changed:
            prepared = self._prepared.popleft()
            self._prepare_from = (begin + self._expected_seconds() - max(self._prepare_seconds) - self._lead
                                  - self._constants.margin)
            self._changed.notify_all()
        try:
            return self._stages.compute(prepared)
        finally:
            with self._changed:
                self._compute_seconds.append(time.monotonic() - begin)
                self._prepare_from = begin
                self._changed.notify_all()

    def _search(self) -> None:
        with self._changed:
            unsearched, self._unsearched = self._unsearched, None
        if unsearched is not None and self._stages.search is not None:
            self._stages.search(unsearched, self._wanted)

    def _finish_next(self) -> bool:
        with self._changed:
            self._changed.wait_for(lambda: self._worker.stopped or self._computed)
            if self._worker.stopped:
                return False
            computed = self._computed.popleft()
            self._changed.notify_all()
        try:
            finished = self._stages.finish(computed)
        finally:
            with self._changed:
                self._finished = computed
                self._changed.notify_all()
        self._stages.follow_up(finished)
        return True

    def _wanted(self, seconds: float) -> bool:
        """Return whether an item waits or, as items come regularly, will come within a time [s]."""
        with self._changed:
            if self._worker.stopped or self._lock.wanted or self._submitted or self._preparing or self._prepared:
                return True
            if len(self._arrivals) < 2:
                return False
            since, period = time.monotonic() - self._arrivals[-1], median(np.diff(list(self._arrivals)))
            return since < 2 * period and since + seconds > period

    def _may_compute(self) -> bool:
        return bool(self._prepared) and len(self._computed) < self._constants.most_computed

    def _may_search(self) -> bool:
        return self._unsearched is not None and self._unsearched is self._finished

    def _may_prepare(self) -> bool:
        return bool(self._submitted) and not (self._lead and self._prepared)

    def _expected_seconds(self) -> float:
        """Return the lower quartile of the durations of computing [s]: preparing too late costs more than too early."""
        return sorted(self._compute_seconds)[len(self._compute_seconds) // 4] if self._compute_seconds else 0.0

    def _too_early(self) -> float:
        """Return how long preparing still has to wait [s]."""
        return self._prepare_from - time.monotonic()
