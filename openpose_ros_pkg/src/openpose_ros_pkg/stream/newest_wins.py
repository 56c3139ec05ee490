"""A worker thread that always works on the newest item."""
from typing import Any, Callable, Optional

from openpose_ros_pkg.stream.worker import Worker


class NewestWinsWorker:
    """Hands items from callbacks to a thread; of the items that wait, only the newest is kept.

    Args:
        work: called in the worker thread with the newest item.
        on_error: called in the worker thread with any exception of `work`; the worker goes on.
        name: of the thread.

    Attributes:
        replaced: number of items that a newer one replaced before the worker took them.
    """

    def __init__(self, work: Callable[[Any], None], on_error: Callable[[Exception], None], name: str) -> None:
        self._work = work
        self._item: Optional[Any] = None
        self.replaced = 0
        self._worker = Worker({name: self._step}, on_error)
        self._worker.start()

    def submit(self, item: Any) -> None:
        """Give the worker a new item; return at once."""
        with self._worker.condition:
            self.replaced += self._item is not None
            self._item = item
            self._worker.condition.notify()

    def stop(self) -> None:
        """Let the current item finish, drop the waiting one and end the thread."""
        self._worker.stop()

    def _step(self) -> bool:
        with self._worker.condition:
            self._worker.condition.wait_for(lambda: self._worker.stopped or self._item is not None)
            if self._worker.stopped:
                return False
            item, self._item = self._item, None
        self._work(item)
        return True
