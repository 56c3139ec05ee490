"""Work in threads, in processes, and on clusters."""
import multiprocessing

# multiprocessing imports these late: in threads that begin processes at once, Python 3.9 finds them half imported
import multiprocessing.popen_spawn_posix
import multiprocessing.resource_tracker
import multiprocessing.synchronize
import os
import signal
import threading
import time
from collections import deque
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    as_completed,
    wait,
)
from contextlib import closing, contextmanager, suppress
from itertools import repeat
from typing import Any, Callable, Deque, Generator, Iterable, Iterator, List, Mapping, Optional, Tuple, TypeVar

from openpose_ros_pkg.errors import OpenposeRosError, ParameterError

Item = TypeVar('Item')
Result = TypeVar('Result')
# Reading and writing images mostly releases Python's lock; with more than four threads it becomes the bottleneck.
_MOST_THREADS = 4
_CONNECT_SECONDS = 20  # longest wait for the answer of a scheduler, and for its first worker
_TRIES = 2  # of a task whose process dies
_ENDING = 5.0  # time that processes have to end after SIGTERM [s]
_END: Any = object()


class WorkerLostError(OpenposeRosError):
    """The processes of a task died, or the cluster is gone."""


def ordered_map(function: Callable[[Item], Result], items: Iterable[Item], threads: Optional[int] = None,
                ahead: Optional[int] = None) -> Generator[Result, None, None]:
    """Yield function(item) of each item, in their order; close the generator to end the threads.

    Args:
        items: iterated in the caller's thread.
        threads: None: one per core, at most four.
        ahead: number of results that are computed before they are asked for; None: one per thread.
    """
    threads = threads or min(_MOST_THREADS, os.cpu_count() or 1)
    waiting: Deque[Future[Result]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for item in items:
                waiting.append(pool.submit(function, item))
                if len(waiting) > (threads if ahead is None else ahead):
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


def prefetched(items: Iterable[Item], ahead: int) -> Generator[Item, None, None]:
    """Yield the items, which another thread reads; close the generator to end it after the item that it is reading."""
    iterator = iter(items)
    with closing(ordered_map(lambda _: next(iterator, _END), repeat(None), 1, ahead)) as results:
        for item in results:
            if item is _END:
                return
            yield item


def run_tasks(work: Callable[[Any], Any], tasks: Mapping[str, Any], workers: int, scheduler: str = ''
              ) -> Generator[Tuple[str, Any], None, None]:
    """Yield the name of each task with its result or error, as they end; close the generator to end the workers.

    Each task has a process of its own; where that dies, the task is done again, once.

    Args:
        work: gets a task; can be pickled.
        tasks: by unique names.
        workers: number of processes at a time.
        scheduler: address of an existing cluster of Dask distributed, whose workers do it instead.

    Raises:
        ParameterError: Dask distributed is not installed, no scheduler answers, or it has no workers.
    """
    with _cluster(scheduler) if scheduler else _processes(workers) as submit:
        names = {submit(work, task): name for name, task in tasks.items()}
        for future in as_completed(names):
            try:
                yield names[future], future.result()
            except CancelledError:
                yield names[future], WorkerLostError(f'the scheduler at {scheduler} is gone')
            except Exception as error:  # of the task
                yield names[future], error


Submit = Callable[[Callable[[Any], Any], Any], 'Future[Any]']


@contextmanager
def _processes(workers: int) -> Iterator[Submit]:
    """Yield what does a task in a process of its own."""
    closed = threading.Event()
    running: List[Future[Any]] = []
    threads = ThreadPoolExecutor(workers)

    def submit(work: Callable[[Any], Any], task: Any) -> 'Future[Any]':
        running.append(threads.submit(_in_a_process, work, task, closed))
        return running[-1]

    try:
        yield submit
    finally:
        closed.set()
        for future in running:
            future.cancel()
        end = time.monotonic() + _ENDING
        while wait(running, 0.1).not_done:
            for process in multiprocessing.active_children():
                (process.terminate if time.monotonic() < end else process.kill)()
        threads.shutdown()


def _in_a_process(work: Callable[[Any], Any], task: Any, closed: threading.Event) -> Any:
    for _ in range(_TRIES):
        # spawn: a fork would copy locks of threads and the state of the networks. KeyboardInterrupt comes of a process
        # that was ended by SIGTERM, as this is no main thread
        with suppress(BrokenExecutor, KeyboardInterrupt), ProcessPoolExecutor(
                1, multiprocessing.get_context('spawn'), _begin, (os.getpid(),)) as process:
            return process.submit(work, task).result()
        if closed.is_set():
            break
    raise WorkerLostError(f'its process died {_TRIES} times')


def _begin(parent: int) -> None:
    """Leave Ctrl-C to the parent, which ends this process by SIGTERM; end with it, even if it was killed."""
    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _interrupt)
    threading.Thread(target=watch, daemon=True).start()


def _interrupt(number: int, _: object) -> None:
    signal.signal(number, signal.SIG_IGN)  # it is sent until the process has ended
    raise KeyboardInterrupt(number)


@contextmanager
def _cluster(address: str) -> Iterator[Submit]:
    try:
        import distributed
        connect: Any = distributed.Client
    except ImportError as error:
        raise ParameterError(f'--scheduler needs Dask distributed ({error}): install python3-distributed') from error
    try:
        client = connect(address, timeout=_CONNECT_SECONDS)
        client.wait_for_workers(1, timeout=_CONNECT_SECONDS)
    except Exception as error:  # of many kinds, by the version of distributed
        raise ParameterError(f'--scheduler {address}: no cluster with workers answers ({error})') from error
    with client:
        yield client.get_executor(pure=False).submit
