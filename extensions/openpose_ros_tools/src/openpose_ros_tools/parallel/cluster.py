"""Many tasks on an existing cluster of Dask distributed."""
import asyncio
import uuid
from collections import deque
from contextlib import contextmanager
from typing import Any, Callable, Dict, Generator, Iterator, Mapping, Tuple, Union

from openpose_ros_pkg.errors import OpenposeRosError, ParameterError
from openpose_ros_tools.parallel.processes import RETRIES

# Longest wait for the answer of an existing scheduler, and for its first worker [s].
_CONNECT_SECONDS = 20
# Before Python 3.11 these are different classes; which one is raised depends on the version of distributed.
_TIMEOUTS = (TimeoutError, asyncio.TimeoutError)


class ClusterError(OpenposeRosError):
    """There is no such cluster, or it has no workers."""


def run_on_cluster(work: Callable[[Any], Any], tasks: Mapping[str, Any], scheduler: str
                   ) -> Generator[Tuple[str, Union[Any, Exception]], None, None]:
    """Have the workers of a cluster do tasks; see `run_in_processes`.

    Another worker does the task of one that died, until the scheduler blames the task (after three deaths, unless it is
    configured otherwise). Closing the generator cancels the tasks.

    Args:
        scheduler: address of the scheduler.

    Raises:
        ParameterError: Dask distributed is not installed.
        ClusterError: no scheduler answers, or it has no workers.
    """
    distributed = _distributed()
    with _connected(distributed, scheduler) as client:
        futures: Dict[Any, str] = {}
        completed = distributed.as_completed()
        waiting = deque(tasks.items())

        def submit_tasks() -> None:
            """Submit one task per thread of the cluster; with more, one worker may queue tasks while another idles."""
            while waiting and len(futures) < max(sum(client.nthreads().values()), 1):
                name, task = waiting.popleft()
                # a unique key, as the scheduler would return an older result for the same one
                future = client.submit(work, task, key=f'{name}-{uuid.uuid4()}', retries=RETRIES)
                futures[future] = name
                completed.add(future)

        submit_tasks()
        for future in completed:
            if future.cancelled():
                gone = ClusterError(f'the scheduler at {scheduler} is gone')
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
        raise ParameterError(f'--scheduler needs Dask distributed ({error}): install python3-distributed') from error
    return distributed


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
