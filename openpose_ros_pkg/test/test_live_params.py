"""The description of parameters for dynamic_reconfigure says what the parameter classes say."""
import ast
from dataclasses import dataclass

from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.ros.live_parameters import LiveDescription


@dataclass(frozen=True)
class Example(Parameters):
    """One parameter of each kind."""

    threshold: float = parameter(0.5, 'A threshold.', minimum=0, maximum=1)
    number: int = parameter(3, 'A number.', minimum=1)
    offset: float = parameter(0.0, 'An offset.')
    shown: bool = parameter(True, 'Show it.')
    mode: str = parameter('fast', 'How.', choices=('fast', 'slow'))
    fixed: int = parameter(7, 'Not to be changed.')


LIVE = LiveDescription(Example, ('threshold', 'number', 'offset', 'shown', 'mode'))


def test_limits_have_the_type_of_the_parameter():
    limits = {name: (LIVE.min[name], LIVE.defaults[name], LIVE.max[name]) for name in LIVE.defaults}
    assert limits == {'threshold': (0.0, 0.5, 1.0), 'number': (1, 3, 2**31 - 1),
                      'offset': (-float('inf'), 0.0, float('inf')), 'shown': (False, True, True),
                      'mode': ('', 'fast', '')}
    assert all(type(value) is type(values[1]) for values in limits.values() for value in values)


def test_types_texts_and_choices():
    entries = {entry['name']: entry for entry in LIVE.config_description['parameters']}
    assert entries['threshold']['description'] == 'A threshold. (float in 0 .. 1)'
    assert [entries[name]['type'] for name in ('threshold', 'number', 'shown', 'mode')] == [
        'double', 'int', 'bool', 'str']
    assert entries['threshold']['edit_method'] == ''
    offered = ast.literal_eval(entries['mode']['edit_method'])['enum']
    assert [(choice['name'], choice['value'], choice['type']) for choice in offered] == [
        ('fast', 'fast', 'str'), ('slow', 'slow', 'str')]
