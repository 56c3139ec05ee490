"""Files that are written from the code: config/*.yaml, the tables of docs/*.md, and those of joints.h."""
import dataclasses
import importlib
import re
import sys
import textwrap
from typing import Any, Iterable, List, Sequence, Tuple

from development import PACKAGES, PYTHON_SOURCES, ROOT
from development.terminal import die, say

TABLE = re.compile(r'^<!-- table: (?P<name>[\w.:, ]+) -->\n.*?^<!-- end of table -->$', re.MULTILINE | re.DOTALL)
JOINTS_H = ROOT / 'openpose_ros_msgs/include/openpose_ros_msgs/joints.h'
CONFIG_MODULES = ('openpose_ros_pkg.params.nodes', 'skeleton_extract_3d.node_params', 'openpose_ros_fusion.node_params',
                  'openpose_ros_signals.node_params', 'openpose_ros_bridges.node_params')


def write_config(_arguments: Sequence[str] = ()) -> None:
    _find_packages()
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
    """Write the tables of docs/*.md again from the classes that they name."""
    _find_packages()
    for path in sorted((ROOT / 'docs').glob('*.md')):
        text = path.read_text()
        written = with_tables(text)
        if written != text:
            path.write_text(written)
            say(str(path))


def with_tables(text: str) -> str:
    """Return a page with each table between its markers as the code has it.

    `<!-- table: module.Class -->` shows the constants or parameters of a class, `<!-- table: config:FILE.yaml -->` all
    parameters of the node that loads this file, `<!-- table: faults -->` what tests/faults injects;
    `<!-- end of table -->` ends each.
    """
    return TABLE.sub(lambda match: '\n'.join([f"<!-- table: {match['name']} -->", *table(match['name']),
                                              '<!-- end of table -->']), text)


def table(name: str) -> List[str]:
    """Return the lines of a table."""
    if name.startswith('config:'):
        files = {file: kind for _, file, kind in _config_files()}
        if name[7:] not in files:
            die(f'there is no {name}; one of: {", ".join(files)}')
        return _parameter_table(files[name[7:]])
    if name == 'faults':
        from faults import fault
        return _rows(('area', 'fault', 'node', 'what comes of it'), fault.table())
    module, _, class_name = name.rpartition('.')
    kind = getattr(importlib.import_module(module), class_name)
    is_constants = all('source' in field.metadata for field in dataclasses.fields(kind))
    return _constant_table(kind) if is_constants else _parameter_table(kind)


def _parameter_table(kind: Any) -> List[str]:
    from openpose_ros_pkg.params.parameters import describe, parameter_fields
    return _rows(('name', 'default', 'allowed', 'what it does'), (
        (f'`{field.name}`', f'`{field.default!r}`', describe(field), field.metadata['doc'])
        for field in parameter_fields(kind)))


def _constant_table(kind: Any) -> List[str]:
    from openpose_ros_pkg.params.constants import DEFAULT_SOURCE
    rows = []
    sources = {DEFAULT_SOURCE: '', 'chosen': ''}
    for field in dataclasses.fields(kind):
        meta = field.metadata
        value = getattr(kind(), field.name)
        source = sources.get(meta['source'], f" Source: {meta['source']}.")
        sources.setdefault(meta['source'], f' Source: as `{field.name}`.')
        rows.append((f'`{field.name}`', _shown(value) + (f" [{meta['unit']}]" if meta['unit'] else ''),
                     meta['doc'] + source))
    return _rows(('constant', 'value', 'what it does'), rows)


def _shown(value: Any) -> str:
    """Return numbers as readers want them: no brackets, a semicolon between the rows of a matrix."""
    value = value.tolist() if hasattr(value, 'tolist') else value
    if not isinstance(value, (list, tuple)):
        return str(value)
    if any(isinstance(row, (list, tuple)) for row in value):
        return '; '.join(' '.join(map(str, row)) for row in value)
    return ', '.join(map(str, value))


def _rows(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> List[str]:
    lines = [titles, ['---'] * len(titles), *rows]
    escaped = [[re.sub(r'([|<])', r'\\\1', cell) for cell in line] for line in lines]
    return [f"| {' | '.join(line)} |" for line in escaped]


def _config_files() -> List[Tuple[str, str, Any]]:
    """Return package, file name and parameters of each file in config/."""
    modules = [importlib.import_module(name) for name in CONFIG_MODULES]
    return [(module.__name__.split('.')[0], name, kind)
            for module in modules for name, kind in module.CONFIG_FILES.items()]


def _find_packages() -> None:
    sys.path[:0] = [str(path) for path in [*PYTHON_SOURCES, ROOT / 'tests',
                                           ROOT / 'devel/lib/python3/dist-packages']]
