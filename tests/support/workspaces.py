"""What tests of builds share: plain environments, copies of the checkout, shells with ROS."""
import os
import shutil
import subprocess
from pathlib import Path

from development.systems import this_system

ROOT = Path(__file__).parents[2]
ROS = this_system().ros
SETTINGS = f'-DPYTHON_EXECUTABLE=/usr/bin/python3 -Dopenpose_ros_pkg_VENV={ROOT}/.venv'
TIMEOUT = 900.0  # [s] several times what the slowest build takes
NOT_SOURCE = shutil.ignore_patterns('.git', '.venv*', 'build', 'devel', 'install', 'logs', '.catkin_*', 'demo_output',
                                    '__pycache__', '.pytest_cache', '.ruff_cache', '.hypothesis')


def shell(script, folder, environment):
    """Run a bash script and return its output; it has to succeed."""
    if ROS is not None:
        script = f'source {ROS}/setup.bash\n{script}'
    done = subprocess.run(['bash', '-e', '-o', 'pipefail', '-c', script], cwd=str(folder), env=environment,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=TIMEOUT, check=False)
    assert done.returncode == 0, done.stdout[-4000:]
    return done.stdout


def plain_environment(tmp_path_factory):
    """Return an environment with a useless python3 first on PATH, in place of a pyenv or conda without ROS."""
    useless = tmp_path_factory.mktemp('pyenv')
    for name in ('python', 'python3'):
        (useless / name).write_text('#!/bin/sh\necho "this python3 has no ROS" >&2\nexit 1\n')
        (useless / name).chmod(0o755)
    kept = {name: os.environ[name] for name in ('HOME', 'LANG', 'OPENPOSE_ROS_TEST') if name in os.environ}
    return {**kept, 'PATH': f'{useless}:/usr/sbin:/usr/bin:/sbin:/bin', 'PYTHONNOUSERSITE': '1',
            'ROS_HOME': str(tmp_path_factory.mktemp('ros_home')), 'ROS_HOSTNAME': 'localhost'}


def copy_checkout(target):
    shutil.copytree(str(ROOT), str(target), symlinks=True, ignore=NOT_SOURCE)
    return target
