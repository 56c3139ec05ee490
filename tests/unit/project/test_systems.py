"""Systems are told apart, and every dependency that a package.xml names has its packages on every system."""
import re
import shutil
import subprocess
from dataclasses import replace

import pytest

from development import CATKIN, ROOT
from development.systems import (
    OTHERS,
    ROBOSTACK,
    ROS,
    SYSTEMS,
    TOOLS,
    dependencies,
    needed_packages,
    system_of,
    with_ros,
)

OF_DEBIAN = {name for names in ROS.values() for name in names.split()} | {'catkin-lint', 'catkin-tools'}


@pytest.fixture
def make_prefix(tmp_path):
    """Return a function that makes a folder stand for a prefix with ROS and these packages."""
    def make(path, packages=()):
        prefix = tmp_path / path
        for file in (CATKIN, *(f'share/{name}/package.xml' for name in packages)):
            (prefix / file).parent.mkdir(parents=True, exist_ok=True)
            (prefix / file).touch()
        return prefix
    return make


@pytest.mark.parametrize('system', SYSTEMS.values(), ids=lambda system: system.name)
def test_the_table_has_every_dependency(system):
    assert {'rospy', 'pybind11-dev', 'python3-numpy'} <= dependencies()
    missing = {key for key in dependencies() | set(TOOLS) if key not in ROS and key not in OTHERS}
    assert not missing, 'add them to the table of development/systems.py'
    assert needed_packages(system)


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


@pytest.mark.parametrize('name', ['jammy', 'noble', 'bookworm'])
def test_ros_one_takes_the_place_of_the_ros_of_the_system(name, make_prefix):
    """Debian's and Ubuntu's own packages of ROS are never mixed with those of a prefix."""
    prefix = make_prefix('opt/ros/one', ['catkin', 'rospy'])
    system = with_ros(SYSTEMS[name], [prefix.with_name('none'), prefix, make_prefix('opt/ros/noetic')])
    assert system.ros == prefix
    assert system.packages_of('rospy') == [], 'it is there'
    assert system.packages_of('cv_bridge') == ['ros-one-cv-bridge']
    assert system.packages_of('python3-numpy') == ['python3-numpy']
    needed = needed_packages(system)
    assert needed & OF_DEBIAN == set()
    assert {'ros-one-nodelet', 'python3-opencv', 'libpcl-dev'} <= needed
    assert with_ros(SYSTEMS[name], []) is SYSTEMS[name]


def test_ros_that_the_user_built_has_to_be_whole(make_prefix):
    """Of a workspace that was built from source, and is sourced: apt can not add to it."""
    with pytest.raises(ValueError, match=r'the ROS in .*/built/install lacks actionlib, actionlib_msgs, .*; add them'):
        with_ros(SYSTEMS['bookworm'], [make_prefix('built/install')])
    system = with_ros(SYSTEMS['bookworm'], [make_prefix('built/install', ROS)])
    assert needed_packages(system) == {name for key in (dependencies() | set(TOOLS)) & set(OTHERS)
                                       for name in OTHERS[key].split()} - OF_DEBIAN


def test_the_environment_of_robostack_names_what_is_needed():
    text = (ROOT / 'environment.yml').read_text()
    named = re.findall(r'^  - ([\w-]+)(?:=[\d.]+)?$', text[text.index('dependencies:'):], re.MULTILINE)
    assert named == sorted(needed_packages(ROBOSTACK)), 'with the names of development/systems.ini'
    assert not [name for name in named if name.startswith(('lib', 'ros-')) and name.endswith('-dev')], 'of apt'


@pytest.fixture
def conda(make_prefix):
    """Stand for a conda environment of RoboStack, with all that environment.yml names but cmake."""
    prefix = make_prefix('conda', ROS)
    for folder, name, text in [('bin', 'python3', '#!/bin/sh\nexec /usr/bin/python3 "$@"\n'),
                               *(('conda-meta', f'{name}-1.0-h1_0.json', '')
                                 for name in needed_packages(replace(ROBOSTACK, ros=prefix)) - {'cmake'})]:
        (prefix / folder).mkdir(exist_ok=True)
        (prefix / folder / name).write_text(text)
        (prefix / folder / name).chmod(0o755)
    return prefix


PROGRAM = f"""
import os, sys
sys.path.insert(0, '{ROOT}')
from development import CONDA, PYTHON
print(PYTHON, CONDA, os.environ.get('PYTHONPATH'), os.environ['PATH'].split(':')[0], os.environ.get('CC'))
"""


@pytest.fixture
def run_in(tmp_path):
    """Return a function that calls a ./run in a conda environment and returns what it prints."""
    (tmp_path / 'development').mkdir()
    (tmp_path / 'development/__main__.py').write_text(PROGRAM)
    shutil.copy(str(ROOT / 'run'), str(tmp_path))

    def call(prefix, *command):
        return subprocess.run(command, env={'PATH': '/usr/bin:/bin', 'CONDA_PREFIX': str(prefix), 'CC': 'conda-cc',
                                            'PYTHONPATH': '/of/the/user'}, cwd=str(tmp_path), stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, check=False).stdout
    return call


def test_robostack_uses_its_python_and_installs_nothing_by_apt(conda, run_in):
    missing = run_in(conda, str(ROOT / 'run'), 'setup', '--no-build')
    assert f'{conda} lacks cmake; add them: conda env update --file {ROOT}/environment.yml' in missing
    assert run_in(conda, './run', 'any').split() == [
        f'{conda}/bin/python3', str(conda), 'None', f'{conda}/bin', 'conda-cc']


def test_another_conda_environment_is_hidden_from_ros(tmp_path, run_in):
    assert run_in(tmp_path, './run', 'any').split() == ['/usr/bin/python3', 'None', 'None', '/usr/sbin', 'None']
