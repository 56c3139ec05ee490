"""A lock that threads get in the order in which they asked for it."""
import threading
from collections import deque
from typing import Deque


class FairLock:
    """Mutual exclusion, first come, first served; for `with`.

    `threading.Lock` promises no order: a thread that releases it and asks again at once mostly gets it again, while
    others wait. Here the lock is handed to the one that has waited longest, so that several who use it over and over
    take turns.
    """

    def __init__(self) -> None:
        self._mutex = threading.Lock()
        self._held = False
        self._waiting: Deque[threading.Event] = deque()

    def acquire(self) -> None:
        """Wait for the lock, behind those who wait already."""
        with self._mutex:
            if not self._held:
                self._held = True
                return
            turn = threading.Event()
            self._waiting.append(turn)
        turn.wait()

    def release(self) -> None:
        """Hand the lock to the one that has waited longest.

        Raises:
            RuntimeError: nobody holds it.
        """
        with self._mutex:
            if not self._held:
                raise RuntimeError('release of a lock that is not held')
            if self._waiting:
                self._waiting.popleft().set()
            else:
                self._held = False

    def __enter__(self) -> 'FairLock':
        self.acquire()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()
