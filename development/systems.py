"""What each operating system gives by apt; the only place that knows. The rest: locks/requirements*.in.

The dependencies of the packages are read from their package.xml files, the tables say what they are called here.
docs/support.md says on which of the systems what was run.
"""
import shlex
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List, Mapping, Optional, Set, Tuple

from development import PACKAGES

FROM_PYPI = ''
NOT_THERE = ''

# rosdep key: packages of Debian bookworm
ROS = {key: f"python3-{key.replace('_', '-')}" for key in (
    'cv_bridge', 'diagnostic_msgs', 'dynamic_reconfigure', 'genpy', 'rosgraph',
    'rosgraph_msgs', 'roslaunch', 'roslib', 'rosmaster', 'rosmsg', 'rosnode', 'rosparam', 'rospy', 'rosservice',
    'rostopic', 'tf2_msgs')}
ROS.update({
    'catkin': 'catkin',
    'diagnostic_updater': 'libdiagnostic-updater-dev python3-diagnostic-updater',
    'geometry_msgs': 'libgeometry-msgs-dev python3-geometry-msgs ros-geometry-msgs',
    'image_transport': 'libimage-transport-dev',
    'message_filters': 'libmessage-filters-dev python3-message-filters',
    'message_generation': 'ros-message-generation',
    'message_runtime': 'ros-message-runtime',
    'nodelet': 'libnodelet-dev libnodeletlib-dev libnodeletlib-tools',
    'nodelet_topic_tools': 'libnodelet-topic-tools-dev',
    'pcl_msgs': 'libpcl-msgs-dev python3-pcl-msgs ros-pcl-msgs',
    'pluginlib': 'pluginlib-dev',
    'ros_environment': 'ros-environment',
    'rosbag': 'librosbag-dev python3-rosbag',
    'rosbash': 'rosbash',
    'roscpp': 'libroscpp-dev',
    'rosout': 'rosout',
    'rospack': 'rospack-tools',
    'rostest': 'librostest-dev python3-rostest',
    'rviz': 'rviz',
    'sensor_msgs': 'libsensor-msgs-dev python3-sensor-msgs ros-sensor-msgs',
    'std_msgs': 'libstd-msgs-dev python3-std-msgs ros-std-msgs',
    'std_srvs': 'libstd-srvs-dev python3-std-srvs ros-std-srvs',
    'tf2_geometry_msgs': 'libtf2-geometry-msgs-dev python3-tf2-geometry-msgs',
    'tf2_py': 'python3-tf2',
    'tf2_ros': 'libtf2-ros-dev python3-tf2-ros tf2-tools',
    'visualization_msgs': 'libvisualization-msgs-dev python3-visualization-msgs ros-visualization-msgs',
})
OTHERS = {name: name for name in (
    'ca-certificates', 'catkin-lint', 'catkin-tools', 'cmake', 'g++', 'make', 'pybind11-dev', 'python3', 'python3-dev',
    'python3-jinja2', 'python3-matplotlib', 'python3-numpy', 'python3-opencv', 'python3-pandas', 'python3-psutil',
    'python3-rospkg', 'python3-scipy', 'python3-setuptools', 'python3-tqdm', 'python3-venv', 'python3-yaml', 'scrot',
    'shellcheck', 'xvfb')}
OTHERS.update({'gtest': 'libgtest-dev', 'libpcl-all-dev': 'libpcl-dev', 'python3-hypothesis': FROM_PYPI,
               'python3-pytest': FROM_PYPI})

# What builds, demonstrates and tests beside what the package.xml files name.
# ros_environment: its hook sets ROS_PACKAGE_PATH; up to Debian 12 others bring it.
TOOLS = ('ca-certificates', 'catkin-lint', 'catkin-tools', 'cmake', 'g++', 'make', 'python3',
         'python3-psutil', 'python3-venv', 'ros_environment', 'rosbash', 'roslaunch', 'rosmaster', 'rosmsg',
         'rosnode', 'rosout', 'rospack', 'rosparam', 'rosservice', 'rostest', 'rostopic', 'scrot',
         'shellcheck', 'xvfb')


@dataclass(frozen=True)
class System:
    """An operating system: where it differs from Debian bookworm."""

    name: str
    differs: Mapping[str, str] = field(default_factory=dict)
    ros_setup: Optional[Path] = None  # None: ROS is where every program is

    def packages_of(self, key: str) -> List[str]:
        """Return the packages of a rosdep key; KeyError: the table lacks it."""
        return self.differs.get(key, {**ROS, **OTHERS}[key]).split()


_OF_2021 = {'catkin-tools': NOT_THERE}
_NOETIC = {**{key: f"ros-noetic-{key.replace('_', '-')}" for key in ROS},
           'catkin-lint': 'python3-catkin-lint', 'catkin-tools': 'python3-catkin-tools'}
# By the VERSION_CODENAME of /etc/os-release, oldest first. The universe of Ubuntu 22.04 and 24.04 has Debian's ROS 1.
SYSTEMS = {
    'focal': System('Ubuntu 20.04 with ROS noetic', _NOETIC, Path('/opt/ros/noetic/setup.bash')),
    'bullseye': System('Debian 11', _OF_2021),
    'jammy': System('Ubuntu 22.04', _OF_2021),
    'bookworm': System('Debian 12'),
    'noble': System('Ubuntu 24.04'),
    'trixie': System('Debian 13'),
}


def this_system() -> System:
    """Return the system of this machine; ValueError: it is none of those that are known, or like one of them."""
    return system_of(Path('/etc/os-release').read_text())


def system_of(os_release: str) -> System:
    """Return the system that an os-release file describes.

    A derivative is what it names as the base (UBUNTU_CODENAME, DEBIAN_CODENAME). A Debian or Ubuntu that is newer than
    those of the table is taken as the newest of the table.
    """
    words: Dict[str, str] = dict(word.split('=', 1) for word in shlex.split(os_release, comments=True) if '=' in word)
    for name in ('VERSION_CODENAME', 'UBUNTU_CODENAME', 'DEBIAN_CODENAME'):
        if words.get(name) in SYSTEMS:
            return SYSTEMS[words[name]]
    if _version(words) > {'debian': (13,), 'ubuntu': (24, 4)}.get(words.get('ID', ''), (float('inf'),)):
        return SYSTEMS['trixie']
    names = ', '.join(system.name for system in SYSTEMS.values())
    raise ValueError(f"{words.get('PRETTY_NAME', 'this system')} is not supported; supported are {names}")


def _version(words: Mapping[str, str]) -> Tuple[float, ...]:
    """Return VERSION_ID as numbers; Debian testing and unstable have none and are newer than all."""
    return tuple(float(number) for number in words.get('VERSION_ID', 'inf').split('.'))


def dependencies() -> Set[str]:
    """Return the rosdep keys of everything that the package.xml files name, but for these packages themselves."""
    manifests = [ElementTree.parse(str(folder / 'package.xml')).getroot() for folder in PACKAGES.values()]
    return {str(child.text) for manifest in manifests for child in manifest if 'depend' in child.tag} - set(PACKAGES)


def needed_packages(system: System) -> Set[str]:
    """Return the names of all packages that apt has to install."""
    return {package for key in dependencies() | set(TOOLS) for package in system.packages_of(key)}
