"""Three stages in threads of their own, so that the long one never waits for the short ones around it."""
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import Callable, Deque, Generic, TypeVar

from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.stream.fair_lock import FairLock

Item = TypeVar('Item')
Prepared = TypeVar('Prepared')
Computed = TypeVar('Computed')


@dataclass(frozen=True)
class PipelineConstants:
    """When the next item is prepared."""

    most_computed: int = constant(
        2, 'Computed items that may wait for the last stage; with more, computing waits, so that memory is bounded.')
    remembered: int = constant(8, 'Durations of each stage that are kept to foresee when the next item must be ready.')
    margin: float = constant(
        0.003, 'Preparation begins earlier by this than its usual duration needs, as threads do not wake at once.',
        unit='s')


PIPELINE = PipelineConstants()


class Pipeline(Generic[Item, Prepared, Computed]):
    """Prepares the newest item and finishes the last one while the one between is computed.

    The newest item wins: of those that wait for a stage, the older is dropped. Preparing begins only when computing is
    expected to end soon. So the item that is computed next is the newest there is, and no work is done for items that
    would be replaced before their turn, which would slow the computation down. Results come in the order of the items.

    Args:
        prepare: first stage, called with the newest item.
        compute: the long stage, called with what `prepare` returned, with `lock` held.
        finish: last stage, called with what `compute` returned.
        on_error: called with any exception of a stage; its item is dropped and the next one follows.
        lock: for the computation, to be shared with others who compute.
        lead: how long elsewhere goes on with what `prepare` has sent there until it is ready to be computed [s]:
            preparing begins earlier by this, and what was sent is computed in any case, as it can not be called back.
            0: `prepare` does all.
    """

    def __init__(self, prepare: Callable[[Item], Prepared], compute: Callable[[Prepared], Computed],
                 finish: Callable[[Computed], object], on_error: Callable[[Exception], None], lock: FairLock,
                 lead: float = 0.0) -> None:
        self._prepare, self._compute, self._finish, self._on_error = prepare, compute, finish, on_error
        self._lock, self._lead = lock, lead
        self.replaced = 0
        """Items that a newer one replaced before they were computed."""
        self._stopped = False
        self._submitted: Deque[Item] = deque(maxlen=1)
        self._prepared: Deque[Prepared] = deque(maxlen=1)
        self._computed: Deque[Computed] = deque()
        self._prepare_from = -float('inf')
        self._prepare_seconds: Deque[float] = deque(maxlen=PIPELINE.remembered)
        self._compute_seconds: Deque[float] = deque(maxlen=PIPELINE.remembered)
        mutex = threading.Lock()
        self._to_prepare, self._to_compute, self._to_finish = (threading.Condition(mutex) for _ in range(3))
        self._threads = [threading.Thread(target=self._until_stopped, args=(run,), name=run.__name__, daemon=True)
                         for run in (self._prepare_next, self._compute_next, self._finish_next)]
        for thread in self._threads:
            thread.start()

    def submit(self, item: Item) -> None:
        """Give the pipeline a new item; return at once."""
        with self._to_prepare:
            self.replaced += len(self._submitted)
            self._submitted.append(item)
            self._to_prepare.notify()

    def stop(self) -> None:
        """Let the stages finish their items, drop what waits and end the threads."""
        with self._to_prepare:
            self._stopped = True
            for condition in (self._to_prepare, self._to_compute, self._to_finish):
                condition.notify_all()
        for thread in self._threads:
            thread.join()

    def _until_stopped(self, run: Callable[[], None]) -> None:
        while not self._stopped:
            try:
                run()
            except Exception as error:  # an error of one item must not end the threads
                with suppress(Exception):  # nor may what tells of it
                    self._on_error(error)

    def _prepare_next(self) -> None:
        with self._to_prepare:
            while not self._stopped and not (self._may_prepare() and self._too_early() <= 0):
                self._to_prepare.wait(self._too_early() if self._may_prepare() else None)
            if self._stopped:
                return
            item = self._submitted.popleft()
        begin = time.monotonic()
        prepared = self._prepare(item)
        with self._to_compute:
            self._prepare_seconds.append(time.monotonic() - begin)
            self.replaced += len(self._prepared)
            self._prepared.append(prepared)
            self._to_compute.notify()

    def _compute_next(self) -> None:
        with self._to_compute:
            self._to_compute.wait_for(lambda: self._stopped or (
                self._prepared and len(self._computed) < PIPELINE.most_computed))
        if self._stopped:
            return
        with self._lock:
            # taken only now: while the lock was held elsewhere, a newer item may have come
            begin = time.monotonic()
            with self._to_prepare:
                prepared = self._prepared.popleft()
                self._prepare_from = (begin + self._expected_seconds() - max(self._prepare_seconds) - self._lead
                                      - PIPELINE.margin)
                self._to_prepare.notify()
            try:
                computed = self._compute(prepared)
            finally:
                with self._to_prepare:
                    self._compute_seconds.append(time.monotonic() - begin)
                    self._prepare_from = begin
                    self._to_prepare.notify()
        with self._to_finish:
            self._computed.append(computed)
            self._to_finish.notify()

    def _finish_next(self) -> None:
        with self._to_finish:
            self._to_finish.wait_for(lambda: self._stopped or self._computed)
            if self._stopped:
                return
            computed = self._computed.popleft()
            self._to_compute.notify()
        self._finish(computed)

    def _may_prepare(self) -> bool:
        return bool(self._submitted) and not (self._lead and self._prepared)

    def _expected_seconds(self) -> float:
        """Return what computing takes if it is quick, by the lower quartile: to be early is cheap, late is not [s]."""
        return sorted(self._compute_seconds)[len(self._compute_seconds) // 4] if self._compute_seconds else 0.0

    def _too_early(self) -> float:
        """Return how long preparing still has to wait [s]."""
        return self._prepare_from - time.monotonic()
