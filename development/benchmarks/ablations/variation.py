"""Ablations of nested constants: variants, changes of figures with intervals, the table.

A figure is a sum of numerators over a sum of denominators, one of each per unit: a scene, or a simulated person.
Change: variant minus base, its interval the 2.5th to 97.5th percentile of 1000 bootstrap samples of the units, of both
alike.
"""
import argparse
import dataclasses
import json
import sys
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from common import markdown

SAMPLES = 1000
# A change of a figure below this is none, whatever its interval: shares and seconds, and millimetres.
LEAST_CHANGE, LEAST_MM = 0.005, 0.5
# How a constant is changed, and the factor; nearer ones tell fragile constants.
FACTORS, NEAR_FACTORS = {'half': 0.5, 'twice': 2.0}, {'x 0.8': 0.8, 'x 1.25': 1.25}
WITHOUT = 'without'
# Parts of the names of figures that are better the less they are.
LESS_IS_BETTER = ('false', 'wrong', 'other gesture', 'missed', 'extra', 'error', 'delay', 'switches', 'mixed up',
                  'waits', 'dropped', 'runs', 'unlabelled', 'floor')
# Conditions of this value always hold.
ALWAYS = (-1e9, 1.0 - 1e9)

Counts = Mapping[str, np.ndarray]
"""By figure: (units, 2), numerator and denominator."""
Suites = Mapping[str, Callable[[Any], Counts]]
"""By name: what counts for constants."""


class Variant(NamedTuple):
    """Constants of which one is changed: its dotted name, how, and the constants."""

    name: str
    how: str
    constants: Any


class Change(NamedTuple):
    """The change of a figure, its interval, and whether it is beyond noise."""

    value: float
    low: float
    high: float
    is_clear: bool


class Sums:
    """Numerators and denominators of one unit, by figure."""

    def __init__(self) -> None:
        self.values: Dict[str, np.ndarray] = {}

    def add(self, figure: str, numerator: float, denominator: float) -> None:
        """Add to a figure."""
        self.values[figure] = self.values.get(figure, np.zeros(2)) + np.array([numerator, denominator])


def counts_of(units: Sequence[Sums]) -> Counts:
    """Return the counts of units."""
    names = sorted({name for unit in units for name in unit.values})
    return {name: np.array([unit.values.get(name, np.zeros(2)) for unit in units]) for name in names}


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
        constants = getattr(constants, part)
    return constants


def unit_of(constants: Any, name: str) -> str:
    """Return the unit of a constant by its dotted name; '': it has none."""
    *path, last = name.split('.')
    group = value_of(constants, '.'.join(path)) if path else constants
    return next(field.metadata['unit'] for field in dataclasses.fields(group) if field.name == last)


def with_value(constants: Any, name: str, value: Any) -> Any:
    """Return nested constants with another value of one of them."""
    first, _, rest = name.partition('.')
    changed = with_value(getattr(constants, first), rest, value) if rest else value
    return dataclasses.replace(constants, **{first: changed})


def scaled(value: Any, factor: float, is_share: bool = False) -> Any:
    """Return a number, or a tuple of them, times a factor; integers stay such, of 1 at least, shares are 1 at most."""
    if isinstance(value, tuple):
        return tuple(scaled(each, factor, is_share) for each in value)
    if isinstance(value, int):
        return max(round(value * factor), 1)
    return min(value * factor, 1.0) if is_share else value * factor


def variants(constants: Any, names: Sequence[str], factors: Mapping[str, float]) -> Iterator[Variant]:
    """Yield constants with one of them times each factor; with far ones also with conditions that always hold."""
    for name in names:
        value, unit = value_of(constants, name), unit_of(constants, name)
        for how, factor in factors.items():
            is_share = not unit and isinstance(value, float) and 0 < value <= 1
            yield Variant(name, how, with_value(constants, name, scaled(value, factor, is_share)))
        if factors is FACTORS and isinstance(value, tuple):
            yield Variant(name, WITHOUT, with_value(constants, name, ALWAYS))


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
        value, (low, high) = float(after[0] - before[0]), np.nanpercentile((after - before)[1:], (2.5, 97.5))
        enough = abs(value) >= (LEAST_MM if figure.endswith('mm') else LEAST_CHANGE)
        found[figure] = Change(value, float(low), float(high), bool(enough and (low > 0 or high < 0)))
    return found


def text_of(change: Change) -> str:
    """Return a change and its interval."""
    return f'{change.value:+.3f} [{change.low:+.3f}, {change.high:+.3f}]'


def moved(found: Mapping[str, Change]) -> str:
    """Return the figures that change beyond noise, for the table."""
    return '; '.join(f'{figure} {text_of(change)}' for figure, change in found.items() if change.is_clear) or '-'


def is_worse(figure: str, change: Change) -> bool:
    """Return whether a change of a figure is beyond noise and for the worse."""
    return change.is_clear and (change.value > 0) == any(word in figure for word in LESS_IS_BETTER)


def verdict(found: Sequence[Mapping[str, Change]]) -> str:
    """Return what the changes at less and at more, and perhaps without, say of a constant."""
    if all(any(is_worse(figure, change) for figure, change in one.items()) for one in found[:2]):
        return 'fragile'
    return 'earns its place' if any(change.is_clear for one in found for change in one.values()) else 'idle here'


def print_base(base: Mapping[str, Counts], path: Optional[Path]) -> None:
    """Print the figures of all suites, and how they differ from those in a file; without one it is written."""
    if path and not path.is_file():
        path.write_text(json.dumps({suite: {figure: values.tolist() for figure, values in counts.items()}
                                    for suite, counts in base.items()}))
    before = json.loads(path.read_text()) if path else {}
    rows: List[Sequence[str]] = [('figure', 'value', 'units', 'change', '')]
    for suite, counts in base.items():
        known = {figure: np.array(values) for figure, values in before.get(suite, {}).items()}
        differs = changes(known, {figure: counts[figure] for figure in counts if figure in known})
        for figure, sums in counts.items():
            change = differs.get(figure)
            rows.append((figure, f'{sums[:, 0].sum() / max(sums[:, 1].sum(), 1e-12):.4f}',
                         str(int((sums[:, 1] > 0).sum())), text_of(change) if change and change.value else '',
                         'beyond noise' if change and change.is_clear else ''))
    print(markdown(rows))


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that all ablations have."""
    parser.add_argument('--only', default='', help='constants whose dotted names begin like this')
    parser.add_argument('--suites', nargs='*', default=(), help='these alone')
    parser.add_argument('--before', type=Path, help='counts to compare with; the file is written if it is not there')
    parser.add_argument('--near', action='store_true', help='factors 0.8 and 1.25: which constants are fragile')
    parser.add_argument('--cache', type=Path, default=Path('logs/ablation'), help='folder for what the chain finds')


def run(constants: Any, suites: Suites, of_group: Mapping[str, Sequence[str]], arguments: argparse.Namespace) -> None:
    """Print the figures of constants, and the table of their ablation.

    Args:
        of_group: suites that the constants of a group can change, all where it is not named.
    """
    suites = {name: score for name, score in suites.items() if not arguments.suites or name in arguments.suites}
    base = {suite: score(constants) for suite, score in suites.items()}
    print_base(base, arguments.before)
    names = [name for name in names_of(constants) if name.startswith(arguments.only)]
    factors = NEAR_FACTORS if arguments.near else FACTORS
    rows: Dict[str, Dict[str, Mapping[str, Change]]] = {name: {} for name in names}
    for name, how, changed in variants(constants, names, factors):
        chosen = [suite for suite in of_group.get(name.split('.')[0], suites) if suite in suites]
        found = {figure: change for suite in chosen for figure, change in changes(
            base[suite], suites[suite](changed)).items()}
        rows[name][how] = found
        print(name, how, moved(found), file=sys.stderr, flush=True)
    hows = [*factors] if arguments.near else [*factors, WITHOUT]
    print(markdown([('constant', 'value', *hows, 'verdict'), *(
        (name, str(value_of(constants, name)), *(moved(found.get(how, {})) for how in hows),
         verdict(list(found.values()))) for name, found in rows.items())]))
