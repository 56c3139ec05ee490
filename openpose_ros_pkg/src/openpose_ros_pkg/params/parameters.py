"""Parameters as frozen dataclasses: one place for defaults, units, ranges and what each one does.

A parameter class derives from `Parameters` and declares its fields with `parameter`::

    @dataclass(frozen=True)
    class DrawParams(Parameters):
        alpha_pose: float = parameter(0.6, 'Opacity of the skeletons.', minimum=0.0, maximum=1.0)

Instances check themselves, wherever they are made: from a parameter server, a YAML file or in a test.
"""
import dataclasses
import difflib
import json
import math
import textwrap
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Type

from openpose_ros_pkg.errors import ParameterError


def parameter(default: Any, doc: str, *, unit: str = '', minimum: Optional[float] = None,
              maximum: Optional[float] = None, choices: Optional[Sequence[Any]] = None) -> Any:
    """Declare one parameter of a `Parameters` dataclass; its type is the type of the default."""
    return dataclasses.field(default=default, metadata={
        'doc': doc, 'unit': unit, 'minimum': minimum, 'maximum': maximum,
        'choices': tuple(choices) if choices is not None else None})


@dataclasses.dataclass(frozen=True)
class Parameters:
    """Base of all parameter classes: checks type, range and choices of every field.

    Raises:
        ParameterError: a value has the wrong type or is not allowed.
    """

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            checked = _checked(field, getattr(self, field.name))
            object.__setattr__(self, field.name, checked)


def build(classes: Sequence[Type[Parameters]], values: Mapping[str, Any]) -> Tuple[Any, ...]:
    """Make one instance of each class from one flat mapping, as a node's private namespace is.

    Raises:
        ParameterError: a key belongs to no class, or a value is not allowed.
    """
    known = [field.name for cls in classes for field in dataclasses.fields(cls)]
    for key in sorted(set(values) - set(known)):
        near = difflib.get_close_matches(key, known, n=1)
        hint = f" (did you mean '{near[0]}'?)" if near else ''
        raise ParameterError(f"unknown parameter '{key}' = {values[key]!r}{hint}; allowed: {', '.join(sorted(known))}")
    return tuple(cls(**{field.name: values[field.name] for field in dataclasses.fields(cls) if field.name in values})
                 for cls in classes)


def to_yaml(classes: Sequence[Type[Parameters]]) -> str:
    """Return a YAML file with every parameter at its default, each with a comment on what it does and takes."""
    lines: List[str] = []
    for cls in classes:
        lines += ['', f'## {(cls.__doc__ or "").splitlines()[0]}']
        for field in dataclasses.fields(cls):
            text = f"{field.metadata['doc']} ({describe(field)})"
            lines += ['', *textwrap.wrap(text, 116, initial_indent='# ', subsequent_indent='# '),
                      f'{field.name}: {json.dumps(field.default)}']
    return '\n'.join(lines[1:]) + '\n'


def describe(field: dataclasses.Field) -> str:
    """Say in one line what values a parameter takes, for error texts and documentation."""
    meta: Dict[str, Any] = field.metadata
    if meta['choices'] is not None:
        allowed = 'one of ' + ', '.join(repr(choice) for choice in meta['choices'])
    else:
        allowed = type(field.default).__name__
        if meta['minimum'] is not None or meta['maximum'] is not None:
            low = '-inf' if meta['minimum'] is None else f"{meta['minimum']:g}"
            high = 'inf' if meta['maximum'] is None else f"{meta['maximum']:g}"
            allowed += f' in {low} .. {high}'
    return allowed + (f" [{meta['unit']}]" if meta['unit'] else '')


def _checked(field: dataclasses.Field, value: Any) -> Any:
    """Return the value as the field's type or raise ParameterError."""
    expected, meta = type(field.default), field.metadata
    if expected is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    right = type(value) is expected and not (expected is float and not math.isfinite(value))
    if right and meta['choices'] is not None:
        right = value in meta['choices']
    if right and expected in (int, float):
        right = ((meta['minimum'] is None or value >= meta['minimum'])
                 and (meta['maximum'] is None or value <= meta['maximum']))
    if not right:
        raise ParameterError(f"parameter '{field.name}' = {value!r} is not allowed: {describe(field)}")
    return value
