"""The linters have nothing to say."""
import subprocess

import pytest

from development import PACKAGES, ROOT, VENV
from development.set_up import NUMPY
from development.systems import this_system

# NumPy 2 annotates shapes and takes right code for wrong (`known.any(axis=1)` may be a scalar): there without types.
_TYPES = [] if NUMPY.read_text().startswith('numpy==1.') else ['--no-site-packages']


@pytest.mark.parametrize('command', [
    pytest.param([VENV / 'bin/mypy', *_TYPES], id='mypy'),
    pytest.param([VENV / 'bin/ruff', 'check', '--no-cache', 'development', *PACKAGES.values(), 'examples', 'tests'],
                 id='ruff'),
    pytest.param(['shellcheck', 'run', '.ci/run'], id='shellcheck'),
    pytest.param(['catkin_lint', '--offline', '-W2', '--strict', '.'], id='catkin_lint', marks=pytest.mark.skipif(
        not this_system().packages_of('catkin-lint'), reason='it would bring parts of another ROS'))])
def test_lint(command):
    done = subprocess.run(list(map(str, command)), cwd=str(ROOT), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, check=False)
    assert done.returncode == 0, done.stdout
