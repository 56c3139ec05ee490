"""Many tasks in processes of this machine."""
import functools
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from contextlib import closing
from typing import Any, Callable, Generator, Mapping, Tuple, Union

from openpose_ros_tools.parallel.worker_processes import ProcessLostError, WorkerProcesses, tell_progress

Work = Callable[[Any, Callable[[float], None]], Any]


def run_in_processes(work: Work, tasks: Mapping[str, Any], *, workers: int, retries: int,
                     on_progress: Callable[[str, float], None]
                     ) -> Generator[Tuple[str, Union[Any, Exception]], None, None]:
    """Have processes do tasks; yield the name of each task with its result or error, as they end.

    A process that dies is replaced and its task begun again, until three have died on it. Closing the generator ends
    the processes at once.

    Args:
        work: function that can be pickled; gets a task, and a function to be called with the share that is done.
        tasks: by unique names.
        workers: number of processes; each does one task at a time.
        retries: number of further tries of a task that failed.
        on_progress: gets the name of a task and the share that is done, in another thread.
    """
    def do(name: str, task: Any) -> Any:
        for left in range(retries, -1, -1):
            try:
                return processes.call(work, task, tell_progress, on_progress=functools.partial(on_progress, name))
            except (CancelledError, ProcessLostError):
                raise
            except Exception:
                if left == 0:
                    raise

    workers = min(workers, len(tasks))
    with ThreadPoolExecutor(workers) as threads, closing(WorkerProcesses(workers)) as processes:
        names = {threads.submit(do, name, task): name for name, task in tasks.items()}
        try:
            for future in as_completed(names):
                error = future.exception()
                yield names[future], future.result() if error is None else error
        finally:
            for future in names:
                future.cancel()
