"""Refuse misspelt arguments of launch files, which roslaunch ignores.

A launch file runs this while roslaunch loads it, with its own path and those of the files that it includes with
pass_all_args:

    <param name="openpose_ros/launched/people" command="$(find openpose_ros_pkg)/scripts/check_arguments FILE ..."/>

The command line of roslaunch is that of the parent process. Exit status 1 makes roslaunch give up. What is printed,
and so the value of the parameter, is the command line; nothing where roslaunch was started with another file.
"""
import argparse
import difflib
import os
import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Dict, List, Sequence

_SWITCH = ('true', 'false', '1', '0', '')


def declared_arguments(files: Sequence[Path]) -> Dict[str, str]:
    """Return the arguments of launch files that can be given, with their defaults."""
    return {element.attrib['name']: element.attrib.get('default', '') for path in reversed(files)
            for element in _elements(path, 'arg') if 'value' not in element.attrib}


def checked_files(path: Path) -> List[Path]:
    """Return the files whose arguments a launch file takes: those that it has checked; else itself."""
    commands = (element.get('command', '') for element in _elements(path, 'param'))
    names = next((re.findall(r'([\w]+\.launch)', command) for command in commands if '/check_arguments' in command), [])
    return [path.resolve().parent / name for name in names] or [path]


def listing(path: Path) -> str:
    """Return the arguments of a launch file with their meaning and default."""
    elements = {element.attrib['name']: element for file in reversed(checked_files(path))
                for element in _elements(file, 'arg') if 'value' not in element.attrib}
    return ''.join(f'  {name + ":=":<18}{element.get("doc", "")}{_default_of(element)}\n'
                   for name, element in elements.items())


def _default_of(element: ElementTree.Element) -> str:
    default = element.get('default', '')
    return f' ({default})' if default and '$' not in default else ''


def _elements(path: Path, tag: str) -> List[ElementTree.Element]:
    return ElementTree.parse(str(path)).getroot().findall(tag)  # noqa: S314


def starts(command: Sequence[str], path: Path) -> bool:
    """Whether a command line is that of roslaunch with this launch file alone."""
    if not any(Path(word).name == 'roslaunch' for word in command[:3]):
        return False
    named = [word for word in command if word.endswith('.launch') and ':=' not in word]
    return len(named) == 1 and (Path(named[0]).resolve() == path.resolve() or (
        named[0] == path.name and command[command.index(named[0]) - 1] == path.resolve().parents[1].name))


def mistakes(given: Dict[str, str], declared: Dict[str, str]) -> List[str]:
    """Return what is wrong with arguments of a launch file, each with what may be meant."""
    found = []
    for name, value in given.items():
        if name not in declared:
            similar = difflib.get_close_matches(name, declared, 1, 0.5)
            found.append(f"there is no argument '{name}'" + (f"; do you mean '{similar[0]}'?" if similar else '')
                         + ('; parameters are set by config:=FILE with NODE: {NAME: VALUE}, and CHANGELOG.rst names '
                            'what took the place of arguments') * ('config' in declared))
        elif declared[name] in ('true', 'false') and value.lower() not in _SWITCH:
            found.append(f"'{name}:={value}' is not allowed: true or false")
        elif name == 'config' and value and not _is_by_node(value):
            found.append(f"'config:={value}' is no YAML file of parameters by node, such as\n"
                         '  skeleton_extract_3d_node: {mode: fast}')
    return found


def _is_by_node(path: str) -> bool:
    try:
        from openpose_ros_pkg.errors import BadInputError
        from openpose_ros_pkg.structured_text import file_values
    except ImportError:  # the system's Python has no PyYAML where ROS has another one
        return True
    try:
        content = file_values(Path(path), path)
    except BadInputError:
        return False
    return isinstance(content, dict) and all(isinstance(value, dict) for value in content.values())


def main() -> int:
    """Check the command line of the parent process and return the exit status."""
    parser = argparse.ArgumentParser(prog='check_arguments', description='Called by launch files, with their paths.')
    parser.add_argument('files', nargs='+', type=Path, metavar='FILE')
    files = parser.parse_args().files
    command = Path(f'/proc/{os.getppid()}/cmdline').read_bytes().decode(errors='replace').split('\0')[:-1]
    if not starts(command, files[0]):
        return 0
    words = [word for word in command if ':=' in word and not word.startswith('_')]  # _: of ROS, as __log
    declared = declared_arguments(files)
    given = {name: value for name, _, value in (word.partition(':=') for word in words)}
    wrong = mistakes(given, declared)
    if wrong:
        sys.stderr.write(f'{files[0].name}: ' + '\n'.join(wrong) + f'\n  its arguments: {" ".join(declared)}\n')
        return 1
    sys.stdout.write(' '.join([files[0].name, *words]))
    return 0
