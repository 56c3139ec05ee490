"""The commands of ./run; its usage text says what they do."""
import os
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Callable, Dict, NoReturn, Sequence

from development import PACKAGES, PYTHON, ROOT
from development.generated import write_config, write_docs
from development.locks import write_locks
from development.ros2 import write_ros2
from development.set_up import find_python_38, set_up, weights
from development.terminal import die, handle_signals, say
from development.testing import ALL, GROUPS, NEEDS_PYTHON_38, STANDARD, run_groups
from development.workspace import enter_workspace


def main(arguments: Sequence[str]) -> None:
    handle_signals()
    command = COMMANDS.get(arguments[0])
    if command is None:
        die(f"unknown command '{arguments[0]}'; ./run help lists them")
    if arguments[1:2] in (['--help'], ['-h']) and arguments[0] not in WITH_HELP:
        os.execv(str(ROOT / 'run'), ['run', 'help'])
    try:
        command(list(arguments[1:]))
    except KeyboardInterrupt:
        sys.exit(130)


def demo(arguments: Sequence[str]) -> NoReturn:
    if not {'--help', '-h'} & set(arguments):
        set_up([])
    enter_workspace([PYTHON, str(ROOT / 'development/demo/demo.py'), *arguments], ROS_HOSTNAME='localhost', ROS_IP=None,
                    ROS_NAMESPACE=None)


def launch(arguments: Sequence[str]) -> NoReturn:
    ours = [path for word in arguments for path in (ROOT / 'launch' / word, Path(word)) if path.suffix == '.launch'
            and path.exists()]
    if '--ros-args' in arguments and ours:  # roslaunch would call those without a default required, and name helpers
        sys.path.append(str(PACKAGES['openpose_ros_pkg'] / 'src'))
        from openpose_ros_pkg.params.launch_arguments import listing
        sys.stdout.write(listing(ours[0]))
        sys.exit(0)
    enter_workspace(['roslaunch', *arguments])


def camera(arguments: Sequence[str]) -> NoReturn:
    if find_spec('yaml') is None:
        set_up([])  # brings PyYAML, for the table of cameras
    from development.camera import launch_command
    command = launch_command(arguments, bool(os.environ.get('DISPLAY')))  # ends here where the name is wrong
    set_up([])
    enter_workspace(command)


def doctor(arguments: Sequence[str]) -> NoReturn:
    enter_workspace(['rosrun', 'openpose_ros_bringup', 'doctor', *arguments], OPENPOSE_ROS_PREFIX='./run shell ')


def shell(arguments: Sequence[str]) -> NoReturn:
    if not arguments:
        say(f'In the workspace of {ROOT}; exit leaves it.')
    enter_workspace(arguments or ['bash'])


def model(arguments: Sequence[str]) -> NoReturn:
    sys.exit(not weights(*arguments))


def bench(arguments: Sequence[str]) -> NoReturn:
    folder, name, rest = ROOT / 'development/benchmarks', ' '.join(arguments[:1]), arguments[1:]
    if name == 'render':  # it has an environment of its own, and needs no workspace
        os.execv(PYTHON, [PYTHON, str(ROOT / 'development/benchmark_data/render.py'), *rest])
    if name not in BENCHMARKS:
        die('usage: ./run bench PROGRAM ARGS, PROGRAM one of: ' + ', '.join(BENCHMARKS) + ', render')
    os.environ['PYTHONPATH'] = os.pathsep.join([str(folder), str(ROOT / 'tests/support')])  # what they share
    enter_workspace([PYTHON, str(folder / f'{name}.py'), *rest])


def test(arguments: Sequence[str]) -> NoReturn:
    for name in set(arguments) - {*GROUPS, 'all'}:
        die(f"there is no test group '{name}'; one of: all {' '.join(GROUPS)}")
    groups = ALL if 'all' in arguments else arguments or STANDARD
    python_38 = find_python_38() if 'focal' in groups else None
    if 'focal' in arguments and python_38 is None:
        die(f'the test group focal {NEEDS_PYTHON_38}')
    set_up([], test_tools=True, python_38=python_38)
    sys.exit(run_groups(groups))


# Commands whose programs tell their own options.
WITH_HELP = ('setup', 'demo', 'launch', 'doctor', 'shell', 'model')
BENCHMARKS = ('accuracy', 'ablation', 'calibration', 'report', 'soak', 'virtual')
COMMANDS: Dict[str, Callable[[Sequence[str]], None]] = {
    'setup': set_up, 'demo': demo, 'camera': camera, 'launch': launch, 'doctor': doctor, 'shell': shell, 'test': test,
    'model': model, 'bench': bench, 'config': write_config, 'docs': write_docs, 'lock': write_locks,
    'ros2': write_ros2}
