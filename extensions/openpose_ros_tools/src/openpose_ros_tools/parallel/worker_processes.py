"""Processes that do one call at a time; one that dies is replaced, and its call begins anew."""
import atexit
import logging
import multiprocessing
import os
import queue
import threading
from concurrent.futures import CancelledError
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, Callable, List, NamedTuple, Optional, Tuple

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
        atexit.register(self.close)  # else the end of the program waits for processes that were not closed

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
        atexit.unregister(self.close)
        for process in self._processes:
            process.close()


def tell_progress(share: float) -> None:
    """Tell the process that called the function how much of it is done, 0 to 1."""
    _own_progress.value = share


class _WorkerProcess:
    """One process, and those that take its place. Calls go through a pipe, which ends when the process has ended."""

    def __init__(self, prepare: Optional[Callable[..., None]], arguments: Tuple[Any, ...]) -> None:
        self._prepare = (prepare, arguments)
        self._closed = False
        self._lock = threading.Lock()  # held while a process is started or ended
        self._start()

    @property
    def pid(self) -> int:
        """Id of the process."""
        return self._process.pid  # type: ignore[return-value]  # it has been started

    def call(self, function: Callable[..., Any], arguments: Tuple[Any, ...],
             on_progress: Optional[Callable[[float], None]]) -> Any:
        """See `WorkerProcesses.call`."""
        for _ in range(_MOST_TRIES):
            answer = self._answer(function, arguments, on_progress)
            if answer is not None:
                if answer.error is not None:
                    raise answer.error
                return answer.value
            if self._closed:
                raise CancelledError
            _log.warning('a process has ended; another one takes its place')
            self._start()
        raise ProcessLostError(f'{_MOST_TRIES} processes ended one after the other on the same task')

    def _answer(self, function: Callable[..., Any], arguments: Tuple[Any, ...],
                on_progress: Optional[Callable[[float], None]]) -> Optional['_Answer']:
        """Return what the process answers; None if it has ended."""
        self._progress.value = 0.0
        try:
            self._pipe.send((function, arguments))
            while on_progress is not None and not self._pipe.poll(_PROGRESS_PERIOD):
                on_progress(self._progress.value)
            answer: _Answer = self._pipe.recv()
            return answer
        except (EOFError, ConnectionError):
            return None

    def close(self) -> None:
        """End the process at once; what it does is not needed."""
        with self._lock:
            self._closed = True
            self._process.kill()
        self._process.join()

    def _start(self) -> None:
        # spawned: a fork would copy locks of threads and the state of the networks
        context = multiprocessing.get_context('spawn')
        with self._lock:
            if self._closed:
                return
            self._progress = context.RawValue('d')  # without a lock, which a process that dies could hold
            self._pipe, end = context.Pipe()
            self._process = context.Process(target=_serve, args=(end, self._progress, *self._prepare))
            with no_interrupts():  # this process ends the new one, not the terminal
                self._process.start()
            end.close()  # the new process has it alone, so that it ends with that


class _Answer(NamedTuple):
    """What a process answers to a call: a value or an error."""

    value: Any
    error: Optional[Exception]


# In a worker process: the share that is done, which the parent reads.
_own_progress: Any


def _serve(pipe: Connection, progress: Any, prepare: Optional[Callable[..., None]], arguments: Tuple[Any, ...]) -> None:
    """Answer calls until the other end of the pipe is closed."""
    global _own_progress
    _own_progress = progress
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if prepare is not None:
        prepare(*arguments)
    with suppress(EOFError, ConnectionError):
        while True:
            answer = _do(*pipe.recv())
            try:
                pipe.send(answer)
            except ConnectionError:
                raise
            except Exception as error:  # the value can not be pickled, which raises errors of many kinds
                pipe.send(_Answer(None, RuntimeError(f'the result of a process can not be sent: {error!r}')))


def _end_with_parent() -> None:
    """End this process when its parent has ended, even if that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _do(function: Callable[..., Any], arguments: Tuple[Any, ...]) -> _Answer:
    try:
        return _Answer(function(*arguments), None)
    except (OpenposeRosError, OSError) as error:
        return _Answer(None, error)
    except Exception as error:  # not every error can be sent
        return _Answer(None, RuntimeError(f'in a process: {error!r}'))
