"""Ctrl-C for a program with processes: the terminal sends it to all of them, but only one has to end them."""
import signal
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Iterator


@contextmanager
def no_interrupts() -> Iterator[None]:
    """Block Ctrl-C for good in threads and processes that are started in this block; this thread gets it afterwards.

    They inherit the blocked signal, so that it holds from their first moment on.
    """
    resource_tracker.ensure_running()  # else the first process starts it, which unblocks the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
