"""Descriptions of parameters for dynamic_reconfigure, made from the parameter classes."""
import dataclasses
from typing import Any, Dict, Iterable, Type

from openpose_ros_pkg.params.parameters import describe, parameter_fields

# dynamic_reconfigure's names of the types, and its limits where there are none.
_TYPES = {bool: 'bool', int: 'int', float: 'double', str: 'str'}
_LOWEST = {bool: False, int: -2**31, float: -float('inf'), str: ''}
_HIGHEST = {bool: True, int: 2**31 - 1, float: float('inf'), str: ''}


class LiveDescription:
    """The content of the module that dynamic_reconfigure generates from a .cfg file.

    Args:
        kind: record of the node's parameters.
        names: of those that may change.

    Attributes:
        config_description, min, max, defaults, level, all_level: as in the module.
    """

    def __init__(self, kind: Type[Any], names: Iterable[str]) -> None:
        wanted = set(names)
        chosen = [field for field in parameter_fields(kind) if field.name in wanted]
        self.min: Dict[str, Any] = {field.name: _limit(field, 'minimum', _LOWEST) for field in chosen}
        self.max: Dict[str, Any] = {field.name: _limit(field, 'maximum', _HIGHEST) for field in chosen}
        self.defaults: Dict[str, Any] = {field.name: field.default for field in chosen}
        self.level: Dict[str, int] = {field.name: 1 for field in chosen}
        self.all_level = 1
        self.config_description: Dict[str, Any] = {
            'name': 'Default', 'type': '', 'state': True, 'id': 0, 'parent': 0, 'groups': [],
            'parameters': [{'name': field.name, 'type': _TYPES[type(field.default)], 'level': 1,
                            'description': f"{field.metadata['doc']} ({describe(field)})",
                            'edit_method': _choices(field)} for field in chosen]}


def _limit(field: 'dataclasses.Field[Any]', which: str, unlimited: Dict[type, Any]) -> Any:
    kind: Type[Any] = type(field.default)
    limit = field.metadata[which]
    return unlimited[kind] if limit is None else kind(limit)


def _choices(field: 'dataclasses.Field[Any]') -> str:
    """Return dynamic_reconfigure's `edit_method` of a parameter with choices; empty for others."""
    choices = field.metadata['choices']
    if choices is None:
        return ''
    kind = _TYPES[type(field.default)]
    return str({'enum': [{'name': str(choice), 'type': kind, 'value': choice, 'description': ''} for choice in choices],
                'enum_description': field.metadata['doc']})
