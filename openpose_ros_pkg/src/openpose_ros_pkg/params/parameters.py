"""Parameters as frozen dataclasses: one place for defaults, units, ranges and documentation.

A parameter class derives from `Parameters` and declares its fields with `parameter`::

    @dataclass(frozen=True)
    class DrawParams(Parameters):
        alpha_pose: float = parameter(0.6, 'Opacity of the skeletons.', minimum=0.0, maximum=1.0)

Instances check themselves; a text whose name ends in frame or frame_id loses a leading slash. A record is a frozen
dataclass of parameter classes and other records::

    @dataclass(frozen=True)
    class ViewerSettings:
        draw: DrawParams
        detector: DetectorSettings

`build` makes either from a flat mapping, such as a node's private namespace.
"""
import dataclasses
import difflib
import functools
import itertools
import json
import logging
import math
import textwrap
from typing import Any, ClassVar, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Type, TypeVar, cast

import numpy as np

from openpose_ros_pkg.errors import ParameterError

_log = logging.getLogger(__name__)

Settings = TypeVar('Settings')
"""A parameter class or a record."""
# Words without quotes that YAML 1.1, and so a launch file and _KEY:=VALUE, reads as booleans.
_YAML_WORDS = {False: ('off', 'no', 'false'), True: ('on', 'yes', 'true')}


def frame_name(name: str) -> str:
    """Return the name of a frame without a leading slash, which tf allowed and tf2 refuses."""
    return name[1:] if name.startswith('/') else name


def direction(text: str, name: str) -> np.ndarray:
    """Return the unit vector (3,) of a parameter of three numbers, as '0 -1 0'; raise ParameterError for none."""
    try:
        vector = np.array(text.split(), np.float64)
    except ValueError:
        vector = np.zeros(0)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
        raise ParameterError(f"parameter '{name}' = {text!r} is not allowed: three numbers, as '0 -1 0'", name)
    return np.asarray(vector / np.linalg.norm(vector))


def parameter(default: Any, doc: str, *, unit: str = '', minimum: Optional[float] = None,
              maximum: Optional[float] = None, choices: Optional[Sequence[Any]] = None, **special: Any) -> Any:
    """Declare one parameter of a `Parameters` dataclass; its type is the type of the default.

    Of a text, `words=('off',)`: that have a special meaning; `is_direction=True`: three numbers, see `direction`.
    """
    return dataclasses.field(default=default, metadata={
        'doc': doc, 'unit': unit, 'minimum': minimum, 'maximum': maximum,
        'choices': tuple(choices) if choices is not None else None, 'words': (), **special})


@dataclasses.dataclass(frozen=True)
class Parameters:
    """Base of all parameter classes: checks type, range and choices of every field.

    Attributes:
        retired: names that are gone: for one release they are ignored, with a warning.

    Raises:
        ParameterError: a value has the wrong type or is not allowed.
    """

    retired: ClassVar[Tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            checked = _checked(field, getattr(self, field.name))
            object.__setattr__(self, field.name, checked)


def parameter_classes(kind: Type[Any]) -> Iterator[Type[Parameters]]:
    """Yield the parameter classes of a record in order, each once, or the class itself."""
    if issubclass(kind, Parameters):
        yield kind
        return
    records = (parameter_classes(cast(Type[Any], field.type)) for field in dataclasses.fields(kind))
    yield from dict.fromkeys(itertools.chain.from_iterable(records))


def parameter_fields(*kinds: Type[Any]) -> List['dataclasses.Field[Any]']:
    """Return the parameters of parameter classes and records, in order."""
    return [field for kind in kinds for cls in parameter_classes(kind) for field in dataclasses.fields(cls)]


def accepted_names(*kinds: Type[Any]) -> List[str]:
    """Return the names that `build` takes: of parameters, and of those that are gone."""
    gone = [name for kind in kinds for cls in parameter_classes(kind) for name in cls.retired]
    return [*gone, *(field.name for field in parameter_fields(*kinds))]


def build(kind: Type[Settings], values: Mapping[str, Any]) -> Settings:
    """Make a parameter class or a record from a flat mapping; missing keys have their defaults.

    Raises:
        ParameterError: a key is unknown, or a value is not allowed.
    """
    known = {field.name for field in parameter_fields(kind)}
    for key, value in sorted(values.items()):
        if key not in accepted_names(kind):
            near = difflib.get_close_matches(key, known, n=1)
            hint = f" (did you mean '{near[0]}'?)" if near else ''
            raise ParameterError(f"unknown parameter '{key}' = {value!r}{hint}; allowed: {', '.join(sorted(known))}",
                                 key)
        if key not in known:
            _warn_once(f"parameter '{key}' = {value!r} is gone, and without effect")
    return build_known(kind, values)


@functools.lru_cache(maxsize=None)
def _warn_once(text: str) -> None:
    _log.warning('%s', text)


def build_known(kind: Type[Settings], values: Mapping[str, Any]) -> Settings:
    """Do `build` without warnings, keys of other parameters left out."""
    fields = dataclasses.fields(kind)  # type: ignore[arg-type]
    if issubclass(kind, Parameters):
        return kind(**{field.name: values[field.name] for field in fields if field.name in values})
    return kind(**{field.name: build_known(cast(Type[Any], field.type), values) for field in fields})


def flat_values(settings: Any) -> Dict[str, Any]:
    """Return the values of a parameter class or a record as the flat mapping that `build` takes."""
    values: Dict[str, Any] = {}
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        values.update({field.name: value} if isinstance(settings, Parameters) else flat_values(value))
    return values


def to_yaml(kind: Type[Any]) -> str:
    """Return a YAML file with every parameter at its default and commented."""
    lines: List[str] = []
    for cls in parameter_classes(kind):
        fields = parameter_fields(cls)
        lines += ['', f'## {(cls.__doc__ or "").splitlines()[0]}'] * bool(fields)
        for field in fields:
            text = f"{field.metadata['doc']} ({describe(field)})"
            lines += ['', *textwrap.wrap(text, 116, initial_indent='# ', subsequent_indent='# '),
                      f'{field.name}: {json.dumps(field.default)}']
    return '\n'.join(lines[1:]) + '\n'


def describe(field: 'dataclasses.Field[Any]') -> str:
    """Return in one line which values a parameter takes."""
    meta = field.metadata
    if meta['choices'] is not None:
        allowed = 'one of ' + ', '.join(repr(choice) for choice in meta['choices'])
    else:
        allowed = ' or '.join([type(field.default).__name__, *map(repr, meta['words'])])
        if meta['minimum'] is not None or meta['maximum'] is not None:
            low = '-inf' if meta['minimum'] is None else f"{meta['minimum']:g}"
            high = 'inf' if meta['maximum'] is None else f"{meta['maximum']:g}"
            allowed += f' in {low} .. {high}'
    return allowed + (f" [{meta['unit']}]" if meta['unit'] else '')


def _checked(field: 'dataclasses.Field[Any]', value: Any) -> Any:
    """Return the value as the field's type or raise ParameterError."""
    expected, meta = type(field.default), field.metadata
    if expected is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if expected is str and isinstance(value, list):  # numbers, as in YAML
        value = ' '.join(map(str, value))
    if expected is str and isinstance(value, bool):
        words = [*(meta['choices'] or ()), *meta['words']]
        value = next((word for word in words if word in _YAML_WORDS[value]), value)
    right = type(value) is expected and not (isinstance(value, float) and not math.isfinite(value))
    if right and meta['choices'] is not None:
        right = value in meta['choices']
    if right and expected in (int, float):
        right = ((meta['minimum'] is None or value >= meta['minimum'])
                 and (meta['maximum'] is None or value <= meta['maximum']))
    if not right:
        raise ParameterError(f"parameter '{field.name}' = {value!r} is not allowed: {describe(field)}", field.name)
    if meta.get('is_direction'):
        direction(value, field.name)
    return frame_name(value) if expected is str and field.name.endswith(('frame', 'frame_id')) else value
