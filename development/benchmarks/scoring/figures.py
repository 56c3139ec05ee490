"""Figures from pooled counts, with 95 % intervals by bootstrap over scenes.

A statistic returns one value for each row of weights (B, S): how often each of S scenes is drawn. The first row is all
ones and gives the figure; the others, drawn with replacement by a fixed seed, give its interval by percentiles (Efron
1979). Figures of two runs on the same scenes share the draws, so the interval of their difference is paired.
"""
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from .counts import Counts

RESAMPLES, SEED, LEVEL = 2000, 0, 0.95
# Scenes that an interval needs.
FEW = 5
# Quantiles of resamples are taken among this many values at most, equally many rows between them.
_RANKS = 2000
# Which rows of a table count: takes the table, a structured array (N,), and returns a mask (N,).
Rows = Callable[[np.ndarray], np.ndarray]


def every(rows: np.ndarray) -> np.ndarray:
    return np.ones(len(rows), bool)


class Figure(NamedTuple):
    """A figure with its interval; None: there is nothing to tell it from.

    Attributes:
        n: what it was counted in: joints, people, frames; scenes: that tell of it.
        digits: after the point, where it is shown.
    """

    value: Optional[float]
    low: Optional[float] = None
    high: Optional[float] = None
    n: int = 0
    unit: str = ''
    digits: int = 3
    text: str = ''
    scenes: int = 0

    def __str__(self) -> str:
        return '-' if self.value is None else f'{self.value:.{self.digits}f}'

    @property
    def interval(self) -> str:
        """Value and interval as text."""
        return str(self) if self.low is None or self.high is None else (
            f'{self} [{self.low:.{self.digits}f}, {self.high:.{self.digits}f}]')


@dataclass(frozen=True)
class Ratio:
    """The sum of `top` over scenes by that of `bottom`; without it the sum itself."""

    text: str
    top: Callable[[Counts], float]
    bottom: Optional[Callable[[Counts], float]] = None
    unit: str = ''
    digits: int = 3
    factor: float = 1.0

    def values(self, counts: Sequence[Counts], weights: np.ndarray) -> np.ndarray:
        top = self.factor * (weights @ np.array([self.top(each) for each in counts], np.float64))
        if self.bottom is None:
            return top
        bottom = weights @ np.array([self.bottom(each) for each in counts], np.float64)
        return np.divide(top, bottom, out=np.full(len(top), np.nan), where=bottom > 0)

    def size(self, counts: Sequence[Counts]) -> int:
        return len(counts) if self.bottom is None else int(sum(self.bottom(each) for each in counts))


@dataclass(frozen=True)
class Quantile:
    """A quantile of the values of all scenes."""

    text: str
    of: Callable[[Counts], np.ndarray]
    share: float = 0.5
    unit: str = ''
    digits: int = 1
    factor: float = 1.0

    def values(self, counts: Sequence[Counts], weights: np.ndarray) -> np.ndarray:
        parts = [np.asarray(self.of(each), np.float64) for each in counts]
        values = np.concatenate(parts) if parts else np.zeros(0)
        if not len(values):
            return np.full(len(weights), np.nan)
        order, ranks = np.argsort(values, kind='stable'), min(len(values), _RANKS)
        scene = np.repeat(np.arange(len(parts)), [len(part) for part in parts])[order]
        rank = np.arange(len(values)) * ranks // len(values)
        there = np.zeros((len(parts), ranks))
        np.add.at(there, (scene, rank), 1)
        below = np.cumsum(weights @ there, axis=1)
        middle = values[order][np.searchsorted(rank, np.arange(ranks)) + (np.bincount(rank) - 1) // 2]
        place = self.share * (below[:, -1:] - 1)
        first, second = (middle[(below <= end).sum(axis=1).clip(0, ranks - 1)] for end in (
            np.floor(place), np.ceil(place)))
        result = np.where(below[:, -1] > 0, first + (place % 1)[:, 0] * (second - first), np.nan)
        result[0] = np.quantile(values, self.share)
        return self.factor * result

    def size(self, counts: Sequence[Counts]) -> int:
        return sum(len(self.of(each)) for each in counts)


@dataclass(frozen=True)
class Average:
    """The mean of some ratios, of those that there are."""

    text: str
    parts: Sequence[Ratio]
    unit: str = ''
    digits: int = 3

    def values(self, counts: Sequence[Counts], weights: np.ndarray) -> np.ndarray:
        parts = np.ma.masked_invalid([part.values(counts, weights) for part in self.parts])
        return parts.mean(axis=0).filled(np.nan)

    def size(self, counts: Sequence[Counts]) -> int:
        return sum(part.size(counts) for part in self.parts)


def of_sums(text: str, top: str, bottom: str = '', **options: Any) -> Ratio:
    """Return the ratio of two sums of counts by their names, or the first one."""
    return Ratio(text, lambda counts: counts.sums[top], (lambda counts: counts.sums[bottom]) if bottom else None,
                 **options)


def of_rows(text: str, table: str, wanted: Rows, among: Rows = every, **options: Any) -> Ratio:
    """Return the share of the rows of a table that are `wanted`, of those `among` which it counts."""
    def rows(counts: Counts) -> np.ndarray:
        return counts.rows[table][among(counts.rows[table])]
    return Ratio(text, lambda counts: float(wanted(rows(counts)).sum()), lambda counts: float(len(rows(counts))),
                 **options)


def within(text: str, table: str, most: float, among: Rows = every, column: str = 'error', **options: Any) -> Ratio:
    """Return the share of some rows of a table in which a column is this at most."""
    return of_rows(text, table, lambda rows: rows[column] <= most, among, **options)


def values_of(table: str, column: str, among: Rows = every) -> Callable[[Counts], np.ndarray]:
    """Return what gives the finite values of a column, of some rows of a table."""
    def values(counts: Counts) -> np.ndarray:
        found = counts.rows[table][among(counts.rows[table])][column]
        return np.asarray(found[np.isfinite(found)])
    return values


def mean_of(text: str, values: Callable[[Counts], np.ndarray], unit: str, digits: int, factor: float = 1.0) -> Ratio:
    """Return the mean of the values of all scenes."""
    return Ratio(text, lambda counts: float(values(counts).sum()), lambda counts: float(len(values(counts))), unit,
                 digits, factor)


def draws(scenes: int, resamples: int = RESAMPLES) -> np.ndarray:
    """Return how often each scene counts, (1 + resamples, scenes): once, then as drawn."""
    random = np.random.RandomState(SEED)
    drawn = random.multinomial(scenes, np.full(scenes, 1 / max(scenes, 1)), resamples) if scenes else (
        np.zeros((resamples, 0)))
    return np.concatenate([np.ones((1, scenes)), drawn])


def figures(counts: Sequence[Counts], statistics: Mapping[str, object], resamples: int = RESAMPLES
            ) -> Dict[str, Figure]:
    """Return the figures of pooled scenes by name, with intervals where at least two scenes tell of them."""
    weights = draws(len(counts), resamples)
    return {name: _figure(each, each.values(counts, weights), counts) for name, each in statistics.items()}


def few_scenes(counts: Sequence[Counts], blocks: Sequence[Counts], statistics: Mapping[str, object]
               ) -> Dict[str, Figure]:
    """Return the figures of scenes; of less than five with intervals by bootstrap over blocks, see `blocks_of`."""
    if len(counts) >= FEW:
        return figures(counts, statistics)
    drawn = figures(blocks, statistics)
    return {name: figure._replace(low=drawn[name].low, high=drawn[name].high)
            for name, figure in figures(counts, statistics, 0).items()}


def differences(before: Sequence[Counts], after: Sequence[Counts], statistics: Mapping[str, object]
                ) -> Dict[str, Figure]:
    """Return how the figures change from one run to another on the same scenes, with paired intervals.

    Raises:
        ValueError: the scenes differ.
    """
    if [each.scene for each in before] != [each.scene for each in after]:
        raise ValueError('a paired difference needs the same scenes in the same order')
    weights = draws(len(before))
    return {name: _figure(each, each.values(after, weights) - each.values(before, weights), before)
            for name, each in statistics.items()}


def figures_of(groups: Mapping[str, Sequence[Counts]], statistics: Mapping[str, object]
               ) -> Dict[str, Dict[str, Figure]]:
    """Return the figures of groups of scenes."""
    return {group: figures(counts, statistics) for group, counts in groups.items()}


def named(groups: Mapping[str, Mapping[str, Figure]]) -> Dict[str, Figure]:
    """Return the figures of groups as GROUP_NAME; those of the group '' as NAME."""
    return {f'{group}_{name}'.lstrip('_'): figure for group, each in groups.items() for name, figure in each.items()}


def rows_of(groups: Mapping[str, Mapping[str, Figure]], names: Mapping[str, str], first: str) -> List[List[Any]]:
    """Return the rows of a table: one for each group that has figures, one column for each name with its title."""
    found = {title: [each[name] for name in names] for title, each in groups.items()}
    return [[first, 'scenes', *names.values()],
            *([title, max(figure.scenes for figure in each), *each] for title, each in found.items()
              if any(figure.value is not None for figure in each))]


def _figure(statistic: object, values: np.ndarray, counts: Sequence[Counts]) -> Figure:
    sizes = [statistic.size([each]) for each in counts]
    size, scenes = sum(sizes), int(np.count_nonzero(sizes))
    if not np.isfinite(values[0]):
        return Figure(None, None, None, size, statistic.unit, statistic.digits, statistic.text, scenes)
    low, high = (None, None)
    drawn = values[1:][np.isfinite(values[1:])]
    if scenes > 1 and len(drawn):
        low, high = (float(each) for each in np.quantile(drawn, ((1 - LEVEL) / 2, (1 + LEVEL) / 2)))
    return Figure(float(values[0]), low, high, size, statistic.unit, statistic.digits, statistic.text, scenes)
