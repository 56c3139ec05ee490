"""Threads that repeat their steps until they are stopped."""
import threading
from contextlib import suppress
from typing import Callable, Mapping


class Worker:
    """Daemon threads that share a condition; an exception of a step ends no thread.

    Args:
        steps: by the thread's name. Each step waits for work with `condition` and does it; it returns False when it is
            done: after `stop`, at once or when no work waits.
        on_error: called in the thread with an exception of a step; exceptions of its own are dropped.

    Attributes:
        condition: notified by `stop`, and by whatever changes what a step waits for.
        stopped: whether `stop` was called.
    """

    def __init__(self, steps: Mapping[str, Callable[[], bool]], on_error: Callable[[Exception], object]) -> None:
        self.condition = threading.Condition()
        self.stopped = False
        self._on_error = on_error
        self._threads = [threading.Thread(target=self._repeat, args=(step,), name=name, daemon=True)
                         for name, step in steps.items()]

    def start(self) -> None:
        """Start the threads."""
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Tell the steps to end, and wait for the threads."""
        with self.condition:
            self.stopped = True
            self.condition.notify_all()
        for thread in self._threads:
            thread.join()

    def _repeat(self, step: Callable[[], bool]) -> None:
        goes_on = True
        while goes_on:
            try:
                goes_on = step()
            except Exception as error:
                with suppress(Exception):
                    self._on_error(error)
