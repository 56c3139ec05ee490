"""What each system gives by apt or conda; systems.ini has the names. The rest: locks/requirements*.in.

The dependencies of the packages are read from their package.xml files.
docs/install.md says on which of the systems what was run.
"""
import configparser
import shlex
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Dict, List, Mapping, Optional, Sequence, Set, Tuple

from development import CATKIN, CONDA, PACKAGES
from development.workspace import underlays

TABLE = configparser.ConfigParser(delimiters='=', interpolation=None)
TABLE.read(str(Path(__file__).with_suffix('.ini')))
ROS, OTHERS = dict(TABLE['ros']), dict(TABLE['others'])
TOOLS, OF_TESTS = (TABLE[name]['keys'].split() for name in ('tools', 'tests'))


@dataclass(frozen=True)
class System:
    """A system: where it differs from Debian bookworm."""

    name: str
    differs: Mapping[str, str] = field(default_factory=dict)
    ros: Optional[Path] = None  # prefix of ROS; None: that of Debian, where every program is
    distribution: str = ''  # of the ROS in the prefix: what its packages are named by; empty: it was built by the user

    def packages_of(self, key: str) -> List[str]:
        """Return the packages of a rosdep key; KeyError: the table lacks it."""
        if self.ros is None or key not in ROS:
            return self.differs.get(key, {**ROS, **OTHERS}[key]).split()
        is_there = (self.ros / 'share' / key / 'package.xml').is_file()
        return [] if is_there else [f"ros-{self.distribution}-{key.replace('_', '-')}"]


# By the VERSION_CODENAME of /etc/os-release, oldest first. The universe of Ubuntu 22.04 and 24.04 has Debian's ROS 1.
SYSTEMS = {
    'focal': System('Ubuntu 20.04 with ROS noetic', TABLE['focal'], Path('/opt/ros/noetic'), 'noetic'),
    'bullseye': System('Debian 11', TABLE['bullseye']),
    'jammy': System('Ubuntu 22.04', TABLE['jammy']),
    'bookworm': System('Debian 12'),
    'noble': System('Ubuntu 24.04', TABLE['noble']),
    'trixie': System('Debian 13'),
}
ROBOSTACK = System('RoboStack', TABLE['robostack'], Path('/'), 'noetic')
# In the order in which they are looked for: ROS One is the living one.
PREFIXES = (Path('/opt/ros/one'), Path('/opt/ros/noetic'))


def this_system() -> System:
    """Return the system of this machine; ValueError: it is none of those that are known, or like one of them."""
    if CONDA is not None:
        return replace(ROBOSTACK, ros=CONDA)
    return with_ros(system_of(Path('/etc/os-release').read_text()), [*underlays(), *PREFIXES])


def with_ros(system: System, prefixes: Sequence[Path]) -> System:
    """Return a system whose ROS is that of the first of these prefixes that has one, and never of Debian besides.

    Raises:
        ValueError: it lacks packages, and was built by the user, so that apt can not add them.
    """
    prefix = next((path for path in prefixes if (path / CATKIN).is_file()), system.ros)
    if prefix is None:
        return system
    distribution = prefix.name if prefix.parts[-3:-1] == ('opt', 'ros') else ''
    differs = {**TABLE['prefix'], **system.differs}
    system = replace(system, differs=differs, ros=prefix, distribution=distribution)
    lacking = [key for key in sorted(dependencies() | set(TOOLS)) if key in ROS and system.packages_of(key)]
    if lacking and not distribution:
        raise ValueError(f'the ROS in {prefix} lacks {", ".join(lacking)}; add them, or take it out of the terminal: '
                         'then the ROS of the system is used')
    return system


def system_of(os_release: str) -> System:
    """Return the system that an os-release file describes, with the ROS that apt brings.

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
    raise ValueError(f"{words.get('PRETTY_NAME', 'this system')} is not supported; supported are {names}; on others "
                     'RoboStack: conda env create --file environment.yml')


def _version(words: Mapping[str, str]) -> Tuple[float, ...]:
    """Return VERSION_ID as numbers; Debian testing and unstable have none and are newer than all."""
    return tuple(float(number) for number in words.get('VERSION_ID', 'inf').split('.'))


def dependencies() -> Set[str]:
    """Return the rosdep keys of everything that the package.xml files name, but for these packages themselves."""
    manifests = [ElementTree.parse(str(folder / 'package.xml')).getroot() for folder in PACKAGES.values()]
    return {str(child.text) for manifest in manifests for child in manifest if 'depend' in child.tag} - set(PACKAGES)


def needed_packages(system: System, tests: bool = False) -> Set[str]:
    """Return the names of all packages that apt or conda has to install, for the tests too or not."""
    keys = dependencies() | set(TOOLS) | set(OF_TESTS if tests else [])
    return {package for key in keys for package in system.packages_of(key)}
