"""Work on a ROS master of its own in a process of its own, as a process has one ROS node at most."""
import multiprocessing
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Callable


def on_a_master(work: Callable[..., Any], *arguments: Any) -> Any:
    """Return what `work(session, folder, *arguments)` returns, a function of a module, with a folder that goes."""
    with ProcessPoolExecutor(1, multiprocessing.get_context('spawn')) as pool:
        return pool.submit(_run, work, arguments).result()


def _run(work: Callable[..., Any], arguments: Any) -> Any:
    import common  # noqa: F401 - finds the packages
    from session import Session
    with tempfile.TemporaryDirectory(prefix='openpose_ros_report_') as folder, Session(Path(folder)) as session:
        return work(session, Path(folder), *arguments)
