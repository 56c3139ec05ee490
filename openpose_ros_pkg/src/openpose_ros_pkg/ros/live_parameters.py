"""Change parameters of a running node through dynamic_reconfigure."""
import dataclasses
from typing import Any, Callable, Dict, Generic, Iterable, Type

import rospy
from dynamic_reconfigure.server import Server

from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.params.parameters import Settings, build, describe, flat_values, parameter_fields

# dynamic_reconfigure's names of the types, and its limits where there are none.
_TYPES = {bool: 'bool', int: 'int', float: 'double', str: 'str'}
_LOWEST = {bool: False, int: -2**31, float: -float('inf'), str: ''}
_HIGHEST = {bool: True, int: 2**31 - 1, float: float('inf'), str: ''}


class LiveDescription:
    """What is in the module that dynamic_reconfigure generates from a .cfg file, for these parameters of a record."""

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


class LiveParameters(Generic[Settings]):
    """A dynamic_reconfigure server on the node's private parameters.

    Values out of range are set to the limit. Others that the parameter classes refuse give a warning and are not taken.

    Args:
        current: the node's parameters, a parameter class or a record.
        names: those that may change.
        apply: called with all of them after each change; raises OpenposeRosError for values that can not be used.
    """

    def __init__(self, current: Settings, names: Iterable[str], apply: Callable[[Settings], None]) -> None:
        self._current = current
        self._apply = apply
        self._config: Dict[str, Any] = {}
        self._server = Server(LiveDescription(type(current), names), self._change)

    def _change(self, config: Dict[str, Any], level: int) -> Dict[str, Any]:
        values = {**flat_values(self._current), **{key: value for key, value in config.items() if key != 'groups'}}
        try:
            current = build(type(self._current), values)
            if current != self._current:
                self._apply(current)
        except OpenposeRosError as error:
            rospy.logwarn('parameters not changed: %s', error)
            return self._config
        self._current, self._config = current, config
        return config
