"""Systems are told apart, and every dependency that a package.xml names has its packages on every system."""
import pytest

from development.systems import OTHERS, ROS, SYSTEMS, TOOLS, dependencies, needed_packages, system_of


@pytest.mark.parametrize('system', SYSTEMS.values(), ids=lambda system: system.name)
def test_the_table_has_every_dependency(system):
    assert {'rospy', 'pybind11-dev', 'python3-numpy'} <= dependencies()
    missing = {key for key in dependencies() | set(TOOLS) if key not in ROS and key not in OTHERS}
    assert not missing, 'add them to the table of development/systems.py'
    assert needed_packages(system)


@pytest.mark.parametrize('key, bookworm, bullseye, focal', [
    ('std_msgs', ['libstd-msgs-dev', 'python3-std-msgs', 'ros-std-msgs'],
     ['libstd-msgs-dev', 'python3-std-msgs', 'ros-std-msgs'], ['ros-noetic-std-msgs']),
    ('python3-numpy', ['python3-numpy'], ['python3-numpy'], ['python3-numpy']),
    ('catkin-tools', ['catkin-tools'], [], ['python3-catkin-tools'])])
def test_names_differ_between_systems(key, bookworm, bullseye, focal):
    assert SYSTEMS['bookworm'].packages_of(key) == bookworm
    assert SYSTEMS['bullseye'].packages_of(key) == bullseye
    assert SYSTEMS['focal'].packages_of(key) == focal


def test_an_unknown_dependency_is_an_error():
    with pytest.raises(KeyError, match='no_such_key'):
        SYSTEMS['bookworm'].packages_of('no_such_key')


@pytest.mark.parametrize('os_release, codename', [
    ('# a comment\nVERSION_ID="12"\nVERSION="12 (bookworm)"\nVERSION_CODENAME=bookworm\nID=debian', 'bookworm'),
    ('NAME="Ubuntu"\nVERSION_ID="20.04"\nID=ubuntu\nID_LIKE=debian\nVERSION_CODENAME=focal', 'focal'),
    # derivatives
    ('ID=linuxmint\nID_LIKE="ubuntu debian"\nVERSION_ID="22"\nVERSION_CODENAME=wilma\nUBUNTU_CODENAME=noble', 'noble'),
    ('ID=linuxmint\nID_LIKE=debian\nVERSION_ID="6"\nVERSION_CODENAME=faye\nDEBIAN_CODENAME=bookworm', 'bookworm'),
    # newer than the table: testing has no number
    ('ID=debian\nVERSION_CODENAME=forky', 'trixie'),
    ('ID=ubuntu\nVERSION_ID="26.04"\nVERSION_CODENAME=resolute', 'trixie')])
def test_a_system_is_known_by_its_os_release(os_release, codename):
    assert system_of(os_release) is SYSTEMS[codename]


@pytest.mark.parametrize('os_release', [
    '', 'ID=debian\nVERSION_ID="10"\nVERSION_CODENAME=buster', 'ID=ubuntu\nVERSION_ID="23.10"\nVERSION_CODENAME=mantic',
    'ID=fedora\nVERSION_ID=42\nPRETTY_NAME="Fedora Linux 42"'])
def test_another_system_is_refused_with_the_names_of_those_that_are_supported(os_release):
    with pytest.raises(ValueError, match=r'(this system|Fedora Linux 42) is not supported; supported are .*Debian 13'):
        system_of(os_release)
