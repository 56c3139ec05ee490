"""Search of images after their people were returned, in a thread of its own."""
from typing import Callable, Dict, Generic, Hashable, TypeVar

from openpose_ros_pkg.stream.fair_lock import FairLock
from openpose_ros_pkg.stream.worker import Worker

Computed = TypeVar('Computed')


class LaterSearch(Generic[Computed]):
    """Searches the newest computed image of each camera until another thread wants the lock.

    Args:
        search: called with the lock held; its second argument tells whether another thread waits for
            it to return.
        lock: of those that compute.
        on_error: called with any exception of `search`.
    """

    def __init__(self, search: Callable[[Computed, Callable[[float], bool]], object], lock: FairLock,
                 on_error: Callable[[Exception], object]) -> None:
        self._search, self._lock = search, lock
        self._waiting: Dict[Hashable, Computed] = {}  # by camera, the longest wait first
        self._worker = Worker({'search': self._search_next}, on_error)
        self._worker.start()

    def submit(self, camera: Hashable, computed: Computed) -> None:
        """Give the newest computed image of a camera; return at once."""
        with self._worker.condition:
            self._waiting[camera] = computed
            self._worker.condition.notify_all()

    def stop(self) -> None:
        """Let a search end, and begin none any more."""
        self._worker.stop()

    def _search_next(self) -> bool:
        with self._worker.condition:
            self._worker.condition.wait_for(lambda: self._worker.stopped or self._waiting)
            if self._worker.stopped:
                return False
        self._lock.acquire(urgent=lambda: False)
        try:
            with self._worker.condition:
                if self._worker.stopped:
                    return False
                computed = self._waiting.pop(next(iter(self._waiting)))
            self._search(computed, lambda seconds: self._worker.stopped or self._lock.wanted)
        finally:
            self._lock.release()
        return True
