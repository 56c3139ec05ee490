"""Packages of another workspace, which is sourced, are found at build time and at run time."""
import shutil

import pytest

from workspaces import ROOT, shell

MANIFEST = """<package format="3"><name>{name}</name><version>0.0.0</version><description>A stand-in.</description>
<maintainer email="user@example.com">user</maintainer><license>none</license><buildtool_depend>catkin</buildtool_depend>
<depend>message_generation</depend><depend>message_runtime</depend></package>"""
RULES = """cmake_minimum_required(VERSION 3.0.2)
project({name})
find_package(catkin REQUIRED COMPONENTS message_generation{needed})
add_message_files(FILES Thing.msg)
generate_messages()
catkin_package()
"""
# what ./run setup does of it, and all that this needs is there
SET_UP = """/usr/bin/python3 -B - <<'END'
import sys
sys.path.insert(0, '.')
from development import LOGS, set_up
LOGS.mkdir(exist_ok=True)
set_up._set_up_build()
END
"""
USES = 'rosmsg show robot_msgs/Thing | grep "int8 a"; /usr/bin/python3 -c "import robot_msgs.msg"'


def add_package(folder, name, needed=''):
    package = folder / name
    (package / 'msg').mkdir(parents=True)
    (package / 'msg/Thing.msg').write_text('int8 a\n')
    (package / 'package.xml').write_text(MANIFEST.format(name=name))
    (package / 'CMakeLists.txt').write_text(RULES.format(name=name, needed=needed))


@pytest.fixture
def checkout(tmp_path):
    """A checkout with one small package, in the place of ours."""
    for name in ('run', 'CMakeLists.txt'):
        shutil.copy(str(ROOT / name), str(tmp_path))
    shutil.copytree(str(ROOT / 'development'), str(tmp_path / 'development'),
                    ignore=shutil.ignore_patterns('benchmark*', '__pycache__'))
    add_package(tmp_path, 'openpose_ros_msgs', ' robot_msgs')
    return tmp_path


def test_a_sourced_workspace_is_used(checkout, environment, tmp_path_factory):
    """At build time, and later where only the terminal knows it; what else the terminal has is hidden."""
    robot = tmp_path_factory.mktemp('robot')
    add_package(robot / 'src', 'robot_msgs')
    shell('catkin_make -DPYTHON_EXECUTABLE=/usr/bin/python3', robot, environment)
    shell(f'export SOURCED_WORKSPACES={robot}/devel\n{SET_UP}', checkout, environment)
    shell(f"./run shell bash -e -c '{USES}'", checkout, environment)
    assert 'up to date' in shell(SET_UP, checkout, environment)
    (checkout / 'devel/_setup_util.py').write_text(
        (checkout / 'devel/_setup_util.py').read_text().replace(f'{robot}/devel', ''))
    assert 'Unable to load' in shell("./run shell rosmsg show robot_msgs/Thing 2>&1 || true", checkout, environment)
    shell(f"""source {robot}/devel/setup.bash
        export PYTHONPATH=/of/the/user:$PYTHONPATH
        ./run shell bash -e -c '{USES}; [[ $PYTHONPATH != */of/the/user* ]]'""", checkout, environment)
