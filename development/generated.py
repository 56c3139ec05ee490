"""Files written from the code: config/*.yaml, tables in joints.h and docs/ros_api.md, development/notes/faults.md."""
import importlib
import json
import re
import sys
import textwrap
from pathlib import Path
from typing import Any, Iterable, List, Sequence, Tuple

from development import PACKAGES, PYTHON_SOURCES, ROOT
from development.results import write_results
from development.terminal import say

FAULTS = ROOT / 'development/notes/faults.md'
FAULTS_HEAD = """# Faults that are injected

Written by `./run docs` from the cases of `tests/faults`; [reliability](../../docs/reliability.md) says what the suite
checks. A node is `CHAIN/NODE` of `tests/faults/rig.py`; what comes of a fault is a counter and text of `/diagnostics`.

"""
ROS_API = ROOT / 'docs/ros_api.md'
# Parameters that most users set, and that some do; all others are seldom set. Of all nodes, so that a name means one.
_ALWAYS = frozenset((
    'camera', 'camera_topic', 'cameras', 'fixed_frame', 'folder', 'mode', 'planning_frame', 'rig', 'robot_links',
    'source', 'target_rate'))
_SOMETIMES = frozenset((
    'camera_info_file', 'camera_ns', 'class_id', 'colour_by_person', 'crop_model', 'dimensions', 'display', 'face',
    'frame_id', 'gravity_frame', 'guard', 'guard_range', 'hands', 'horizon', 'host', 'image_topic', 'image_transport',
    'joint_min_score', 'label', 'loop', 'peak_threshold', 'person_min_score', 'persons', 'playback', 'points_source',
    'pose_model', 'probability', 'publish_tf', 'rate', 'rectified', 'rgb_cameras', 'robot_frame', 'robot_radius',
    'room_velocities', 'rotate_image', 'summary', 'target_frame', 'targets', 'track_timeout', 'tracking_frame',
    'use_floor', 'use_landmarks', 'write_images', 'write_joint_set', 'write_json', 'write_video', 'zones'))
JOINTS_H = ROOT / 'openpose_ros_msgs/include/openpose_ros_msgs/joints.h'
CONFIG_MODULES = ('openpose_ros_pkg.params.nodes', 'skeleton_extract_3d.node_params', 'openpose_ros_fusion.node_params',
                  'openpose_ros_signals.node_params', 'openpose_ros_bridges.node_params',
                  'openpose_ros_bringup.node_params', 'openpose_ros_nodelets.node_params',
                  'openpose_ros_web.node_params')


def write_config(_arguments: Sequence[str] = ()) -> None:
    find_packages()
    from openpose_ros_pkg.params.parameters import to_yaml
    for package, name, kind in _config_files():
        path = PACKAGES[package] / 'config' / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(to_yaml(kind))
        say(str(path))
    JOINTS_H.write_text(with_joints(JOINTS_H.read_text()))
    say(str(JOINTS_H))


def with_joints(header: str) -> str:
    """Return joints.h with the joints of the messages and the skeletons as skeletons.py has them."""
    from openpose_ros_pkg.skeletons import MESSAGE_JOINTS, SKELETONS
    parts = {'joints': _macro('OPENPOSE_ROS_MSGS_JOINTS', (f'X({name.upper()}, {name})' for name in MESSAGE_JOINTS)),
             'skeletons': ''.join(_skeleton_tables(model) for model in SKELETONS.values())
             + _macro('OPENPOSE_ROS_MSGS_SKELETONS', (f'X({name})' for name in SKELETONS))}
    for part, text in parts.items():
        begin = header.index(f'// generated: {part}\n') + len(f'// generated: {part}\n')
        header = header[:begin] + text + header[header.index('// end of generated', begin):]
    return header


def _macro(name: str, items: Iterable[str]) -> str:
    lines = textwrap.wrap(' '.join(item.replace(' ', '~') for item in items), 110)
    return f'#define {name}(X) ' + ''.join(f'\\\n  {line} '.replace('~', ' ') for line in lines).rstrip() + '\n'


def _skeleton_tables(model: Any) -> str:
    joints = ', '.join(f'Joint::{name.upper()}' for name in model.joints)
    limbs = ', '.join(f'{{ Joint::{start.upper()}, Joint::{end.upper()} }}' for start, end in model.drawn_limbs)
    return ''.join(f'constexpr {kind} {model.name}_{kind.upper()}S[] = {{\n' + textwrap.fill(
        text, 118, initial_indent='  ', subsequent_indent='  ') + '\n};\n' for kind, text in (
            ('Joint', joints), ('Limb', limbs)))


def write_docs(_arguments: Sequence[str] = ()) -> None:
    """Write the tables of faults and of parameters, docs/results.md, and the figures that pages quote."""
    find_packages()
    ROS_API.write_text(with_parameters(ROS_API.read_text()))
    say(str(ROS_API))
    FAULTS.parent.mkdir(exist_ok=True)
    FAULTS.write_text(faults_page())
    say(str(FAULTS))
    write_results()


def with_parameters(page: str) -> str:
    """Return docs/ros_api.md with the parameters of each node, those first that most users set."""
    from openpose_ros_pkg.params.parameters import parameter_fields
    rows: List[Sequence[str]] = [('node', 'always', 'sometimes', 'seldom'), ['---'] * 4]
    kinds = {name: kind for _, name, kind in _config_files()}
    of_service = {field.name for field in parameter_fields(kinds['openpose_ros_node.yaml'])}
    for package, name, kind in _config_files():
        hidden = {'lazy', *(of_service if name == 'skeleton_extract_3d_node.yaml' else ())}
        fields = [field for field in parameter_fields(kind) if field.name not in hidden]
        link = f'[`{Path(name).stem}`](../{(PACKAGES[package] / "config" / name).relative_to(ROOT)})'
        rows += [(link, *(', '.join(_with_default(field) for field in fields if _use(field.name) == use)
                          for use in range(3)))] * bool(fields)
    table = ''.join(f'| {" | ".join(row)} |\n' for row in rows)
    begin, end = '<!-- parameters -->\n', '<!-- end of parameters -->'
    return page.partition(begin)[0] + begin + table + end + page.partition(end)[2]


def _use(name: str) -> int:
    """Return 0 for a parameter that is always set, 1: sometimes, 2: seldom."""
    return 0 if name in _ALWAYS else 1 if name in _SOMETIMES else 2


def _with_default(field: Any) -> str:
    """Return a parameter with its default and unit, as on a command line."""
    default = field.default if isinstance(field.default, str) else json.dumps(field.default)
    return f"`{field.name}={default}` {field.metadata['unit']}".rstrip()


def faults_page() -> str:
    """Return the page that lists what tests/faults injects, and what comes of it."""
    from faults import fault
    lines = [('area', 'fault', 'node', 'what comes of it'), ['---'] * 4, *fault.table()]
    rows = (' | '.join(re.sub(r'([|<])', r'\\\1', cell) for cell in line) for line in lines)
    return FAULTS_HEAD + ''.join(f'| {row} |\n' for row in rows)


def _config_files() -> List[Tuple[str, str, Any]]:
    """Return package, file name and parameters of each file in config/."""
    modules = [importlib.import_module(name) for name in CONFIG_MODULES]
    return [(module.__name__.split('.')[0], name, kind)
            for module in modules for name, kind in module.CONFIG_FILES.items()]


def find_packages() -> None:
    sys.path[:0] = [str(path) for path in [*PYTHON_SOURCES, ROOT / 'tests',
                                           ROOT / 'devel/lib/python3/dist-packages']]
