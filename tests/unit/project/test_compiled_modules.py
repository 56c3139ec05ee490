"""The compiled modules are no option: CMake says what to install where something is missing, ROS or no ROS."""
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


def configure(sources, folder, *settings):
    """Return what CMake complains about, in one line."""
    command = ['cmake', '-S', str(ROOT / sources), '-B', str(folder), *settings]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60,
                          check=False)
    assert done.returncode != 0
    return re.sub(r'\s+', ' ', done.stdout)


@pytest.mark.parametrize('settings, told', [
    (('-DCMAKE_FIND_ROOT_PATH=/nowhere', '-DCMAKE_FIND_ROOT_PATH_MODE_INCLUDE=ONLY'),
     'needs pybind11: apt-get install pybind11-dev'),
    (('-DPYTHON_EXECUTABLE=/bin/false',), 'PYTHON_EXECUTABLE = /bin/false does not work')])
def test_what_is_missing_is_named(settings, told, tmp_path):
    assert told in configure('skeleton_extract_3d/src/cpp', tmp_path, *settings)
