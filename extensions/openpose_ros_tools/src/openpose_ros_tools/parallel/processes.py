"""Futures of calls in processes; a process that dies is replaced, and its call begins anew.

Not ProcessPoolExecutor, which never ends if its process dies while a call is sent to it (before Python 3.12,
github.com/python/cpython/issues/94777).
"""
import logging
import multiprocessing
import os
import queue
import signal
import threading
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from typing import Any, Callable, Generator, Iterator, Mapping, Optional, Tuple, Union

from openpose_ros_pkg.errors import OpenposeRosError

_log = logging.getLogger(__name__)

# Number of processes that may end on the same call before it is given up.
_MOST_TRIES = 3
RETRIES = 1
"""Number of further tries of a task that failed."""


class ProcessLostError(OpenposeRosError):
    """Several processes ended on the same call."""


class ProcessPool:
    """A number of processes; use it as a context manager. Leaving it ends them at once, whatever they do."""

    def __init__(self, number: int) -> None:
        self._processes = [_Process() for _ in range(number)]
        self._idle: queue.SimpleQueue[_Process] = queue.SimpleQueue()
        for process in self._processes:
            self._idle.put(process)
        self._threads = ThreadPoolExecutor(number, 'process')

    def submit(self, function: Callable[..., Any], *arguments: Any) -> 'Future[Any]':
        """Start function(*arguments) in the next idle process; function, arguments and result can be pickled.

        The result raises the function's OpenposeRosError and OSError, RuntimeError for its other errors,
        ProcessLostError after several processes died, and CancelledError when the pool is left.
        """
        return self._threads.submit(self._call, function, arguments)

    def __enter__(self) -> 'ProcessPool':
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            process.close()
        self._threads.shutdown()

    def _call(self, function: Callable[..., Any], arguments: Tuple[Any, ...]) -> Any:
        process = self._idle.get()
        try:
            return process.call(function, arguments)
        finally:
            self._idle.put(process)


def run_in_processes(work: Callable[[Any], Any], tasks: Mapping[str, Any], workers: int
                     ) -> Generator[Tuple[str, Union[Any, Exception]], None, None]:
    """Have processes do tasks; yield the name of each task with its result or error, as they end.

    A task that failed is tried again, `RETRIES` times. Closing the generator ends the processes at once.

    Args:
        work: function that can be pickled; gets a task.
        tasks: by unique names.
        workers: number of processes; each does one task at a time.
    """
    with ProcessPool(min(workers, len(tasks))) as pool:
        futures = {pool.submit(_with_retries, work, task): name for name, task in tasks.items()}
        for future in as_completed(futures):
            error = future.exception()
            yield futures[future], future.result() if error is None else error


def _with_retries(work: Callable[[Any], Any], task: Any) -> Any:
    for _ in range(RETRIES):
        with suppress(Exception):
            return work(task)
    return work(task)


@contextmanager
def no_interrupts() -> Iterator[None]:
    """Block Ctrl-C for good in processes that are started in this block: the terminal sends it to all of them.

    They inherit the blocked signal, so that it holds from their first moment on.
    """
    resource_tracker.ensure_running()  # else the first process starts it, which unblocks the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Process:
    """One process, and those that take its place. Calls go through a pipe, which ends when the process has ended."""

    def __init__(self) -> None:
        self._closed = False
        self._lock = threading.Lock()  # held while a process is started or ended
        self._start()

    def call(self, function: Callable[..., Any], arguments: Tuple[Any, ...]) -> Any:
        """See `ProcessPool.submit`."""
        for _ in range(_MOST_TRIES):
            try:
                self._pipe.send((function, arguments))
                value, error = self._pipe.recv()
            except (EOFError, ConnectionError):
                self._start()
                _log.warning('a process has ended; another one has taken its place')
                continue
            if error is not None:
                raise error
            return value
        raise ProcessLostError(f'{_MOST_TRIES} processes ended one after the other on the same task')

    def close(self) -> None:
        """End the process at once."""
        with self._lock:
            self._closed = True
            self._process.kill()
        self._process.join()

    def _start(self) -> None:
        # spawned: a fork would copy locks of threads and the state of the networks
        context = multiprocessing.get_context('spawn')
        with self._lock:
            if self._closed:
                raise CancelledError
            self._pipe, end = context.Pipe()
            self._process = context.Process(target=_serve, args=(end,), daemon=True)
            with no_interrupts():  # this process ends the new one, not the terminal
                self._process.start()
            end.close()  # the new process has it alone, so that it ends with that


def _serve(pipe: Connection) -> None:
    """Answer calls with value and error until the other end of the pipe is closed."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(EOFError, ConnectionError):
        while True:
            answer = _answer(*pipe.recv())
            try:
                pipe.send(answer)
            except ConnectionError:
                raise
            except Exception as error:  # the value can not be pickled, which raises errors of many kinds
                pipe.send((None, RuntimeError(f'the result of a process can not be sent: {error!r}')))


def _end_with_parent() -> None:
    """End this process when its parent has ended, even if that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _answer(function: Callable[..., Any], arguments: Tuple[Any, ...]) -> Tuple[Any, Optional[Exception]]:
    try:
        return function(*arguments), None
    except (OpenposeRosError, OSError) as error:
        return None, error
    except Exception as error:  # not every error can be sent
        return None, RuntimeError(f'in a process: {error!r}')
