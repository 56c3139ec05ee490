"""The one reader of YAML and JSON into records: what is refused, and where the text says it is."""
from dataclasses import dataclass
from typing import Dict, Literal, NamedTuple, Optional, Tuple

import numpy as np
import pytest
import yaml

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.params.records import to_record


class Place(NamedTuple):
    name: str
    position: np.ndarray = np.zeros(3)


@dataclass(frozen=True)
class Room:
    number: int
    height: float = 2.5
    lit: bool = False
    kind: Literal['hall', 'cell'] = 'hall'
    size: Optional[Tuple[int, int]] = None
    tags: Tuple[str, ...] = ()
    places: Tuple[Place, ...] = ()

    def __post_init__(self):
        if self.number < 0:
            raise ValueError(f'number {self.number} is below 0')


def room(text):
    return to_record(yaml.safe_load(text), Room, 'room a.yaml')


def test_fields_have_their_types_or_defaults():
    assert room('number: 3') == Room(3)
    made = room('{number: 3, height: 2, lit: true, kind: cell, size: [4, 5], tags: [a, b], places: [{name: door}]}')
    assert made == Room(3, 2.0, True, 'cell', (4, 5), ('a', 'b'), made.places) and type(made.height) is float
    np.testing.assert_array_equal(made.places[0].position, (0, 0, 0))
    assert to_record({'cellar': {'number': 1}}, Dict[str, Room], 'rooms') == {'cellar': Room(1)}
    assert to_record({}, Room, 'it', number=7) == Room(7)


@pytest.mark.parametrize('text, told', [
    ('3', 'room a.yaml: 3, expected keys of number, height'), ('{}', 'room a.yaml: it needs number'),
    ('{number: 1, hieght: 2}', "unknown key hieght .did you mean 'height'..; allowed: number, height"),
    ('number: true', 'room a.yaml: number = True, expected an int'), ('number: -1', 'room a.yaml: number -1 is below'),
    ('{number: 1, height: .nan}', 'height = nan, expected a float'),
    ('{number: 1, lit: 1}', 'lit = 1, expected a bool'), ('{number: 1, kind: x}', "expected one of 'hall', 'cell'"),
    ('{number: 1, size: [4]}', r'size = \[4\], expected a list of 2 values, each an int'),
    ('{number: 1, tags: [3]}', r'tags\[0\] = 3, expected a str'), ('{number: 1, tags: a}', 'expected a list, each'),
    ('{number: 1, places: [{name: a}, {}]}', r'places\[1\]: it needs name'),
    ('{number: 1, places: [{name: a, position: [x]}]}', r'places\[0\]: position = .* expected numbers'),
    ('{number: 1, places: [{name: a, position: [.inf]}]}', 'expected finite numbers')])
def test_what_is_refused(text, told):
    with pytest.raises(BadInputError, match=told):
        room(text)
    with pytest.raises(ParameterError, match=told):
        to_record(yaml.safe_load(text), Room, 'room a.yaml', ParameterError)
