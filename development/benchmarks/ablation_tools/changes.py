"""How figures change from one variant to another, with paired 95 % bootstrap intervals, and what that says.

A figure is told from sums per unit, such as a scene or a simulated person: a ratio from numerator and denominator, a
count from a number, a median from a histogram. Its change is beyond noise if the interval does not hold 0.
"""
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Sequence

import numpy as np

from scoring.figures import LEVEL, draws

# Parts of the names of figures that are better the less they are.
LESS_IS_BETTER = ('false', 'wrong', 'other gesture', 'missed', 'extra', 'error', 'delay', 'switches', 'mixed up',
                  'waits', 'dropped', 'runs', 'unlabelled', 'floor', 'lies', 'median', 'lost', 'ghosts')
IDLE = 'idle here'

Counts = Mapping[str, np.ndarray]
"""By figure: (units, columns), of a ratio numerator and denominator, of a count one, of a median bins of width 1."""


class Change(NamedTuple):
    """The change of a figure, its interval, and whether it is beyond noise."""

    value: float
    low: float
    high: float
    is_clear: bool


Changes = Mapping[str, Change]
"""By figure."""


class Sums(Dict[str, Any]):
    """Of one unit, by figure: what its counts have in a row."""

    def add(self, figure: str, numerator: float, denominator: float) -> None:
        """Add to numerator and denominator of a figure."""
        self[figure] = self.get(figure, np.zeros(2)) + np.array([numerator, denominator])


def counts_of(units: Sequence[Mapping[str, Any]]) -> Counts:
    """Return the counts of units."""
    names = {name: None for unit in units for name in unit}
    return {name: np.array([unit.get(name, (0, 0)) for unit in units], float) for name in names}


def counted(add: Callable[[Sums, Any, Any], None], units: Sequence[Any], constants: Any) -> Counts:
    """Return the counts of units with constants; `add` adds what it counts in a unit to the sums of it."""
    found = [Sums() for _ in units]
    for sums, unit in zip(found, units):
        add(sums, unit, constants)
    return counts_of(found)


def changes(base: Counts, other: Counts, least: Callable[[str], float]) -> Dict[str, Change]:
    """Return the change of each figure of `other` from that of `base`; one below `least` of its name tells nothing."""
    found = {}
    for figure, counts in other.items():
        if np.array_equal(counts, base[figure]):
            found[figure] = Change(0.0, 0.0, 0.0, False)
            continue
        weights = draws(len(counts))
        values = _figures(weights @ counts) - _figures(weights @ base[figure])
        drawn = values[1:][np.isfinite(values[1:])]
        low, high = np.quantile(drawn, ((1 - LEVEL) / 2, (1 + LEVEL) / 2)) if len(drawn) else (np.nan, np.nan)
        found[figure] = Change(float(values[0]), float(low), float(high),
                               bool(abs(values[0]) >= least(figure) and (low > 0 or high < 0)))
    return found


def _figures(sums: np.ndarray) -> np.ndarray:
    """Return the figure of each row of pooled sums; NaN: there is none."""
    if sums.shape[1] == 1:
        return sums[:, 0]
    if sums.shape[1] == 2:
        return np.divide(sums[:, 0], sums[:, 1], out=np.full(len(sums), np.nan), where=sums[:, 1] > 0)
    below = sums.cumsum(axis=1)
    half = below[:, -1:] / 2
    rows, bins = np.arange(len(sums)), (below < half).sum(axis=1)
    inside = sums[rows, bins]
    return np.where(inside > 0, bins + (half[:, 0] - below[rows, bins] + inside) / np.maximum(inside, 1e-9), np.nan)


def worth(found: Changes) -> List[bool]:
    """Return of each figure that changes beyond noise whether it gets better."""
    return [(change.value < 0) == any(word in figure for word in LESS_IS_BETTER)
            for figure, change in found.items() if change.is_clear]


def verdict(found: Sequence[Changes]) -> str:
    """Return what the changes at less and at more, and perhaps without, say of a constant."""
    if all(False in worth(one) for one in found[:2]):
        return 'fragile'
    return 'earns its place' if any(map(worth, found)) else IDLE
