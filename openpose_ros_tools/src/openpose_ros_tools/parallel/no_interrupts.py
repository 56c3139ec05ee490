"""Ctrl-C for a program with processes: the terminal sends it to all of them, but one alone has to end them."""
import signal
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Iterator


@contextmanager
def no_interrupts() -> Iterator[None]:
    """Have the threads and processes that are started in this block never see a Ctrl-C; this thread sees it after it.

    What is blocked is inherited, so that it holds from the first moment on, before a new process can ask for anything.
    """
    resource_tracker.ensure_running()  # else the first process starts it, which unblocks the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
