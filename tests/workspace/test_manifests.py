"""package.xml says what the code really uses, and what releases by bloom and builds of distributions need."""
import re
import xml.etree.ElementTree as ElementTree

import pytest
import yaml
from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import parse_package
from catkin_pkg.packages import find_packages, verify_equal_package_versions

from development import PACKAGES, ROOT
from imports import imported_modules

# Modules that are named otherwise than the rosdep key that brings them. OpenVINO has none; ./run setup
# brings it.
ROSDEP_KEYS = {'cv2': 'python3-opencv', 'matplotlib': 'python3-matplotlib',
               'numpy': 'python3-numpy', 'pandas': 'python3-pandas', 'rospkg': 'python3-rospkg',
               'scipy': 'python3-scipy', 'toml': 'python3-toml', 'tornado': 'python3-tornado',
               'tqdm': 'python3-tqdm', 'yaml': 'python3-yaml'}
ROS_MODULES = {'cv_bridge', 'diagnostic_updater', 'dynamic_reconfigure', 'genpy', 'message_filters', 'rosbag',
               'rosgraph', 'roslib', 'rospy', 'tf2_py', 'tf2_ros'}
# openpose_models makes an environment to fetch weights with; camera_driver becomes roslaunch; people_cloud is C++;
# distributed needs jinja2.
CALLED = {'openpose_ros_pkg': {'python3-venv'}, 'openpose_ros_bringup': {'rosbag', 'roslaunch'},
          'openpose_ros_nodelets': {'diagnostic_updater', 'libpcl-all', 'message_filters', 'nodelet',
                                    'nodelet_topic_tools', 'openpose_ros_msgs', 'pluginlib', 'roscpp'},
          'openpose_ros_tools': {'python3-jinja2'}}
PYTHON_PACKAGES = [name for name, folder in PACKAGES.items() if (folder / 'setup.py').is_file()]


def manifest(package):
    return ElementTree.parse(str(PACKAGES[package] / 'package.xml')).getroot()


def depends(package, *kinds):
    return {element.text for kind in kinds for element in manifest(package).iter(kind)}


def used_by_code(package):
    """rosdep keys of everything that the package's programs import or its launch files start."""
    modules = {name.split('.')[0]
               for path in [*(PACKAGES[package] / 'src').rglob('*.py'), *(PACKAGES[package]).glob('scripts/*')]
               for name in imported_modules(path.read_text(), package)}
    keys = {ROSDEP_KEYS.get(name, name) for name in modules
            if name in ROSDEP_KEYS or name in ROS_MODULES or name in PACKAGES or name.endswith(('_msgs', '_srvs'))}
    for path in (PACKAGES[package] / 'src').rglob('*.py'):
        keys |= set(re.findall(r"Popen\(\['rosrun', '(\w+)'", path.read_text()))
    for path in (PACKAGES[package] / 'launch').glob('*.launch'):
        keys |= set(re.findall(r'(?:pkg="|\$\(find )(\w+)', path.read_text()))
    return keys - {package}


@pytest.mark.parametrize('package', PYTHON_PACKAGES)
def test_run_time_dependencies_are_those_of_the_code(package):
    assert depends(package, 'exec_depend', 'depend') == used_by_code(package) | CALLED.get(package, set())


def test_message_dependencies_are_those_of_the_messages():
    text = ''.join(path.read_text() for path in (ROOT / 'openpose_ros_msgs').glob('*/*.[ms][sr][gv]'))
    assert depends('openpose_ros_msgs', 'depend') == set(re.findall(r'^(\w+)/\w+ ', text, re.MULTILINE))


def test_rosdep_knows_every_key():
    """catkin_lint checks that only where it finds rosdep's database."""
    known = yaml.safe_load((ROOT / 'tests/workspace/rosdep_keys.yaml').read_text())
    named = {child.text for package in PACKAGES for child in manifest(package) if child.tag.endswith('depend')}
    assert named - set(PACKAGES) <= {key for keys in known.values() for key in keys}


@pytest.mark.parametrize('package', PACKAGES)
def test_manifest_says_who_maintains_the_package_and_under_which_licence(package):
    root = manifest(package)
    assert root.get('format') == '3'
    assert root.find('name').text == package
    for role in ('maintainer', 'author'):
        assert re.fullmatch(r'[\w.+-]+@[\w-]+(\.[\w-]+)+(?<!\.invalid)', root.find(role).get('email'))
    licence = root.find('license')
    assert licence.text == 'Apache-2.0'
    assert (PACKAGES[package] / licence.get('file')).read_bytes() == (ROOT / 'LICENSE').read_bytes()
    rules = (PACKAGES[package] / 'CMakeLists.txt').read_text()
    assert re.search(r'^(install\(FILES LICENSE |catkin_metapackage\(\)$)', rules, re.MULTILINE)


def test_the_metapackage_has_every_package():
    assert depends('openpose_ros', 'exec_depend') == set(PACKAGES) - {'openpose_ros'}


@pytest.mark.parametrize('package', PACKAGES)
def test_running_needs_no_headers(package):
    """On distributions that split packages, what is for compilers alone is not installed with the programs."""
    assert not [key for key in depends(package, 'exec_depend', 'depend') if key.endswith('-dev')]


def test_the_core_runs_without_rviz():
    """A robot has no screen: launch files that show people are in openpose_ros_bringup."""
    assert {package for package in PACKAGES if 'rviz' in depends(package, 'exec_depend', 'depend')} == {
        'openpose_ros_bringup'}


def test_packages_can_be_released_together():
    """What bloom asks of a repository: its parser finds no fault, and all versions are equal."""
    warnings = []
    for folder in PACKAGES.values():
        parse_package(str(folder), warnings=warnings)
    assert not warnings
    found = find_packages(str(ROOT), exclude_subspaces=True)
    assert {package.name for package in found.values()} == set(PACKAGES)
    verify_equal_package_versions(found.values())


@pytest.mark.parametrize('package', PACKAGES)
def test_changelog_has_the_form_of_rep_132_and_the_version_of_the_manifests(package):
    text = (PACKAGES[package] / 'CHANGELOG.rst').read_text()
    title = f'Changelog for package {package}'
    bar = '^' * len(title)
    assert text.startswith(f'{bar}\n{title}\n{bar}\n\n')
    sections = re.findall(r'\n\n(\S.*)\n-+\n\* ', text)
    assert text.count('\n---') == len(sections), 'a section has a title, a line below it, and entries'
    versions = [version for version, _, _ in get_changelog_from_path(str(PACKAGES[package])).foreach_version()]
    assert len(versions) == len(sections) - (sections[0] == 'Forthcoming'), 'each has a version and a date'
    assert versions[-1:] in ([], [manifest(package).find('version').text]), 'none: the package was never released'
