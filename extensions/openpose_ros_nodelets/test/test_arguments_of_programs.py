"""Each program says by --help, without a master, what it does and which parameters it has, and refuses flags."""
import os
import subprocess
from pathlib import Path

import pytest

CONFIG = Path(__file__).resolve().parents[1] / 'config'
NODELETS = ('cloud_to_depth', 'floor', 'people_cloud')


def run(name, *arguments):
    """Run a program where no master is."""
    return subprocess.run(['rosrun', 'openpose_ros_nodelets', f'{name}_node', *arguments], text=True, timeout=60,
                          capture_output=True, check=False,
                          env={**os.environ, 'ROS_MASTER_URI': 'http://localhost:9'})


@pytest.mark.parametrize('name', NODELETS)
def test_help(name):
    done = run(name, '--help', '__name:=helped')
    assert (done.returncode, done.stderr) == (0, '')
    assert done.stdout.splitlines()[0].rstrip('.').lower() in (CONFIG.parent / 'nodelets.xml').read_text().lower()
    assert '_PARAMETER:=VALUE' in done.stdout and (CONFIG / f'{name}.yaml').read_text() in done.stdout


def test_flags_are_refused_and_the_way_to_set_parameters_is_told():
    done = run('floor', '--rate=10')
    assert (done.returncode, done.stdout) == (1, '')
    assert done.stderr == ("floor_node: argument '--rate=10' is not allowed: parameters are set as _NAME:=VALUE; "
                           '--help lists them\n')
