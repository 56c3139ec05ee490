"""Values in YAML and JSON texts; a text that has none is a ValueError.

The libraries alone raise RecursionError for deep nesting and errors of many classes for YAML's dates and numbers.
"""
import json
import re
from pathlib import Path
from typing import Any, Callable, Union

import yaml

from openpose_ros_pkg.errors import BadInputError


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
        return loader.construct_document(loader.get_node())
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
