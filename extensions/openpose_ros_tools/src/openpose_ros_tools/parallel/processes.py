"""Tasks in processes of their own, some at a time; one whose process dies begins anew."""
import logging
import multiprocessing
import os
import signal
import threading
from collections import Counter, deque
from contextlib import contextmanager, suppress
from multiprocessing import connection, resource_tracker
from typing import Any, Callable, Dict, Generator, Iterator, List, Mapping, Tuple, Union

from openpose_ros_pkg.errors import OpenposeRosError

_log = logging.getLogger(__name__)

# Number of processes that may end on the same task before it is given up.
_MOST_TRIES = 3
RETRIES = 1
"""Number of further tries of a task that failed."""
_CONTEXT = multiprocessing.get_context('spawn')  # a fork would copy locks of threads and the state of the networks


class ProcessLostError(OpenposeRosError):
    """Several processes ended on the same task."""


def run_in_processes(work: Callable[[Any], Any], tasks: Mapping[str, Any], workers: int
                     ) -> Generator[Tuple[str, Union[Any, Exception]], None, None]:
    """Have processes do tasks; yield the name of each task with its result or error, as they end.

    A task that failed is tried again, `RETRIES` times. An OpenposeRosError and an OSError are those of the task, others
    become a RuntimeError. Closing the generator ends the processes at once.

    Args:
        work: function that can be pickled; gets a task.
        tasks: by unique names.
        workers: number of processes at a time.
    """
    waiting = deque(tasks)
    ended: Dict[str, int] = Counter()  # processes, by task
    running: Dict[Any, Tuple[str, Any]] = {}  # name and process, by pipe

    def start() -> None:
        while waiting and len(running) < workers:
            name = waiting.popleft()
            pipe, end = _CONTEXT.Pipe(duplex=False)
            process = _CONTEXT.Process(target=_serve, args=(end, work, tasks[name]), daemon=True)
            with no_interrupts():  # this process ends the new one, not the terminal
                process.start()
            running[pipe] = name, process
            end.close()  # the new process has it alone, so that it ends with that

    try:
        start()
        while running:
            ready: List[Any] = connection.wait(list(running))
            for pipe in ready:
                name, process = running.pop(pipe)
                try:
                    outcome = pipe.recv()
                except (EOFError, OSError):
                    ended[name] += 1
                    outcome = ProcessLostError(f'{ended[name]} processes ended one after the other on the same task')
                process.join()
                begins_anew = isinstance(outcome, ProcessLostError) and ended[name] < _MOST_TRIES
                if begins_anew:
                    _log.warning('the process of %s has ended; another one takes its place', name)
                    waiting.appendleft(name)
                start()
                if not begins_anew:
                    yield name, outcome
    finally:
        for _, process in running.values():
            process.kill()
            process.join()


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


def _serve(pipe: Any, work: Callable[[Any], Any], task: Any) -> None:
    """Send the result of a task, or its error."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    outcome = _outcome(work, task)
    with suppress(ConnectionError):  # nothing waits for it any more
        try:
            pipe.send(outcome)
        except ConnectionError:
            raise
        except Exception as error:  # the value can not be pickled, which raises errors of many kinds
            pipe.send(RuntimeError(f'the result of a process can not be sent: {error!r}'))


def _outcome(work: Callable[[Any], Any], task: Any) -> Any:
    for _ in range(RETRIES):
        with suppress(Exception):
            return work(task)
    try:
        return work(task)
    except (OpenposeRosError, OSError) as error:
        return error
    except Exception as error:  # not every error can be sent
        return RuntimeError(f'in a process: {error!r}')


def _end_with_parent() -> None:
    """End this process when its parent has ended, even if that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
