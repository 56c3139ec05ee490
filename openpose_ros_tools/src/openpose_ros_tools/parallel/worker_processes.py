"""Processes that do one call at a time; one that dies is replaced, and its call begins anew."""
import concurrent.futures
import logging
import multiprocessing
import os
import queue
import signal
import threading
from concurrent.futures import CancelledError, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from typing import Any, Callable, List, Optional, Tuple

from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_tools.parallel.no_interrupts import no_interrupts

_log = logging.getLogger(__name__)

# Number of processes that may end on the same call before it is given up.
_MOST_TRIES = 3
# Period in which the progress of a call is read [s].
_PROGRESS_PERIOD = 0.5


class ProcessLostError(OpenposeRosError):
    """Several processes ended on the same call."""


class WorkerProcesses:
    """A number of processes. Any thread may call; `close` them at the end.

    Args:
        number: of processes.
        prepare: called first in every process, with `arguments`; both can be pickled.
    """

    def __init__(self, number: int, prepare: Optional[Callable[..., None]] = None, arguments: Tuple[Any, ...] = ()
                 ) -> None:
        self._processes = [_WorkerProcess(prepare, arguments) for _ in range(number)]
        self._idle: queue.SimpleQueue[_WorkerProcess] = queue.SimpleQueue()
        for process in self._processes:
            self._idle.put(process)

    def call(self, function: Callable[..., Any], *arguments: Any,
             on_progress: Optional[Callable[[float], None]] = None) -> Any:
        """Return function(*arguments) as an idle process gives it; waits for one.

        Args:
            function: can be pickled, like arguments and result; may call `tell_progress`.
            on_progress: gets what it told last, from time to time.

        Raises:
            OpenposeRosError, OSError: the function raised it.
            RuntimeError: it raised something else.
            ProcessLostError: several processes ended one after the other.
            CancelledError: the processes were ended.
        """
        process = self._idle.get()
        try:
            return process.call(function, arguments, on_progress)
        finally:
            self._idle.put(process)

    def pids(self) -> List[int]:
        """Return the ids of the present processes."""
        return [process.pid for process in self._processes]

    def close(self) -> None:
        """End the processes at once; what they do is not needed."""
        for process in self._processes:
            process.close()


def tell_progress(share: float) -> None:
    """Tell the process that called the function how much of it is done, 0 to 1."""
    _own_progress.value = share


class _WorkerProcess:
    """One process, and those that take its place."""

    def __init__(self, prepare: Optional[Callable[..., None]], arguments: Tuple[Any, ...]) -> None:
        self._prepare = (prepare, arguments)
        self._closed = False
        self._start()

    @property
    def pid(self) -> int:
        """Id of the process."""
        return self._pid.result()

    def call(self, function: Callable[..., Any], arguments: Tuple[Any, ...],
             on_progress: Optional[Callable[[float], None]]) -> Any:
        """See `WorkerProcesses.call`."""
        for _ in range(_MOST_TRIES):
            if self._closed:
                raise CancelledError
            self._progress.value = 0.0
            try:
                answer = self._executor.submit(_do, function, arguments)
                while on_progress is not None and concurrent.futures.wait([answer], _PROGRESS_PERIOD).not_done:
                    on_progress(self._progress.value)
                return answer.result()
            except BrokenProcessPool:
                if self._closed:
                    raise CancelledError from None
                _log.warning('a process has ended; another one takes its place')
                self._reader.close()
                self._start()
        raise ProcessLostError(f'{_MOST_TRIES} processes ended one after the other on the same task')

    def close(self) -> None:
        """End the process at once; what it does is not needed."""
        self._closed = True
        with suppress(BrokenProcessPool, ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)
        self._reader.close()
        self._executor.shutdown()

    def _start(self) -> None:
        # spawned: a fork would copy locks of threads and the state of the networks
        context = multiprocessing.get_context('spawn')
        self._progress = context.RawValue('d')  # without a lock, which a process that dies could hold
        self._executor = ProcessPoolExecutor(1, context, _begin, (self._progress, *self._prepare))
        # Closed when the process is dead: else what is written to it, as an image, waits for ever (gh-94777 of Python)
        self._reader = self._executor._call_queue._reader  # type: ignore[attr-defined]
        with no_interrupts():  # this process ends the new one, not the terminal
            self._pid = self._executor.submit(os.getpid)
        if self._closed:  # in the meantime, by another thread, which knew only the process before
            self.close()


# In a worker process: the share that is done, which the parent reads.
_own_progress: Any


def _begin(progress: Any, prepare: Optional[Callable[..., None]], arguments: Tuple[Any, ...]) -> None:
    global _own_progress
    _own_progress = progress
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if prepare is not None:
        prepare(*arguments)


def _end_with_parent() -> None:
    """End this process when its parent has ended, even if that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _do(function: Callable[..., Any], arguments: Tuple[Any, ...]) -> Any:
    try:
        return function(*arguments)
    except (OpenposeRosError, OSError):
        raise
    except Exception as error:  # not every error can be sent
        raise RuntimeError(f'in a process: {error!r}') from None
