"""Many tasks on a cluster: Dask distributed, on this machine by default."""
import asyncio
import logging
import shutil
import tempfile
import uuid
from collections import deque
from contextlib import ExitStack, contextmanager
from typing import Any, Callable, Dict, Generator, Iterator, Mapping, Tuple, Union

from openpose_ros_pkg.errors import OpenposeRosError, ParameterError
from openpose_ros_tools.parallel.no_interrupts import no_interrupts

# Longest wait for the answer of an existing scheduler, and for its first worker [s].
_CONNECT_SECONDS = 20
# Before Python 3.11 these are different classes; which one is raised depends on the version of distributed.
_TIMEOUTS = (TimeoutError, asyncio.TimeoutError)

Work = Callable[[Any, Callable[[float], None]], Any]


class ClusterError(OpenposeRosError):
    """There is no such cluster, or it has no workers."""


def run_tasks(work: Work, tasks: Mapping[str, Any], *, workers: int, scheduler: str, retries: int,
              on_progress: Callable[[str, float], None]) -> Generator[Tuple[str, Union[Any, Exception]], None, None]:
    """Have the workers of a cluster do tasks; yield the name of each task with its result or error, as they end.

    A worker that dies is replaced, and another one does its task from the beginning, until the scheduler blames the
    task (after three deaths, unless it is configured otherwise). Closing the generator ends the local cluster and its
    tasks, and cancels the tasks of another cluster.

    Args:
        work: function that can be pickled; gets a task, and a function to be called with the share that is done.
        tasks: by unique names.
        workers: number of processes of a cluster on this machine; each does one task at a time.
        scheduler: address of the scheduler of an existing cluster; empty: one on this machine.
        retries: number of further tries of a task that failed.
        on_progress: gets the name of a task and the share that is done, in another thread.

    Raises:
        ParameterError: Dask distributed is not installed.
        ClusterError: no scheduler answers, or it has no workers.
    """
    distributed = _distributed()
    with _connected(distributed, scheduler) if scheduler else _local(distributed, workers) as client:
        topic = f'progress-{uuid.uuid4()}'
        client.subscribe_topic(topic, lambda event: on_progress(*event[1]))
        futures: Dict[Any, str] = {}
        completed = distributed.as_completed()
        waiting = deque(tasks.items())

        def submit_tasks() -> None:
            """Submit one task per thread of the cluster; with more, one worker may queue tasks while another idles."""
            while waiting and len(futures) < max(sum(client.nthreads().values()), 1):
                name, task = waiting.popleft()
                # a unique key, as the scheduler would return an older result for the same one
                future = client.submit(_do, work, name, task, topic, key=f'{name}-{uuid.uuid4()}', retries=retries)
                futures[future] = name
                completed.add(future)

        submit_tasks()
        for future in completed:
            if future.cancelled():
                gone = ClusterError(f'the scheduler at {scheduler or "this machine"} is gone')
                yield from ((name, gone) for name in (*futures.values(), *(name for name, _ in waiting)))
                return
            error = future.exception()
            name, outcome = futures.pop(future), future.result() if error is None else error
            future.release()
            submit_tasks()
            yield name, outcome


def _distributed() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise ParameterError(f'several bags need Dask distributed ({error}): install python3-distributed, or give one '
                             'bag at a time') from error
    if not hasattr(distributed.Client, 'subscribe_topic'):
        raise ParameterError(f'several bags need Dask distributed 2021.11 or later, not {distributed.__version__}: '
                             "install it with `pip install 'distributed>=2021.11'`, or give one bag at a time")
    return distributed


def _do(work: Work, name: str, task: Any, topic: str) -> Any:
    """Do a task in a worker."""
    import distributed
    worker = distributed.get_worker()
    return work(task, lambda share: worker.log_event(topic, (name, share)))


@contextmanager
def _local(distributed: Any, workers: int) -> Iterator[Any]:
    folder = tempfile.mkdtemp(prefix='openpose_ros_tasks_')
    try:
        with ExitStack() as stack:
            with no_interrupts():  # this process ends the workers, not the terminal
                # no limit of memory: networks take much of it
                cluster = stack.enter_context(distributed.LocalCluster(
                    n_workers=workers, threads_per_worker=1, processes=True, memory_limit=0, dashboard_address=None,
                    local_directory=folder, silence_logs=logging.CRITICAL))
            yield stack.enter_context(distributed.Client(cluster))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _connected(distributed: Any, address: str) -> Iterator[Any]:
    try:
        client = distributed.Client(address, timeout=_CONNECT_SECONDS)
    except (OSError, ValueError, *_TIMEOUTS) as error:
        raise ClusterError(f'no scheduler answers at {address}: {error}') from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_CONNECT_SECONDS)
        except _TIMEOUTS as error:
            raise ClusterError(f'the scheduler at {address} has no workers') from error
        yield client
