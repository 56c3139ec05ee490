"""The groups of tests, each a run of pytest with a worker on each core."""
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from typing import Dict, List, Mapping, NamedTuple, Sequence, Tuple

from development import LOGS, PACKAGES, ROOT, VENV_FOCAL, VENV_PYTHON
from development.set_up import find_python_38
from development.terminal import output_of, say, succeeds
from development.workspace import workspace_environment

NEEDS_PYTHON_38 = ('needs a Python 3.8 with its headers and pip, in $PYENV_ROOT, ~/.pyenv or on PATH: pyenv install '
                   '3.8, or apt-get install python3.8-dev python3.8-venv where apt has them')
FOCAL_PYTHON = str(VENV_FOCAL / 'bin/python3')
RESULTS = ROOT / 'build/test_results'  # one JUnit file of each group
FIRST_RUN = '.first_run.xml'  # end of the name of a file with failures that were run again
PARALLEL = ('-n', 'auto', '--maxprocesses', '4', '--dist', 'worksteal')
ALONE = ('-n', '0')
CHECKOUT = 'tests/workspace/test_builds.py::test_catkin_make_in_the_checkout_with_its_install_space_inside'
IN_REAL_TIME = ('ros', 'faults')  # a busy machine can fail these: what fails is run once more, alone


class Group(NamedTuple):
    """What pytest runs: paths and options; with ROS: in the built workspace."""

    paths: Tuple[str, ...]
    options: Tuple[str, ...] = PARALLEL
    ros: bool = False
    python: str = VENV_PYTHON
    variables: Mapping[str, str] = {}


_MESSAGES = tuple(sorted(str(path) for folder in PACKAGES.values() for path in folder.glob('test/test_*.py')))
GROUPS: Dict[str, Group] = {
    'lint': Group(('tests/lint',)),
    'unit': Group(('tests/unit', 'tests/fuzz', '--ignore=tests/fuzz/ros')),
    'ros': Group((*_MESSAGES, 'tests/fuzz/ros', 'tests/rostests'), ros=True),
    'faults': Group(('tests/faults',), ALONE, ros=True),
    'build': Group(('tests/workspace/test_manifests.py', CHECKOUT)),
    'workspace': Group(('tests/workspace',), ('-n', '2', '--dist', 'loadfile')),
    'focal': Group(('tests/unit',), python=FOCAL_PYTHON),
    'soak': Group(('tests/soak',), ALONE),
    'fuzz': Group(('tests/fuzz', '--timeout=0'), ros=True,
                  variables={'FUZZ_EXAMPLES': os.environ.get('FUZZ_EXAMPLES', '1000')}),
    'sanitize': Group(('tests/sanitize',), ALONE)}
STANDARD = ('lint', 'unit', 'ros', 'faults', 'build')
ALL = ('lint', 'unit', 'ros', 'faults', 'workspace', 'focal', 'soak')


def run_groups(names: Sequence[str]) -> int:
    """Run groups of tests, print a summary and return the exit status."""
    signal.signal(signal.SIGINT, lambda *_: None)  # pytest gets it as well, ends what it has started, and returns
    shutil.rmtree(str(RESULTS), ignore_errors=True)
    failed: List[str] = []
    times = []
    with tempfile.TemporaryDirectory() as home:
        _set_environment(home)
        for name in names:
            started = time.monotonic()
            status = _run_group(name)
            times.append(f'{name} {(time.monotonic() - started) / 60:.1f} min')
            failed += [name] * (status != 0)
            if status == 2:  # interrupted
                break
    return _summary(failed, times)


def _set_environment(home: str) -> None:
    for name in ('ROS_IP', 'ROS_NAMESPACE', 'ROSCONSOLE_CONFIG_FILE', 'DISPLAY'):
        os.environ.pop(name, None)
    shutil.rmtree(str(LOGS / 'test_ros'), ignore_errors=True)
    with socket.socket() as free:
        free.bind(('localhost', 0))
        port = free.getsockname()[1]
    os.environ.update({'ROS_HOME': home, 'ROS_LOG_DIR': str(LOGS / 'test_ros'), 'ROS_HOSTNAME': 'localhost',
                       'ROS_MASTER_URI': f'http://localhost:{port}'})


def _run_group(name: str) -> int:
    group = GROUPS[name]
    if name == 'focal' and find_python_38() is None:
        say(f'== focal: LEFT OUT, as this {NEEDS_PYTHON_38}')
        return 0
    environment = {**(workspace_environment() if group.ros else os.environ), **group.variables}
    if name == 'ros' and not succeeds('make', '-C', 'build', '--no-print-directory', '--silent', 'tests',
                                      env=environment, cwd=str(ROOT), stdout=subprocess.DEVNULL):
        return 1
    if name == 'focal':  # its pybind11 builds the compiled modules
        environment['CMAKE_INCLUDE_PATH'] = output_of(
            FOCAL_PYTHON, '-c', 'import pybind11; print(pybind11.get_include())').strip()
    say(f'== {name}')
    status = _pytest(group, name, environment, group.options)
    if status == 1 and name in IN_REAL_TIME:
        say(f'== {name}: UNSTEADY or broken is what failed; it runs once more, alone')
        (RESULTS / f'{name}.xml').rename(RESULTS / f'{name}{FIRST_RUN}')
        status = _pytest(group, name, environment, (*ALONE, '--last-failed'))
    return status


def _pytest(group: Group, name: str, environment: Mapping[str, str], options: Sequence[str]) -> int:
    command = [group.python, '-m', 'pytest', '-q', '-o', f'cache_dir={LOGS / "pytest"}', '--junitxml',
               str(RESULTS / f'{name}.xml'), *options, *group.paths]
    return subprocess.run(command, env=dict(environment), cwd=str(ROOT), check=False).returncode


def _summary(failed: Sequence[str], times: Sequence[str]) -> int:
    """Print how long each group took, which failed and, as the last line, '123 passed, 0 failed, 4 skipped'."""
    say(', '.join(times))
    passed = wrong = skipped = 0
    for path in RESULTS.glob('*.xml'):
        for suite in ElementTree.parse(str(path)).iter('testsuite'):
            tests, *others = (int(suite.get(key, 0)) for key in ('tests', 'skipped', 'failures', 'errors'))
            passed, skipped = passed + tests - sum(others), skipped + others[0]
            if not path.name.endswith(FIRST_RUN):
                wrong += sum(others[1:])
    if failed:
        say(f'FAILED: {", ".join(failed)}')
    say(f'{passed} passed, {max(wrong, len(failed))} failed, {skipped} skipped')
    return int(bool(failed) or not passed)
