"""What tests of builds share: plain environments, copies of the checkout, shells with ROS."""
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


def copy_checkout(target):
    shutil.copytree(str(ROOT), str(target), symlinks=True, ignore=NOT_SOURCE)
    return target
