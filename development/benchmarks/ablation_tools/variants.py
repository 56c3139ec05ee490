"""What an ablation varies: each constant at half and at twice its value, and without it.

Half and twice: arrays and tuples as a whole; integers are rounded, at least 1, and odd where the value is odd and above
9; shares and likelihoods (0..1, without a unit of their own) are at most 1. Words in tuples, such as joints, stay.
"""
import contextlib
from dataclasses import fields, is_dataclass, replace
from types import MappingProxyType
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Sequence, Tuple

import numpy as np

# How a constant is changed, and the factor; nearer ones tell fragile constants.
FACTORS, NEAR_FACTORS = {'half': 0.5, 'twice': 2.0}, {'x 0.8': 0.8, 'x 1.25': 1.25}
# Conditions of this value always hold.
WITHOUT, ALWAYS = 'without', (-1e9, 1.0 - 1e9)

Values = Mapping[str, Any]
"""Values of constants by their paths, such as track.identity.same_depth."""
Paths = Sequence[Tuple[str, Tuple[Any, Mapping[str, Any]]]]
"""Path, and value and metadata, of constants."""


class Variant(NamedTuple):
    """Values that differ from the present ones: constants by path, and parameters of the chain by name."""

    name: str
    constants: Values
    parameters: Values = MappingProxyType({})


def constant_paths(values: Any, path: str = '') -> Paths:
    """Return path, value and metadata of each constant in a record of records, or in records by name."""
    if isinstance(values, dict):
        return [pair for name, record in values.items() for pair in constant_paths(record, name)]
    found: List[Any] = []
    for field in fields(values):
        name, value = f'{path}.{field.name}' if path else field.name, getattr(values, field.name)
        found += constant_paths(value, name) if is_dataclass(value) else [(name, (value, field.metadata))]
    return found


def scaled(value: Any, factor: float, at_most: float = np.inf) -> Any:
    """Return a value times a factor; see the module."""
    if isinstance(value, np.ndarray):
        return value * factor
    if isinstance(value, (tuple, list)):
        return tuple(scaled(one, factor, at_most) for one in value)
    if isinstance(value, (str, bool)):
        return value
    if isinstance(value, int):
        rounded = round(value * factor)
        if value > 9 and value % 2:
            rounded += 1 - rounded % 2
        return max(rounded, 1) if value > 0 else rounded
    return min(value * factor, at_most)


def variants(paths: Paths, factors: Mapping[str, float] = FACTORS, without: bool = False) -> List[Variant]:
    """Return the variants of each constant that a factor changes; `without`: also with conditions that always hold."""
    found = []
    for path, (value, metadata) in paths:
        is_share = isinstance(value, float) and 0 < value <= 1 and metadata['unit'] in ('', 'share')
        changed = {how: scaled(value, factor, 1.0 if is_share else np.inf) for how, factor in factors.items()}
        if without and isinstance(value, tuple):
            changed[WITHOUT] = ALWAYS
        found += [Variant(f'{path} {how}', {path: other}) for how, other in changed.items()
                  if not np.array_equal(np.asarray(other, object), np.asarray(value, object))]
    return found


def with_values(record: Any, values: Values) -> Any:
    """Return nested constants with other values by path."""
    for path, value in values.items():
        first, _, rest = path.partition('.')
        record = replace(record, **{first: with_values(getattr(record, first), {rest: value}) if rest else value})
    return record


@contextlib.contextmanager
def in_shared(instances: Dict[str, Any], values: Values) -> Iterator[None]:
    """Give constants of shared instances, by name, other values for a time, by path."""
    places = [(instances[path.rpartition('.')[0]], path.rpartition('.')[2]) for path in values]
    before = [getattr(*place) for place in places]
    try:
        for place, value in zip(places, values.values()):
            object.__setattr__(*place, value)
        yield
    finally:
        for place, value in zip(places, before):
            object.__setattr__(*place, value)


def text_of(value: Any) -> str:
    """Return a value as text; of many numbers the first ones."""
    if isinstance(value, (tuple, np.ndarray)):
        text = ', '.join(str(one) for one in np.asarray(value, object).ravel())
        return text if len(text) < 40 else f'{text[:30].rpartition(",")[0]}, ...'
    return f'{value:g}' if isinstance(value, (int, float)) else str(value)
