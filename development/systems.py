"""What each operating system gives by apt; systems.ini has the names. The rest: locks/requirements*.in.

The dependencies of the packages are read from their package.xml files.
docs/install.md says on which of the systems what was run.
"""
import configparser
import shlex
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List, Mapping, Optional, Set, Tuple

from development import PACKAGES

TABLE = configparser.ConfigParser(delimiters='=', interpolation=None)
TABLE.read(str(Path(__file__).with_suffix('.ini')))
ROS, OTHERS = dict(TABLE['ros']), dict(TABLE['others'])
TOOLS = TABLE['tools']['keys'].split()


@dataclass(frozen=True)
class System:
    """An operating system: where it differs from Debian bookworm."""

    name: str
    differs: Mapping[str, str] = field(default_factory=dict)
    ros_setup: Optional[Path] = None  # None: ROS is where every program is

    def packages_of(self, key: str) -> List[str]:
        """Return the packages of a rosdep key; KeyError: the table lacks it."""
        return self.differs.get(key, {**ROS, **OTHERS}[key]).split()


_NOETIC = {**{key: f"ros-noetic-{key.replace('_', '-')}" for key in ROS}, **TABLE['focal']}
# By the VERSION_CODENAME of /etc/os-release, oldest first. The universe of Ubuntu 22.04 and 24.04 has Debian's ROS 1.
SYSTEMS = {
    'focal': System('Ubuntu 20.04 with ROS noetic', _NOETIC, Path('/opt/ros/noetic/setup.bash')),
    'bullseye': System('Debian 11', TABLE['bullseye']),
    'jammy': System('Ubuntu 22.04', TABLE['jammy']),
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
