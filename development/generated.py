"""Files that are written from the code: config/*.yaml, the tables of joints.h, and development/notes/faults.md."""
import importlib
import re
import sys
import textwrap
from typing import Any, Iterable, List, Sequence, Tuple

from development import PACKAGES, PYTHON_SOURCES, ROOT
from development.results import write_results
from development.terminal import say

FAULTS = ROOT / 'development/notes/faults.md'
FAULTS_HEAD = """# Faults that are injected

Written by `./run docs` from the cases of `tests/faults`; [reliability](../../docs/reliability.md) says what the suite
checks. A node is `CHAIN/NODE` of `tests/faults/rig.py`; what comes of a fault is a counter and text of `/diagnostics`.

"""
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
    """Write the table of what the fault suite injects, docs/results.md, and the figures that pages quote."""
    find_packages()
    FAULTS.parent.mkdir(exist_ok=True)
    FAULTS.write_text(faults_page())
    say(str(FAULTS))
    write_results()


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
