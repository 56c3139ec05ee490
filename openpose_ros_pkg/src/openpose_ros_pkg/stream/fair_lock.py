"""A lock that threads get in the order in which they asked for it."""
import threading
from collections import deque
from typing import Callable, Deque, Tuple


class FairLock:
    """Mutual exclusion, first come, first served; for `with`.

    A thread that releases a `threading.Lock` and asks again mostly gets it again. This lock goes to the thread that has
    waited longest: threads that use it repeatedly take turns.
    """

    def __init__(self) -> None:
        self._mutex = threading.Lock()
        self._held = False
        self._waiting: Deque[Tuple[threading.Event, Callable[[], bool]]] = deque()

    def acquire(self, urgent: Callable[[], bool] = lambda: True) -> None:
        """Wait for the lock, behind all that wait already.

        Args:
            urgent: whether this thread is one for which `wanted` is true, asked while it waits.
        """
        with self._mutex:
            if not self._held:
                self._held = True
                return
            turn = threading.Event()
            self._waiting.append((turn, urgent))
        turn.wait()

    @property
    def wanted(self) -> bool:
        """Whether another thread waits for it that is urgent."""
        with self._mutex:
            waiting = [urgent for _, urgent in self._waiting]
        return any(urgent() for urgent in waiting)

    def release(self) -> None:
        """Hand the lock to the thread that has waited longest.

        Raises:
            RuntimeError: the lock is not held.
        """
        with self._mutex:
            if not self._held:
                raise RuntimeError('release of a lock that is not held')
            if self._waiting:
                self._waiting.popleft()[0].set()
            else:
                self._held = False

    def __enter__(self) -> None:
        self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()
