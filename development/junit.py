"""Results of tests, as JUnit files."""
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import List

from development.terminal import say

UNSTEADY = 'unsteady.txt'  # end of the name of a file with a line for each test that failed and then passed alone


def failures(path: Path) -> List[str]:
    """Return the names of the tests of a file that failed."""
    return [f"{case.get('classname') or path.stem}: {case.get('name')}" for case in _cases(path) if _has_failed(case)]


def take_failures(path: Path) -> List[str]:
    """Return the names of the tests of a file that failed, and take these tests out of it."""
    names, tree = failures(path), ElementTree.parse(str(path))
    for suite in list(tree.iter('testsuite')):
        for case in suite.findall('testcase'):
            if _has_failed(case):
                suite.remove(case)
    tree.write(str(path))
    return names


def _has_failed(case: ElementTree.Element) -> bool:
    return case.find('failure') is not None or case.find('error') is not None


def _cases(path: Path) -> List[ElementTree.Element]:
    return list(ElementTree.parse(str(path)).iter('testcase'))


def summary(folder: Path, broken: bool) -> bool:
    """Print what failed, what is unsteady, and as the last line '123 passed, 0 failed'; tell whether all is well.

    Args:
        folder: all *.xml in it are added up; no tests at all are not well.
        broken: a program that wrote these files failed; then at least one failure is counted.
    """
    paths = sorted(folder.rglob('*.xml'))
    failed = [name for path in paths for name in failures(path)]
    skipped = sum(case.find('skipped') is not None for path in paths for case in _cases(path))
    passed = sum(len(_cases(path)) for path in paths) - len(failed) - skipped
    for name in failed:
        say(f'FAILED {name}')
    if broken and not failed:
        failed = ['']
        say('FAILED: a test program ended with an error; see above')
    unsteady = [line for path in sorted(folder.rglob(f'*{UNSTEADY}')) for line in path.read_text().splitlines()]
    for name in unsteady:
        say(f'UNSTEADY {name}: failed, and passed when it was run again alone')
    say(f'{passed} passed, {len(failed)} failed' + (f', {skipped} skipped' if skipped else ''))
    return bool(passed) and not failed
