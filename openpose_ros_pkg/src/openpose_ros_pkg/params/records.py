"""The one reader of values of YAML and JSON files into records: dataclasses and NamedTuples, by their annotations.

A field is a str, bool, int, float, `Literal` (choices), `Optional`, `Tuple` (a list), `Union` of a value and a list,
`Dict[str, ...]` (a mapping), a record, or an array of finite numbers. What else a record demands, its `__post_init__`
raises as ValueError.
"""
import dataclasses
import difflib
import math
from typing import Any, Callable, Dict, Literal, Optional, Type, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from openpose_ros_pkg.errors import BadInputError

Record = TypeVar('Record')


def to_record(values: Any, kind: Type[Record], where: str, error: Callable[[str], Exception] = BadInputError,
              base: Optional[Record] = None, **known: Any) -> Record:
    """Return the record in the values of a text.

    Args:
        where: place of the values, with which errors begin.
        base: record that has the fields that are missing; None: they have their defaults.
        known: fields that the text does not have.

    Raises:
        error: a key is unknown or missing, or a value is not allowed; the text says where, and what is expected.
    """
    try:
        made: Record = (_converted(kind, values, where) if base is None and not known else
                        _record(kind, values, where, known, base))
    except ValueError as failed:
        raise error(str(failed)) from failed
    return made


def _record(kind: Any, values: Any, where: str, known: Dict[str, Any], base: Any = None) -> Any:
    types = {name: of_field for name, of_field in get_type_hints(kind).items() if name not in known}
    if not isinstance(values, dict):
        raise ValueError(f'{where}: {values!r:.80}, expected keys of {", ".join(types)}')
    for key in values:
        if key not in types:
            near = ''.join(f" (did you mean '{other}'?)" for other in difflib.get_close_matches(str(key), types, n=1))
            raise ValueError(f'{where}: unknown key {key}{near}; allowed: {", ".join(types)}')
    optional = kind._field_defaults if hasattr(kind, '_fields') else [
        field.name for field in dataclasses.fields(kind)
        if (field.default, field.default_factory) != (dataclasses.MISSING, dataclasses.MISSING)]
    missing = [name for name in types if base is None and name not in values and name not in optional]
    if missing:
        raise ValueError(f'{where}: it needs {", ".join(missing)}')
    given = {key: _converted(types[key], value, f'{where}: {key}') for key, value in values.items()}
    try:
        return kind(**given, **known) if base is None else dataclasses.replace(base, **given)
    except ValueError as error:
        raise ValueError(f'{where}: {error}') from error


def _converted(kind: Any, value: Any, where: str) -> Any:
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Union:  # Optional, or one value or a list of them
        if value is None and type(None) in arguments:
            return None
        parts = [each for each in arguments if each is not type(None)]
        return _converted(parts[-1 if isinstance(value, list) else 0], value, where)
    if origin is dict and isinstance(value, dict):
        return {str(key): _converted(arguments[1], each, f'{where}: {key}') for key, each in value.items()}
    if origin is tuple and isinstance(value, list):
        kinds = [arguments[0]] * len(value) if arguments[1:] == (...,) else arguments
        if len(kinds) == len(value):
            return tuple(_converted(each, part, f'{where}[{i}]')
                         for i, (each, part) in enumerate(zip(kinds, value)))
    if kind is float and type(value) in (int, float) and math.isfinite(value):
        return float(value)
    if kind is np.ndarray and isinstance(value, list):
        return _array(value, where)
    if type(value) is kind is not float or (origin is Literal and isinstance(value, str) and value in arguments):
        return value
    if dataclasses.is_dataclass(kind) or hasattr(kind, '_fields'):
        return _record(kind, value, where, {})
    raise ValueError(f'{where} = {value!r:.80}, expected {_expected(kind)}')


def _array(value: Any, where: str) -> np.ndarray:
    try:
        array = np.array(value, np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f'{where} = {value!r:.80}, expected numbers') from error
    if not np.isfinite(array).all():
        raise ValueError(f'{where} = {value!r:.80}, expected finite numbers')
    return array


def _expected(kind: Any) -> str:
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Literal:
        return f'one of {", ".join(map(repr, arguments))}'
    if origin is tuple and ... not in arguments:
        return f'a list of {len(arguments)} values, each {_expected(arguments[0])}'
    if origin is tuple:
        return f'a list, each value {_expected(arguments[0])}'
    names = {dict: 'a mapping', int: 'an int', np.ndarray: 'a list of numbers'}
    return names.get(origin or kind) or f'a {kind.__name__}'
