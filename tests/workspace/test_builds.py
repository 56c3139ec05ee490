"""The packages build together with catkin_make and catkin build, and work from the devel and the install space.

In catkin_make_isolated: test_packages_alone.py.
Each build works on a copy of the checkout. Needs what `./run test` sets up: ROS, and .venv in the checkout.
"""
import os
import re
import shutil
from pathlib import Path

import pytest

from development import PACKAGES
from development.systems import this_system
from workspaces import ROOT, SETTINGS, copy_checkout, shell

PYTHON_PACKAGES = [name for name, folder in PACKAGES.items() if (folder / 'setup.py').is_file()]


def check_space(space, environment):
    """What users of the packages rely on works after sourcing setup.bash."""
    modules = ', '.join((*PYTHON_PACKAGES, 'openpose_ros_msgs.msg', 'openpose_ros_msgs.srv', 'cv_bridge', 'numpy'))
    if (ROOT / '.venv/.complete').read_text().startswith('with '):
        modules += ', openvino'
    node_imports = ''
    for package in PYTHON_PACKAGES:
        scripts = sorted(path for path in (PACKAGES[package] / 'scripts').iterdir() if path.is_file())
        assert scripts
        for script in scripts:
            program = space / 'lib' / package / script.name
            assert os.access(str(program), os.X_OK)
            assert program.read_text().startswith('#!/usr/bin/python3\n')
            # all but the call of main()
            node_imports += ''.join(re.findall(r'^(?:import|from) .*\n', script.read_text(), re.MULTILINE))
    output = shell(f"""
        source {space}/setup.bash
        for package in {' '.join(set(PACKAGES) - {'openpose_ros'})}; do rospack find $package; done
        rosstack find openpose_ros
        rosmsg show openpose_ros_msgs/PersonDetection_3d | grep '^uint32 person_ID$'
        rossrv show openpose_ros_msgs/GetPersons | grep '^sensor_msgs/Image image$'
        /usr/bin/python3 - <<'END'
import importlib.util
assert importlib.util.find_spec('openvino') is None, 'other programs see what PyPI brings'
import {modules}
{node_imports}
print(numpy.__file__)
END""", space.parent.parent, environment)
    numpy_file = output.splitlines()[-1]
    assert not numpy_file.startswith(str(ROOT)), 'the virtual environment hides the NumPy that cv_bridge is built for'


def check_installed_files(space, environment):
    """The install space stands alone: it holds all files that the nodes read."""
    for package in ('openpose_ros_pkg', 'skeleton_extract_3d', 'openpose_ros_nodelets', 'openpose_ros_bringup'):
        for name in ('config', 'launch', 'rviz', 'demo'):
            for path in (PACKAGES[package] / name).rglob('*'):
                installed = space / 'share' / package / path.relative_to(PACKAGES[package])
                assert installed.exists() and not installed.is_symlink(), installed
        launch_files = ' '.join(path.name for path in (PACKAGES[package] / 'launch').glob('*.launch'))
        shell(f'source {space}/setup.bash\nfor file in {launch_files}; do roslaunch --files {package} $file; done',
              space.parent, environment)
    for package in PYTHON_PACKAGES:
        find = f'source {space}/setup.bash\n/usr/bin/python3 -c "import {package} as p; print(p.__file__)"'
        module = Path(shell(find, space.parent, environment).strip()).parent
        assert space in module.parents
        source = PACKAGES[package] / 'src' / package
        data = {path.relative_to(source) for path in source.glob('**/data/**/*')}
        assert {path.relative_to(module) for path in module.glob('**/data/**/*')} == data


def check_nodes_run(space, environment):
    """The whole chain, from the player to the extractor, answers from this space, and so does a node of clouds."""
    shell(f"""
        source {space}/setup.bash
        PYTHONPATH={ROOT}/tests/support:$PYTHONPATH /usr/bin/python3 - <<'END'
import tempfile
from pathlib import Path

import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray
from session import Session
from sensor_msgs.msg import CameraInfo

with tempfile.TemporaryDirectory() as folder, Session(Path(folder)) as session:
    session.start('nodes', ['roslaunch', 'openpose_ros_bringup', 'demo.launch'])
    session.start('depth', ['roslaunch', 'openpose_ros_bringup', 'nodelets.launch', 'cloud_to_depth:=true'])
    rospy.init_node('check_nodes_run', disable_signals=True)
    topic = '/openpose_ros/skeleton_3d/detected_poses_3d'
    message = rospy.wait_for_message(topic, PersonDetection_3dArray, timeout=60)
    assert message.pose_model in ('BODY_25', 'COCO_18') and message.persons, message
    rospy.wait_for_message('/kinect2/qhd/depth_registered/camera_info', CameraInfo, timeout=60)
END""", space.parent, environment)


def build_reader(space, environment, folder):
    """Build examples/reader.cpp in a package with the two dependencies that the page names."""
    package = folder / 'src/reader'
    (package / 'src').mkdir(parents=True)
    shutil.copy(str(ROOT / 'examples/reader.cpp'), str(package / 'src'))
    rules = """find_package(catkin REQUIRED COMPONENTS openpose_ros_msgs roscpp)
        catkin_package()
        include_directories(${catkin_INCLUDE_DIRS})
        add_executable(reader src/reader.cpp)
        target_link_libraries(reader ${catkin_LIBRARIES})"""
    dependencies = '<depend>openpose_ros_msgs</depend><depend>roscpp</depend>'
    (package / 'CMakeLists.txt').write_text(f'cmake_minimum_required(VERSION 3.0.2)\nproject({package.name})\n{rules}')
    (package / 'package.xml').write_text(f"""<package format="3">
        <name>{package.name}</name><version>0.0.0</version><description>Reads people.</description>
        <maintainer email="user@example.com">user</maintainer><license>none</license>
        <buildtool_depend>catkin</buildtool_depend>{dependencies}</package>""")
    shell(f'source {space}/setup.bash; catkin_make {SETTINGS}', folder, environment)
    assert (folder / 'devel/lib/reader/reader').is_file()


def test_catkin_make_in_the_checkout_with_its_install_space_inside(tmp_path, environment):
    checkout = copy_checkout(tmp_path / 'checkout')
    shell(f'catkin_make --source . -Dopenpose_ros_pkg_VENV={ROOT}/.venv install', checkout, environment)
    check_space(checkout / 'devel', environment)
    check_installed_files(checkout / 'install', environment)


def test_catkin_make_in_a_workspace(tmp_path, environment):
    copy_checkout(tmp_path / 'src/openpose_ros')
    shell(f'catkin_make {SETTINGS} -DCMAKE_INSTALL_PREFIX={tmp_path}/elsewhere/space install', tmp_path, environment)
    check_space(tmp_path / 'devel', environment)
    shutil.rmtree(str(tmp_path / 'src'))
    shutil.rmtree(str(tmp_path / 'devel'))
    check_space(tmp_path / 'elsewhere/space', environment)
    check_installed_files(tmp_path / 'elsewhere/space', environment)
    check_nodes_run(tmp_path / 'elsewhere/space', environment)
    build_reader(tmp_path / 'elsewhere/space', environment, tmp_path / 'user')


@pytest.mark.skipif(not this_system().packages_of('catkin-tools'), reason=f'{this_system().name} has no catkin-tools')
def test_catkin_build_in_a_workspace(tmp_path, environment):
    copy_checkout(tmp_path / 'src/openpose_ros')
    shell(f'catkin init; catkin config --cmake-args {SETTINGS}; catkin build --no-status', tmp_path, environment)
    check_space(tmp_path / 'devel', environment)
