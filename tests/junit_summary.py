# ruff: noqa: T201
"""Add up JUnit files: prints the tests that failed and, as the last line, '123 passed, 0 failed'.

    junit_summary.py FOLDER STATUS

STATUS is 1 when a program that wrote these files failed; then at least one failure is counted. Exits with 1 when
anything failed or no test ran.
"""
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path


def main(folder: Path, status: int) -> int:
    """Print the summary and return the exit status."""
    passed = failed = skipped = 0
    for path in sorted(folder.rglob('*.xml')):
        for case in ElementTree.parse(str(path)).iter('testcase'):
            kinds = {child.tag for child in case}
            if kinds & {'failure', 'error'}:
                failed += 1
                print(f"FAILED {case.get('classname') or path.stem}: {case.get('name')}")
            elif 'skipped' in kinds:
                skipped += 1
            else:
                passed += 1
    if status and not failed:
        failed = 1
        print('FAILED: a test program ended with an error; see above')
    print(f'{passed} passed, {failed} failed' + (f', {skipped} skipped' if skipped else ''))
    return 0 if passed and not failed else 1


if __name__ == '__main__':
    sys.exit(main(Path(sys.argv[1]), int(sys.argv[2])))
