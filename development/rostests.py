"""The tests with nodes: those that fail among the others are run once more, alone."""
import shutil
from pathlib import Path
from typing import Callable, Dict, List, Mapping

from development import LOGS, ROOT
from development.junit import UNSTEADY, failures, take_failures
from development.terminal import say, succeeds

FOLDER = ROOT / 'build/test_results'
FAULTS = 'tests/faults'


def run_rostests(results: Path, environment: Mapping[str, str]) -> bool:
    """Run all rostests and copy their results; tell whether they passed.

    They run in real time, so that a machine that is busy with something else can fail one. Such a test passes when it
    does so alone, and the summary names it as unsteady: it is to be mended.
    """
    shutil.rmtree(str(FOLDER), ignore_errors=True)
    passed = succeeds('make', '-C', 'build', '-j1', '--no-print-directory', 'run_tests', env=environment)
    if not FOLDER.is_dir():
        return False
    unsteady = _run_again(failed_rostests(FOLDER), environment)
    passed &= succeeds('catkin_test_results', str(FOLDER), env=environment)  # run_tests succeeds although tests fail
    shutil.copytree(str(FOLDER), str(results / 'ros'))
    (results / 'ros' / UNSTEADY).write_text(''.join(f'{name}\n' for name in unsteady))
    return passed


def failed_rostests(folder: Path) -> Dict[Path, List[str]]:
    """Return the files of tests that failed, as PACKAGE/NAME.test, and their failures.

    Args:
        folder: of catkin's results; PACKAGE/rostest-test_NAME.xml of a file names the rosunit-*.xml of its nodes.
    """
    failed: Dict[Path, List[str]] = {}
    for path in sorted(folder.glob('*/rostest-test_*.xml')):
        text = path.read_text(errors='replace')
        of_nodes = [each for each in sorted(path.parent.glob('rosunit-*.xml')) if each.name in text]
        found = [name for each in (path, *of_nodes) for name in failures(each)]
        if found:
            failed[Path(path.parent.name, path.stem[len('rostest-test_'):] + '.test')] = found
    return failed


def _run_again(failed: Mapping[Path, List[str]], environment: Mapping[str, str]) -> List[str]:
    """Run files again, and return the failures of those that pass now."""
    unsteady: List[str] = []
    for file, names in failed.items():
        say(f'== {file} once more, alone')
        shutil.copytree(str(FOLDER / file.parent), str(LOGS / 'test_ros' / f'results_of_first_run_{file.stem}'))
        if succeeds('rostest', '--results-base-dir', str(FOLDER), '--results-filename', f'test_{file.stem}.xml',
                    str(file.parent), file.name, env=environment):
            unsteady += names
    return unsteady


def run_faults(results: Path, run: Callable[[str, List[str]], bool]) -> bool:
    """Run the tests of faults, as `run_rostests` does the rostests; tell whether they passed.

    Args:
        run: pytest; called with the name of the file that it writes in `results`, and what it shall run.
    """
    first, again = results / 'faults.xml', results / 'faults_again.xml'
    if run(first.stem, [FAULTS]):
        return True
    if not first.is_file() or not failures(first):
        return False
    kept = LOGS / 'test_ros' / 'results_of_first_run_faults.xml'
    kept.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(str(first), str(kept))
    failed = take_failures(first)
    say(f'== {len(failed)} of {FAULTS} once more, alone')
    passed = run(again.stem, [f'{FAULTS}/test_faults.py::{name.partition(": ")[2]}' for name in failed])
    still = failures(again) if again.is_file() else failed
    (results / f'faults_{UNSTEADY}').write_text(''.join(f'{name}\n' for name in failed if name not in still))
    return passed
