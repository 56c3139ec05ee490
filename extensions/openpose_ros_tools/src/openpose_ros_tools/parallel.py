"""Work in threads, in processes, and on clusters."""
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import closing, contextmanager
from itertools import repeat
from typing import Any, Callable, Deque, Dict, Generator, Iterable, Iterator, List, Mapping, Optional, Tuple, TypeVar

from openpose_ros_pkg.errors import OpenposeRosError, ParameterError

Item = TypeVar('Item')
Result = TypeVar('Result')
# Reading and writing images mostly releases Python's lock; with more than four threads it becomes the bottleneck.
_MOST_THREADS = 4
_CONNECT_SECONDS = 20  # longest wait for the answer of a scheduler, and for its first worker
_TRIES = 2  # of a task alone, after processes died
_END: Any = object()


class WorkerLostError(OpenposeRosError):
    """Processes died on a task, or the cluster is gone."""


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

    The task of a process that died is done again. What is under way beside it dies with it; these tasks are then done
    one by one, and the one that ends its process again is an error.

    Args:
        work: gets a task; can be pickled.
        tasks: by unique names.
        workers: number of processes at a time.
        scheduler: address of an existing cluster of Dask distributed, whose workers do it instead.

    Raises:
        ParameterError: Dask distributed is not installed, no scheduler answers, or it has no workers.
    """
    waiting = deque(tasks)
    if scheduler:
        gone = WorkerLostError(f'the scheduler at {scheduler} is gone')
        with _cluster(scheduler) as client:
            # with more than one for each thread, a worker may queue tasks while another idles
            threads = max(sum(client.nthreads().values()), 1)
            for name, outcome in _outcomes(client.get_executor(pure=False), work, tasks, waiting, threads):
                yield name, gone if isinstance(outcome, CancelledError) else outcome
        yield from ((name, gone) for name in waiting)
        return
    while waiting:
        lost: List[str] = []
        with _processes(workers) as executor:
            for name, outcome in _outcomes(executor, work, tasks, waiting, workers):
                if isinstance(outcome, BrokenExecutor):
                    lost.append(name)
                else:
                    yield name, outcome
        for name in lost:
            result: Any = None
            for _ in range(_TRIES):
                with _processes(1) as executor:
                    (_, result), = _outcomes(executor, work, tasks, deque([name]), 1)
                if not isinstance(result, BrokenExecutor):
                    break
            yield name, (WorkerLostError(f'its process died, alone {_TRIES} times')
                         if isinstance(result, BrokenExecutor) else result)


def _outcomes(executor: Executor, work: Callable[[Any], Any], tasks: Mapping[str, Any], waiting: Deque[str],
              at_once: int) -> Iterator[Tuple[str, Any]]:
    """Do the tasks of the names that wait; where the executor breaks, the names that were not begun stay there."""
    running: Dict[Future[Any], str] = {}
    is_broken = False

    def submit() -> None:
        nonlocal is_broken
        while waiting and len(running) < at_once and not is_broken:
            try:
                running[executor.submit(work, tasks[waiting[0]])] = waiting[0]
                waiting.popleft()
            except BrokenExecutor:
                is_broken = True

    submit()
    while running:
        future = next(iter(wait(running, return_when=FIRST_COMPLETED).done))
        name, error = running.pop(future), CancelledError() if future.cancelled() else future.exception()
        is_broken = is_broken or isinstance(error, (BrokenExecutor, CancelledError))
        submit()  # before what was done is used
        yield name, future.result() if error is None else error


@contextmanager
def _processes(workers: int) -> Iterator[Executor]:
    # a fork would copy locks of threads and the state of the networks
    executor = ProcessPoolExecutor(workers, multiprocessing.get_context('spawn'), _begin, (os.getpid(),))
    try:
        yield executor
    finally:
        for process in multiprocessing.active_children():
            process.kill()
        executor.shutdown()


def _begin(parent: int) -> None:
    """Leave Ctrl-C to the parent, and end with it, even if it was killed."""
    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _cluster(address: str) -> Iterator[Any]:
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
        yield client
