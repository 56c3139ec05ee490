"""The tests with nodes: those that fail among the others are run once more, alone."""
import shutil
from pathlib import Path
from typing import Dict, List, Mapping

from development import LOGS, ROOT
from development.junit import UNSTEADY, failures
from development.terminal import say, succeeds

FOLDER = ROOT / 'build/test_results'


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
