"""A lock that threads get in the order in which they asked for it."""
import threading
from collections import deque
from typing import Deque


class FairLock:
    """Mutual exclusion, first come, first served; for `with`.

    A thread that releases a `threading.Lock` and asks again mostly gets it again. This lock goes to the thread that has
    waited longest: threads that use it repeatedly take turns.
    """

    def __init__(self) -> None:
        self._mutex = threading.Lock()
        self._held = False
        self._waiting: Deque[threading.Event] = deque()

    def acquire(self) -> None:
        """Wait for the lock, behind all that wait already."""
        with self._mutex:
            if not self._held:
                self._held = True
                return
            turn = threading.Event()
            self._waiting.append(turn)
        turn.wait()

    @property
    def wanted(self) -> bool:
        """Whether another thread waits for it."""
        return bool(self._waiting)

    def release(self) -> None:
        """Hand the lock to the thread that has waited longest.

        Raises:
            RuntimeError: the lock is not held.
        """
        with self._mutex:
            if not self._held:
                raise RuntimeError('release of a lock that is not held')
            if self._waiting:
                self._waiting.popleft().set()
            else:
                self._held = False

    def __enter__(self) -> None:
        self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()
