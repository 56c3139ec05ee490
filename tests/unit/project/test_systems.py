"""Every dependency that a package.xml names has its packages on every system."""
import pytest

from development.systems import BOOKWORM, NOETIC, OTHERS, ROS, TOOLS, dependencies, needed_packages

SYSTEMS = pytest.mark.parametrize('system', [BOOKWORM, NOETIC], ids=lambda system: system.name)


def test_the_packages_depend_on_something():
    assert {'rospy', 'sensor_msgs', 'pybind11-dev', 'python3-numpy'} <= dependencies()
    assert 'openpose_ros_msgs' not in dependencies()


@SYSTEMS
def test_the_table_has_every_dependency(system):
    missing = {key for key in dependencies() | set(TOOLS) if key not in ROS and key not in OTHERS}
    assert not missing, 'add them to the table of development/systems.py'
    assert needed_packages(system)


@pytest.mark.parametrize('key, bookworm, noetic', [
    ('std_msgs', ['libstd-msgs-dev', 'python3-std-msgs', 'ros-std-msgs'], ['ros-noetic-std-msgs']),
    ('cv_bridge', ['python3-cv-bridge'], ['ros-noetic-cv-bridge']),
    ('python3-numpy', ['python3-numpy'], ['python3-numpy']),
    ('python3-distributed', ['python3-distributed'], [])])
def test_names_differ_between_systems(key, bookworm, noetic):
    assert BOOKWORM.packages_of(key) == bookworm
    assert NOETIC.packages_of(key) == noetic


def test_an_unknown_dependency_is_an_error():
    with pytest.raises(KeyError, match='no_such_key'):
        BOOKWORM.packages_of('no_such_key')
