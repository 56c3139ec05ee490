"""package.xml says what the code really uses, and the names at the top lead into the packages."""
import re
import xml.etree.ElementTree as ElementTree

import pytest
import yaml

from development import PACKAGES, ROOT
from imports import imported_modules

# Modules that are named otherwise than the rosdep key that brings them. OpenVINO has none; ./run setup
# brings it.
ROSDEP_KEYS = {'cv2': 'python3-opencv', 'jinja2': 'python3-jinja2', 'matplotlib': 'python3-matplotlib',
               'numpy': 'python3-numpy', 'pandas': 'python3-pandas', 'rospkg': 'python3-rospkg',
               'scipy': 'python3-scipy', 'toml': 'python3-toml', 'tqdm': 'python3-tqdm', 'yaml': 'python3-yaml'}
ROS_MODULES = {'cv_bridge', 'diagnostic_updater', 'dynamic_reconfigure', 'genpy', 'message_filters', 'rosbag',
               'rosgraph', 'roslib', 'rospy', 'tf2_py', 'tf2_ros'}
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
    assert depends(package, 'exec_depend', 'depend') == used_by_code(package)


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
    assert root.find('url[@type="website"]').text.startswith('https://')
    licence = root.find('license')
    assert licence.text == 'Apache-2.0'
    assert (PACKAGES[package] / licence.get('file')).read_bytes() == (ROOT / 'LICENSE').read_bytes()
    assert re.search(r'^install\(FILES LICENSE ', (PACKAGES[package] / 'CMakeLists.txt').read_text(), re.MULTILINE)


@pytest.mark.parametrize('package', PACKAGES)
def test_changelog_has_the_form_of_rep_132_and_the_version_of_the_manifests(package):
    text = (PACKAGES[package] / 'CHANGELOG.rst').read_text()
    title = f'Changelog for package {package}'
    bar = '^' * len(title)
    assert text.startswith(f'{bar}\n{title}\n{bar}\n\n')
    sections = re.findall(r'\n\n(\S.*)\n-+\n\* ', text)
    assert text.count('\n---') == len(sections), 'a section has a title, a line below it, and entries'
    assert all(re.fullmatch(r'\d+\.\d+\.\d+ \(\d{4}-\d\d-\d\d\)', section) for section in sections[1:])
    released = [section.split()[0] for section in sections if section != 'Forthcoming']
    assert {*released[:1]} <= {manifest(name).find('version').text for name in PACKAGES}, 'a new package has no release'


def test_the_launch_files_at_the_top_are_those_of_the_packages():
    files = {path.name: path for package in PACKAGES for path in (PACKAGES[package] / 'launch').glob('*.launch')}
    links = {path.name: path.resolve() for path in (ROOT / 'launch').iterdir()}
    assert links.items() <= files.items()


@pytest.mark.parametrize('link, target', [
    ('msg', 'openpose_ros_msgs/msg'), ('srv', 'openpose_ros_msgs/srv'),
    *((f'tests/{package}', f'{PACKAGES[package]}/test') for package in PYTHON_PACKAGES)])
def test_names_at_the_top_lead_into_the_packages(link, target):
    assert (ROOT / link).resolve() == ROOT / target
