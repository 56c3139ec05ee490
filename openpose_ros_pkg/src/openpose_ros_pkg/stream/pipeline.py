"""Three stages in threads of their own, so that the long one never waits for the short ones around it."""
import threading
import time
from collections import deque
from typing import Any, Callable, Deque, Optional

from openpose_ros_pkg.stream.fair_lock import FairLock

# Finished computations that may wait for the last stage; with more, computing waits, so that memory is bounded.
_MOST_COMPUTED = 2
# Durations of the stages that are remembered to foresee when the next item has to be ready.
_REMEMBERED = 8
# Preparation begins this long before it has to, beyond its usual duration [s]: threads do not wake to the microsecond.
_MARGIN = 0.003


class Pipeline:
    """Prepares the newest item and finishes the last one while the one between is computed.

    The newest item wins: of those that wait for a stage, the older is dropped. Preparing begins only when computing is
    expected to end soon. So the item that is computed next is the newest there is, and no work is done for items that
    would be replaced before their turn, which would slow the computation down. Results come in the order of the items.

    Args:
        prepare: first stage, called with each item it gets to. It notes its result in the item, as the others do.
        compute: the long stage, called with `lock` held.
        finish: last stage.
        on_error: called with any exception of a stage; its item is dropped and the next one follows.
        lock: for the computation, to be shared with others who compute.
    """

    def __init__(self, prepare: Callable[[Any], None], compute: Callable[[Any], None], finish: Callable[[Any], None],
                 on_error: Callable[[Exception], None], lock: FairLock) -> None:
        self._stages = (prepare, compute, finish)
        self._on_error = on_error
        self._lock = lock
        self.replaced = 0
        """Items that a newer one replaced before they were computed."""
        self._stopped = False
        self._submitted: Optional[Any] = None
        self._prepared: Optional[Any] = None
        self._computed: Deque[Any] = deque()
        self._prepare_from = -float('inf')
        self._prepare_seconds: Deque[float] = deque(maxlen=_REMEMBERED)
        self._compute_seconds: Deque[float] = deque(maxlen=_REMEMBERED)
        mutex = threading.Lock()
        self._to_prepare, self._to_compute, self._to_finish = (threading.Condition(mutex) for _ in range(3))
        self._threads = [threading.Thread(target=run, name=name, daemon=True) for name, run in (
            ('prepare', self._run_prepare), ('compute', self._run_compute), ('finish', self._run_finish))]
        for thread in self._threads:
            thread.start()

    def submit(self, item: Any) -> None:
        """Give the pipeline a new item; return at once."""
        with self._to_prepare:
            self.replaced += self._submitted is not None
            self._submitted = item
            self._to_prepare.notify()

    def stop(self) -> None:
        """Let the stages end what they are at, forget the rest and end the threads."""
        with self._to_prepare:
            self._stopped = True
            for condition in (self._to_prepare, self._to_compute, self._to_finish):
                condition.notify_all()
        for thread in self._threads:
            thread.join()

    def _run_prepare(self) -> None:
        while True:
            with self._to_prepare:
                while not self._stopped and not (self._submitted is not None and self._too_early() <= 0):
                    self._to_prepare.wait(None if self._submitted is None else self._too_early())
                if self._stopped:
                    return
                item, self._submitted = self._submitted, None
            begin = time.monotonic()
            if not self._run(0, item):
                continue
            with self._to_compute:
                self._prepare_seconds.append(time.monotonic() - begin)
                self.replaced += self._prepared is not None
                self._prepared = item
                self._to_compute.notify()

    def _run_compute(self) -> None:
        while True:
            with self._to_compute:
                self._to_compute.wait_for(lambda: self._stopped or (self._prepared is not None
                                                                    and len(self._computed) < _MOST_COMPUTED))
            if self._stopped:
                return
            with self._lock:
                # taken only now: while the lock was held elsewhere, a newer item may have come
                begin = time.monotonic()
                with self._to_prepare:
                    item, self._prepared = self._prepared, None
                    self._prepare_from = begin + self._expected_seconds() - max(self._prepare_seconds) - _MARGIN
                succeeded = self._run(1, item)
            with self._to_finish:
                self._compute_seconds.append(time.monotonic() - begin)
                self._prepare_from = begin
                self._to_prepare.notify()
                if succeeded:
                    self._computed.append(item)
                    self._to_finish.notify()

    def _run_finish(self) -> None:
        while True:
            with self._to_finish:
                self._to_finish.wait_for(lambda: self._stopped or self._computed)
                if self._stopped:
                    return
                item = self._computed.popleft()
                self._to_compute.notify()
            self._run(2, item)

    def _expected_seconds(self) -> float:
        """Return what computing takes if it is quick, by the lower quartile: to be early is cheap, late is not [s]."""
        return sorted(self._compute_seconds)[len(self._compute_seconds) // 4] if self._compute_seconds else 0.0

    def _too_early(self) -> float:
        """Return how long preparing still has to wait [s]."""
        return self._prepare_from - time.monotonic()

    def _run(self, stage: int, item: Any) -> bool:
        """Return whether the stage succeeded."""
        try:
            self._stages[stage](item)
        except Exception as error:  # the threads must outlive whatever one item does to them
            self._on_error(error)
            return False
        return True
