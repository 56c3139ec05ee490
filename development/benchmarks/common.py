"""What the benchmarks share: the packages of this repository, settings, tables, processes, runs on a ROS master."""
import argparse
import multiprocessing
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, List, Sequence

ROOT = Path(__file__).resolve().parents[2]
sys.path.extend([str(ROOT), *map(str, ROOT.glob('*/src')), *map(str, ROOT.glob('extensions/*/src')),
                 str(ROOT / 'tests/support'), str(ROOT / 'devel/lib/python3/dist-packages')])

from openpose_ros_pkg.command_line import DONE, SOME_FAILED, run_command
from openpose_ros_pkg.errors import OpenposeRosError

if TYPE_CHECKING:
    from session import Session

# The sequence that is part of this repository.
DEMO = ROOT / 'skeleton_extract_3d' / 'demo' / 'cross'
# Small rendered scenes with known joints that are part of it.
SCENES = ROOT / 'development/benchmark_data/scenes'


class Parser(argparse.ArgumentParser):
    """A command line whose help is the docstring of the benchmark."""

    def __init__(self, doc: str) -> None:
        super().__init__(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)


def scenes_of(folder: Path) -> List[Path]:
    """Return the scenes with known joints in a folder."""
    return sorted(path.parent for path in folder.glob('*/gt.json'))


def markdown(rows: Sequence[Sequence[object]]) -> str:
    """Return rows, the first with the names of the columns, as a table in Markdown."""
    lines = [f"| {' | '.join(map(str, row))} |" for row in rows]
    lines.insert(1, '| --- |' + ' ---: |' * (len(rows[0]) - 1))
    return '\n'.join(lines) + '\n'


def run_live(measure: Callable[['Session', Path, argparse.Namespace], Sequence[str]],
             arguments: argparse.Namespace) -> int:
    """Measure nodes on a ROS master of their own; return the exit status.

    Args:
        measure: takes the session, its folder and the arguments, prints the figures, and returns what has failed.
    """
    def work() -> int:
        faults = in_session(measure, arguments)
        print(*faults, sep='\n')
        return SOME_FAILED if faults else DONE

    return run_command('bench', work)


def in_session(work: Callable[..., Any], *arguments: Any) -> Any:
    """Return what `work(session, folder, *arguments)` returns, with a folder that goes; a failure prints its logs."""
    from session import Session  # most benchmarks need no ROS
    with tempfile.TemporaryDirectory(prefix='openpose_ros_bench_') as folder:
        try:
            with Session(Path(folder)) as session:
                return work(session, Path(folder), *arguments)
        except OpenposeRosError:
            print(*(log.read_text(errors='replace') for log in Path(folder).glob('*.log')), sep='\n', file=sys.stderr)
            raise


def on_a_master(work: Callable[..., Any], *arguments: Any) -> Any:
    """Return what `in_session` returns, in a process of its own, as a process has one ROS node at most.

    Args:
        work: a function of a module.
    """
    with ProcessPoolExecutor(1, multiprocessing.get_context('spawn')) as pool:
        return pool.submit(in_session, work, *arguments).result()
