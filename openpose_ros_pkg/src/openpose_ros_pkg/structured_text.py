"""Values in YAML and JSON texts: reading ends soon, with values of the text's size or with a ValueError.

The libraries alone raise RecursionError for deep nesting and errors of many classes for YAML's dates and numbers, and
let a text of 1 KB stand for billions of values by its aliases.
"""
import json
import re
from pathlib import Path
from typing import Any, Callable, Dict, Union

import yaml

from openpose_ros_pkg.errors import BadInputError

# Maximum number of values of a YAML text, with aliases written out: a marker map has 200.
_MOST_VALUES = 100000


def file_values(path: Path, what: str, error: Callable[[str], Exception] = BadInputError) -> Any:
    """Return the values in a file of YAML, or of JSON by its suffix; `error`, beginning with `what`: it has none."""
    try:
        path = path.expanduser()
        if path.exists() and not path.is_file():
            raise ValueError('it is no plain file')
        return (json_value if path.suffix == '.json' else yaml_value)(path.read_text(encoding='utf-8'))
    except (OSError, RuntimeError, ValueError) as failed:
        raise error(f'{what} can not be read: {failed}') from failed


def yaml_value(text: str) -> Any:
    """Return the first document of a YAML text, also of OpenCV; None of an empty one; ValueError: it is none."""
    try:
        # OpenCV's directive %YAML:1.0 is none, and its matrices have a tag
        loader = yaml.SafeLoader(re.sub(r'\A%YAML:.*\n', '', text).replace('!!opencv-matrix', ''))
        if not loader.check_node():
            return None
        node = loader.get_node()
        values = _count(node, {})
        if values > _MOST_VALUES:
            raise ValueError(f'it stands for {values} values, expected {_MOST_VALUES} at most')
        return loader.construct_document(node)
    except RecursionError:
        raise ValueError('its values are nested too deep, or hold themselves') from None
    except (yaml.YAMLError, AttributeError, IndexError, KeyError, OverflowError, TypeError) as error:
        raise ValueError(str(error)) from error


def json_value(text: Union[str, bytes]) -> Any:
    """Return the value of a JSON text; ValueError: it is not JSON."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError('its values are nested too deep') from None


def _count(node: yaml.Node, known: Dict[int, int]) -> int:
    """Return how many values a node stands for; `known` holds counts by `id`. RecursionError: it holds itself."""
    if isinstance(node, yaml.ScalarNode):
        return 1
    if id(node) not in known:
        parts = [part for pair in node.value for part in (pair if isinstance(pair, tuple) else (pair,))]
        known[id(node)] = 1 + sum(_count(part, known) for part in parts)
    return known[id(node)]
