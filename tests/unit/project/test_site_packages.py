"""Programs of these packages, and their processes, see what PyPI brings; other programs of the same shell do not."""
import os
import subprocess
import sys

import pytest

from development import ROOT

POOL = """
import importlib, sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
if len(sys.argv) > 1:
    import openpose_ros_pkg
if __name__ == '__main__':
    with ProcessPoolExecutor(1, get_context('spawn')) as pool:
        print(pool.submit(importlib.import_module, 'only_on_pypi').exception())
"""


@pytest.fixture
def run_program(tmp_path):
    (tmp_path / 'site').mkdir()
    (tmp_path / 'site/only_on_pypi.py').write_text('')
    (tmp_path / 'site/json.py').write_text('raise ImportError("this stands before the standard library")')
    environment = {**os.environ, 'OPENPOSE_ROS_SITE_PACKAGES': str(tmp_path / 'site'),
                   'PYTHONPATH': str(ROOT / 'openpose_ros_pkg/src')}

    def run(text, *arguments):
        (tmp_path / 'program.py').write_text(text)
        return subprocess.run([sys.executable, str(tmp_path / 'program.py'), *arguments], env=environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False).stdout
    return run


def test_programs_of_these_packages_see_them_behind_everything_else(run_program):
    assert run_program('import openpose_ros_pkg, only_on_pypi, json') == ''
    assert 'pickle' in run_program(POOL, 'ours')  # imported, but a module can not be sent back


def test_other_programs_do_not_see_them(run_program):
    assert "ModuleNotFoundError: No module named 'only_on_pypi'" in run_program('import only_on_pypi')
    assert "No module named 'only_on_pypi'" in run_program(POOL)
