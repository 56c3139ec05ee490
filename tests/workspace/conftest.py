"""What the tests of builds share."""
import os

import pytest


@pytest.fixture(scope='module')
def environment(tmp_path_factory):
    """Return an environment with a useless python3 first on PATH, in place of a pyenv or conda without ROS."""
    useless = tmp_path_factory.mktemp('pyenv')
    for name in ('python', 'python3'):
        (useless / name).write_text('#!/bin/sh\necho "this python3 has no ROS" >&2\nexit 1\n')
        (useless / name).chmod(0o755)
    kept = {name: os.environ[name] for name in ('HOME', 'LANG', 'OPENPOSE_ROS_TEST') if name in os.environ}
    return {**kept, 'PATH': f'{useless}:/usr/sbin:/usr/bin:/sbin:/bin', 'PYTHONNOUSERSITE': '1',
            'ROS_HOME': str(tmp_path_factory.mktemp('ros_home')), 'ROS_HOSTNAME': 'localhost'}
