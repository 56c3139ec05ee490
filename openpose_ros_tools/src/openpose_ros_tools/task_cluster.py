"""Many pieces of work on a cluster: Dask distributed, on this machine by default."""
import logging
import shutil
import signal
import tempfile
import uuid
from contextlib import ExitStack, contextmanager
from typing import Any, Callable, Dict, Iterator, Mapping, Tuple, Union

from openpose_ros_pkg.errors import OpenposeRosError, ParameterError

# How long to wait for a scheduler that is to be there already, and for its first worker [s].
_CONNECT_SECONDS = 20


Work = Callable[[Any, Callable[[float], None]], Any]


class ClusterError(OpenposeRosError):
    """There is no such cluster, or nobody works in it."""


def run_tasks(work: Work, tasks: Mapping[str, Any], *, workers: int, scheduler: str, retries: int,
              on_progress: Callable[[str, float], None]) -> Iterator[Tuple[str, Union[Any, Exception]]]:
    """Have work done by the workers of a cluster; yield the name of each task with its result or error, as they end.

    A worker that dies is replaced, and another one does its task from the beginning, until the scheduler blames the
    task (after three deaths, unless it is configured otherwise). Leaving the iteration ends the
    local cluster and what it is at, and takes the rest back from any other one.

    Args:
        work: function that can be pickled; gets a task, and a function to be called with the share that is done.
        tasks: by names that differ.
        workers: number of processes of a cluster on this machine; each does one task at a time.
        scheduler: address of the scheduler of an existing cluster; empty: one on this machine.
        retries: how often a task that failed is tried again.
        on_progress: gets the name of a task and the share that is done, in another thread.

    Raises:
        ParameterError: Dask distributed is not installed.
        ClusterError: no scheduler answers, or it has no workers.
    """
    try:
        import distributed
    except ImportError as error:
        raise ParameterError(f'several bags need Dask distributed, 2021.11 or later ({error}): install '
                             'python3-distributed, or give one bag at a time') from error
    with ExitStack() as stack:
        if scheduler:
            client = stack.enter_context(_connected(distributed, scheduler))
        else:
            client = stack.enter_context(_local(distributed, workers))
        topic = f'progress-{uuid.uuid4()}'
        client.subscribe_topic(topic, lambda event: on_progress(*event[1]))
        futures: Dict[Any, str] = {}
        for name, task in tasks.items():
            # a key of its own, as the scheduler would give an older result for the same one
            future = client.submit(_do, work, name, task, topic, not scheduler, key=f'{name}-{uuid.uuid4()}',
                                   retries=retries)
            futures[future] = name
        for future in distributed.as_completed(futures):
            error = future.exception()
            yield futures.pop(future), future.result() if error is None else error
            future.release()


def _do(work: Work, name: str, task: Any, topic: str, is_local: bool) -> Any:
    """Do a task in a worker."""
    import distributed
    worker = distributed.get_worker()
    if is_local:
        # Ctrl-C reaches the whole group; it is for the process that has the cluster to end it. Handlers can be set in
        # the main thread alone, which is where the worker's loop runs.
        worker.loop.add_callback(signal.signal, signal.SIGINT, signal.SIG_IGN)
    return work(task, lambda share: worker.log_event(topic, (name, share)))


@contextmanager
def _local(distributed: Any, workers: int) -> Iterator[Any]:
    folder = tempfile.mkdtemp(prefix='openpose_ros_tasks_')
    try:
        # no limit of memory: a worker would be ended for what the networks take
        with distributed.LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, memory_limit=0, dashboard_address=None,
                local_directory=folder, silence_logs=logging.ERROR) as cluster, distributed.Client(cluster) as client:
            yield client
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _connected(distributed: Any, address: str) -> Iterator[Any]:
    try:
        client = distributed.Client(address, timeout=_CONNECT_SECONDS)
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterError(f'no scheduler answers at {address}: {error}') from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_CONNECT_SECONDS)
        except TimeoutError as error:
            raise ClusterError(f'the scheduler at {address} has no workers') from error
        yield client
