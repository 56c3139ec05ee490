"""A worker thread that always works on the newest item."""
from typing import Any, Callable

from openpose_ros_pkg.stream.frame_loop import FrameLoop


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
