"""Each `*.test` of the packages, by rostest with a ROS master of its own, and the C++ tests of the nodelets."""
import subprocess

import pytest

from development import LOGS, PACKAGES, ROOT
from session import ENDS_WITH_PARENT

FILES = sorted((name, path) for name, folder in PACKAGES.items() for path in folder.glob('test/*.test'))
NODELETS = 'openpose_ros_nodelets'
TIMEOUT = 500.0  # [s]


def run(*command):
    """Run a command that has to succeed; its output is shown where it does not."""
    done = subprocess.run([*ENDS_WITH_PARENT, *map(str, command)], cwd=str(ROOT), timeout=TIMEOUT, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    assert done.returncode == 0, done.stdout[-20000:]


@pytest.mark.parametrize('package, path', FILES, ids=lambda value: getattr(value, 'stem', value))
def test_file(package, path):
    run('rostest', '--results-base-dir', LOGS / 'test_ros/results', package, path.name)


@pytest.mark.parametrize('source', [path for path in sorted((PACKAGES[NODELETS] / 'test').glob('*.cpp'))
                                    if 'gtest' in path.read_text()], ids=lambda path: path.stem)
def test_in_cpp(source):
    run(ROOT / 'devel/lib' / NODELETS / source.stem)
