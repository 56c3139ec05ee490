"""The groups of tests, and what they leave behind."""
import functools
import os
import shutil
import signal
import socket
import tempfile
import time
from pathlib import Path
from typing import Callable, Dict, List, Mapping, Optional, Sequence

from development import LOGS, PACKAGES, ROOT, VENV, VENV_FOCAL, VENV_PYTHON
from development.junit import summary
from development.rostests import run_faults, run_rostests
from development.sanitize import sanitized
from development.set_up import NUMPY, find_python_38
from development.terminal import output_of, run_in_group, say, succeeds
from development.workspace import workspace_environment

NEEDS_PYTHON_38 = ('needs a Python 3.8 with its headers and pip, in $PYENV_ROOT, ~/.pyenv or on PATH: pyenv install '
                   '3.8, or apt-get install python3.8-dev python3.8-venv where apt has them')
MARK = 'OPENPOSE_ROS_TEST'  # by this variable the processes of a test run are known
FUZZ, FUZZ_MESSAGES = 'tests/fuzz', 'tests/fuzz/ros'
NIGHTLY_EXAMPLES = '1000'  # of each fuzz target
ENDING_TIME = 5.0  # [s] in which processes have to end by themselves


def run_groups(names: Sequence[str]) -> int:
    """Run groups of tests, print a summary and return the exit status."""
    folder = Path(tempfile.mkdtemp())
    results = folder / 'results'
    results.mkdir()
    _set_environment(folder)
    os.chdir(str(ROOT))
    try:
        failed = False
        for name in names:
            failed |= run_in_group(f'test group {name}', GROUPS[name], results) != 0
        failed |= not _one_test(results, 'processes', 'nothing is left running',
                                lambda: end_processes(folder, signal.SIGTERM, ENDING_TIME))
        say('')
        return not summary(results, failed)
    finally:
        end_processes(folder, signal.SIGKILL, 0.0)
        shutil.rmtree(str(folder), ignore_errors=True)


def _set_environment(folder: Path) -> None:
    for name in ('ROS_IP', 'ROS_NAMESPACE', 'ROSCONSOLE_CONFIG_FILE', 'DISPLAY'):
        os.environ.pop(name, None)
    shutil.rmtree(str(LOGS / 'test_ros'), ignore_errors=True)
    with socket.socket() as free:
        free.bind(('localhost', 0))
        port = free.getsockname()[1]
    os.environ.update({MARK: str(folder), 'ROS_HOME': str(folder / 'ros_home'), 'ROS_LOG_DIR': str(LOGS / 'test_ros'),
                       'ROS_HOSTNAME': 'localhost', 'ROS_MASTER_URI': f'http://localhost:{port}'})


def lint(results: Path) -> int:
    # NumPy 2 annotates shapes and takes right code for wrong (`known.any(axis=1)` may be a scalar): there without types
    types = [] if NUMPY.read_text().startswith('numpy==1.') else ['--no-site-packages']
    checks = {
        'ruff check': [str(VENV / 'bin/ruff'), 'check', '--no-cache', 'development', *map(str, PACKAGES.values()),
                       'examples', 'tests'],
        'mypy': [str(VENV / 'bin/mypy'), *types],
        'shellcheck': ['shellcheck', 'run', '.ci/run'],
        'catkin_lint': ['catkin_lint', '--offline', '-W2', '--strict', '.'],
    }
    return sum(not _one_test(results, title.split()[0], title, functools.partial(succeeds, *command))
               for title, command in checks.items())


def unit(results: Path) -> int:
    say('== tests/unit')
    failed = _pytest(results, 'unit', ['tests/unit'])
    say('== tests/fuzz, a few examples')
    return failed + _pytest(results, 'fuzz', [FUZZ, f'--ignore={FUZZ_MESSAGES}'])


def ros(results: Path) -> int:
    environment = workspace_environment()
    say('== tests with ROS messages')
    scripts = sorted(str(path) for folder in PACKAGES.values() for path in folder.glob('test/test_*.py'))
    failed = _pytest(results, 'messages', scripts, environment)
    say('== tests/fuzz/ros, a few examples')
    failed += _pytest(results, 'fuzz_messages', [FUZZ_MESSAGES], environment)
    say('== rostests')
    return failed + (not run_rostests(results, environment))


def faults(results: Path) -> int:
    say('== tests/faults')
    environment = workspace_environment()
    return not run_faults(results, lambda name, paths: not _pytest(results, name, paths, environment))


def fuzz(results: Path) -> int:
    """Run all fuzz tests with random examples, as many of each as the environment says."""
    number = os.environ.get('FUZZ_EXAMPLES', NIGHTLY_EXAMPLES)
    say(f'== tests/fuzz, {number} examples of each target')
    return _pytest(results, 'fuzz', [FUZZ, '--timeout=0'], {**workspace_environment(), 'FUZZ_EXAMPLES': number})


def workspace(results: Path) -> int:
    say('== tests/workspace')
    return _pytest(results, 'workspace', ['tests/workspace'])


def focal(results: Path) -> int:
    """Run the unit tests with the libraries of Ubuntu 20.04, where there is a Python 3.8 for them."""
    if find_python_38() is None:
        say(f'== tests/unit with the libraries of Ubuntu 20.04: LEFT OUT, as this {NEEDS_PYTHON_38}')
        _write_result(results, 'focal', '<skipped/>')
        return 0
    say('== tests/unit with the libraries of Ubuntu 20.04')
    python = str(VENV_FOCAL / 'bin/python3')
    pybind11 = output_of(python, '-c', 'import pybind11; print(pybind11.get_include())').strip()
    return _pytest(results, 'focal', ['tests/unit'], {**os.environ, 'CMAKE_INCLUDE_PATH': pybind11}, python)


def soak(results: Path) -> int:
    """Run the soak benchmark for three minutes with its start: all that goes on in an hour, in shorter periods."""
    return not _one_test(results, 'soak', 'soak',
                         lambda: succeeds(str(ROOT / 'run'), 'bench', 'soak', '--minutes', '2.5'))


def sanitize(results: Path) -> int:
    say('== C++ with sanitizers')
    return not sanitized(results)


GROUPS: Dict[str, Callable[[Path], int]] = {
    'lint': lint, 'unit': unit, 'ros': ros, 'faults': faults, 'soak': soak, 'workspace': workspace, 'focal': focal,
    'fuzz': fuzz, 'sanitize': sanitize}
ON_REQUEST = ('fuzz', 'sanitize')  # groups that run where they are named


def _pytest(results: Path, name: str, paths: List[str], environment: Optional[Mapping[str, str]] = None,
            python: str = VENV_PYTHON) -> int:
    return not succeeds(python, '-m', 'pytest', '-p', 'no:cacheprovider', '--junitxml',
                        str(results / f'{name}.xml'), *paths, env=environment)


def _one_test(results: Path, name: str, title: str, function: Callable[[], bool]) -> bool:
    """Run a function that tells whether it succeeded, as one test of the summary."""
    say(f'== {title}')
    success = function()
    _write_result(results, name, '' if success else '<failure/>')
    return success


def _write_result(results: Path, name: str, result: str) -> None:
    (results / f'{name}.xml').write_text(
        f"<testsuite><testcase classname='run' name='{name}'>{result}</testcase></testsuite>\n")


def end_processes(folder: Path, number: int, ending_time: float) -> bool:
    """End what a test run left running, and tell whether everything ended by itself in time."""
    deadline = time.monotonic() + ending_time
    left = _processes(folder)
    while left and time.monotonic() < deadline:
        time.sleep(1.0)
        left = _processes(folder)
    for process in left:
        try:
            line = (process / 'cmdline').read_bytes().replace(b'\0', b' ').decode(errors='replace')
            say(f'left running: {process.name} {line}')
            os.kill(int(process.name), number)
        except OSError:
            pass  # it has just ended
    return not left


def _processes(folder: Path) -> List[Path]:
    """Return the folders in /proc of the processes of a test run."""
    mark = f'{MARK}={folder}'.encode()
    found = []
    for environ in Path('/proc').glob('[0-9]*/environ'):
        try:
            if mark in environ.read_bytes().split(b'\0'):
                found.append(environ.parent)
        except OSError:
            pass  # it has ended, or is another user's
    return found
