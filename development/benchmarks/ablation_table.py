"""What ablations share: variants of nested constants, changes of figures with intervals, the table.

A figure is a sum of numerators over a sum of denominators, one of each per unit: a scene, or a simulated person. Change:
variant minus base, its interval the 2.5th to 97.5th percentile of 1000 bootstrap samples of the units, of both alike.
"""
import dataclasses
import pickle
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

SAMPLES = 1000
# A change of a figure below this is none, whatever its interval: shares and seconds, and millimetres.
LEAST_CHANGE, LEAST_MM = 0.005, 0.5
# By figure: (units, 2), numerator and denominator.
Counts = Mapping[str, np.ndarray]
# How a constant is changed, and the factor.
FACTORS = {'half': 0.5, 'twice': 2.0}
# Nearer ones, which tell fragile constants.
NEAR_FACTORS = {'x 0.8': 0.8, 'x 1.25': 1.25}


class Variant(NamedTuple):
    """Constants of which one is changed: its dotted name, how, and the constants."""

    name: str
    how: str
    constants: Any


class Change(NamedTuple):
    """The change of a figure and its interval."""

    value: float
    low: float
    high: float
    is_clear: bool  # beyond noise


def names_of(constants: Any, prefix: str = '') -> Iterator[str]:
    """Yield the dotted names of all constants of nested frozen dataclasses."""
    for field in dataclasses.fields(constants):
        value = getattr(constants, field.name)
        if dataclasses.is_dataclass(value):
            yield from names_of(value, f'{prefix}{field.name}.')
        else:
            yield prefix + field.name


def value_of(constants: Any, name: str) -> Any:
    """Return a constant by its dotted name."""
    for part in name.split('.'):
        constants = constants[part] if isinstance(constants, dict) else getattr(constants, part)
    return constants


def with_value(constants: Any, name: str, value: Any) -> Any:
    """Return nested constants with another value of one of them."""
    first, _, rest = name.partition('.')
    return dataclasses.replace(constants, **{first: with_value(getattr(constants, first), rest, value) if rest else value})


def scaled(value: Any, factor: float) -> Any:
    """Return a number, or a tuple of them, times a factor; integers stay such, of 1 at least."""
    if isinstance(value, tuple):
        return tuple(scaled(each, factor) for each in value)
    if isinstance(value, np.ndarray):
        return value * factor
    return max(round(value * factor), 1) if isinstance(value, int) else value * factor


def variants(constants: Any, names: Sequence[str], factors: Mapping[str, float],
             without: Callable[[str, Any], Any] = lambda name, value: None) -> Iterator[Variant]:
    """Yield constants with one of them times each factor, and with the value of `without`, unless that is None."""
    for name in names:
        value = value_of(constants, name)
        for how, factor in factors.items():
            yield Variant(name, how, with_value(constants, name, scaled(value, factor)))
        other = without(name, value)
        if other is not None:
            yield Variant(name, 'without', with_value(constants, name, other))


def changes(base: Counts, other: Counts) -> Dict[str, Change]:
    """Return the change of each figure of `other` from that of `base`."""
    found = {}
    for figure, counts in other.items():
        if np.array_equal(counts, base[figure]):
            found[figure] = Change(0.0, 0.0, 0.0, False)
            continue
        units = len(counts)
        picked = np.random.RandomState(0).multinomial(units, np.full(units, 1 / units), SAMPLES)
        picked = np.vstack([np.ones(units), picked])
        with np.errstate(invalid='ignore', divide='ignore'):
            after, before = ((picked @ one)[:, 0] / (picked @ one)[:, 1] for one in (counts, base[figure]))
        low, high = np.nanpercentile((after - before)[1:], (2.5, 97.5))
        value = float(after[0] - before[0])
        is_clear = abs(value) >= (LEAST_MM if figure.endswith('mm') else LEAST_CHANGE) and (low > 0 or high < 0)
        found[figure] = Change(value, float(low), float(high), is_clear)
    return found


def figures(counts: Counts) -> Dict[str, float]:
    """Return the figures."""
    return {figure: float(values[:, 0].sum() / max(values[:, 1].sum(), 1e-12)) for figure, values in counts.items()}


def print_base(base: Mapping[str, Counts], path: Optional[Path]) -> None:
    """Print the figures of all suites, and how they differ from those in a file; without one it is written."""
    if path and not path.is_file():
        path.write_bytes(pickle.dumps(dict(base)))
    before = pickle.loads(path.read_bytes()) if path else {}  # noqa: S301  a file of these programs
    for suite, counts in base.items():
        differs = changes(before[suite], counts) if suite in before else {}
        for figure, value in figures(counts).items():
            change = differs.get(figure)
            print(f'{figure} {value:.4f}' + (f'  {change.value:+.4f} [{change.low:+.4f}, {change.high:+.4f}]'
                                             + (' *' if change.is_clear else '') if change else ''))


def cell(found: Optional[Mapping[str, Change]]) -> str:
    """Return the figures that change beyond noise, for the table."""
    if found is None:
        return ''
    clear = [f'{figure} {change.value:+.3f} [{change.low:+.3f}, {change.high:+.3f}]'
             for figure, change in found.items() if change.is_clear]
    return '; '.join(clear) or '-'


def text_of(value: Any) -> str:
    """Return a value for the table."""
    if isinstance(value, tuple):
        return ', '.join(map(text_of, value))
    return f'{value:g}' if isinstance(value, (int, float)) else '...'


def table(constants: Any, found: Mapping[Tuple[str, str], Mapping[str, Change]], hows: Sequence[str]) -> str:
    """Return the table of changes by constant and how it is changed, in Markdown."""
    names = list(dict.fromkeys(name for name, _ in found))
    rows: List[Sequence[str]] = [('constant', 'value', *hows)]
    rows += [(name, text_of(value_of(constants, name)), *(cell(found.get((name, how))) for how in hows))
             for name in names]
    lines = ['| ' + ' | '.join(row) + ' |' for row in rows]
    return '\n'.join([lines[0], '|' + ' --- |' * len(rows[0]), *lines[1:]]) + '\n'
