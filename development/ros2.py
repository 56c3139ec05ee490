"""./run ros2 FOLDER: the package openpose_ros_msgs for ROS 2, with the mapping rules of ros1_bridge.

ROS 2 has names of messages without '_', and names of fields without capitals. Rules: ros1_bridge, doc/index.rst; names:
rosidl_adapter, parser.py.
"""
import re
from pathlib import Path
from typing import Dict, Sequence

from development import PACKAGES
from development.terminal import die, say

NAME = 'openpose_ros_msgs'
DEPENDENCIES = ('builtin_interfaces', 'geometry_msgs', 'sensor_msgs', 'std_msgs')
RULES = 'ros1_bridge_rules.yaml'
_FIELD = re.compile(r'^([A-Za-z][\w/]*)((?:\[\d*\])?) +(\w+)(?! *=)\b(?! *=)', re.MULTILINE)
_CMAKE = """cmake_minimum_required(VERSION 3.8)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{finds}
rosidl_generate_interfaces({name} {files} DEPENDENCIES {dependencies})
install(FILES {rules} DESTINATION share/{name})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""
_EXPORTS = f"""  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  {{depends}}
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export>
    <build_type>ament_cmake</build_type>
    <ros1_bridge mapping_rules="{RULES}"/>
  </export>
</package>
"""


def write_ros2(arguments: Sequence[str]) -> None:
    if len(arguments) != 1:
        die('usage: ./run ros2 FOLDER, such as ~/ros2_ws/src')
    folder = Path(arguments[0]).expanduser() / NAME
    for name, text in package_of_ros2().items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    say(f'{folder}: colcon build it, then ros1_bridge beside it (docs/recordings.md)')


def package_of_ros2() -> Dict[str, str]:
    """Return the files of the package by name."""
    source, files, rules = PACKAGES[NAME], {}, []
    for path in sorted([*source.glob('msg/*.msg'), *source.glob('srv/*.srv')]):
        text, name = path.read_text(), ros2_name(path.stem)
        files[f'{path.suffix[1:]}/{name}{path.suffix}'] = _FIELD.sub(_field_of_ros2, text)
        if path.suffix == '.msg':
            pairs = ''.join(f"\n    {field}: '{field.lower()}'" for _, _, field in _FIELD.findall(text))
            rules.append(f"- ros1_package_name: '{NAME}'\n  ros1_message_name: '{path.stem}'\n  ros2_package_name: "
                         f"'{NAME}'\n  ros2_message_name: '{name}'\n  fields_1_to_2:{pairs}\n")
    manifest = (source / 'package.xml').read_text()
    depends = '\n  '.join(f'<depend>{name}</depend>' for name in DEPENDENCIES)
    head = re.split(r' *<buildtool_depend', manifest, maxsplit=1)[0]
    return {**files, RULES: '\n'.join(rules), 'package.xml': head + _EXPORTS.format(depends=depends),
            'CMakeLists.txt': _CMAKE.format(name=NAME, files=' '.join(f'"{name}"' for name in files), rules=RULES,
                                            finds='\n'.join(f'find_package({name} REQUIRED)' for name in DEPENDENCIES),
                                            dependencies=' '.join(DEPENDENCIES)),
            'LICENSE': (source / 'LICENSE').read_text()}


def ros2_name(message: str) -> str:
    return message.replace('_3d', '3d')


def _field_of_ros2(field: 're.Match[str]') -> str:
    kind, array, name = field.groups()
    kind = {'time': 'builtin_interfaces/Time', 'duration': 'builtin_interfaces/Duration'}.get(kind, kind)
    return f'{kind if "/" in kind else ros2_name(kind)}{array} {name.lower()}'
