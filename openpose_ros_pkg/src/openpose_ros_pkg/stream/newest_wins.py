"""One worker thread that always works on the newest item: old frames are dropped, never new ones."""
import threading
from contextlib import suppress
from typing import Any, Callable, Optional


class NewestWinsWorker:
    """Hand items from callbacks to a thread of their own, keeping only the newest one that waits.

    Args:
        work: called in the worker thread with the newest item.
        on_error: called in the worker thread with any exception of `work`; the worker goes on.
        name: of the thread.
    """

    def __init__(self, work: Callable[[Any], None], on_error: Callable[[Exception], None], name: str) -> None:
        self._work = work
        self._on_error = on_error
        self._condition = threading.Condition()
        self._item: Optional[Any] = None
        self._stopped = False
        self.replaced = 0
        """Items that a newer one replaced before the worker took them."""
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, item: Any) -> None:
        """Give the worker a new item; return at once."""
        with self._condition:
            self.replaced += self._item is not None
            self._item = item
            self._condition.notify()

    def stop(self) -> None:
        """Let the current item finish, forget the waiting one and end the thread."""
        with self._condition:
            self._stopped = True
            self._condition.notify()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._stopped or self._item is not None)
                if self._stopped:
                    return
                item, self._item = self._item, None
            try:
                self._work(item)
            except Exception as error:  # an error of one frame must not end the thread
                with suppress(Exception):  # nor may what tells of it
                    self._on_error(error)
