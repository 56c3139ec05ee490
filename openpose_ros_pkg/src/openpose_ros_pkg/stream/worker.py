"""A thread that repeats a step until it is stopped."""
import threading
from contextlib import suppress
from typing import Callable


class Worker:
    """A daemon thread that repeats a step; an exception of the step does not end it.

    Args:
        step: waits for work with `condition` and does it; returns False when it is done: after `stop`, at once or when
            no work waits.
        on_error: called in the thread with an exception of the step; exceptions of its own are dropped.

    Attributes:
        condition: notified by `stop`, and by whatever changes what the step waits for.
        stopped: whether `stop` was called.
    """

    def __init__(self, name: str, step: Callable[[], bool], on_error: Callable[[Exception], object]) -> None:
        self.condition, self.stopped = threading.Condition(), False
        self._step, self._on_error = step, on_error
        self._thread = threading.Thread(target=self._repeat, name=name, daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Tell the step to end, and wait for the thread."""
        with self.condition:
            self.stopped = True
            self.condition.notify_all()
        self._thread.join()

    def _repeat(self) -> None:
        goes_on = True
        while goes_on:
            try:
                goes_on = self._step()
            except Exception as error:
                with suppress(Exception):
                    self._on_error(error)
