"""Recorded markers: the record that all file formats are read into."""
from collections import Counter
from dataclasses import dataclass
from itertools import chain, count
from typing import Dict, Iterable, List, Tuple

import numpy as np


@dataclass(frozen=True)
class MarkerRecording:
    """Positions of M markers at T times, in the frame and by the clock of the motion capture system.

    Raises:
        ValueError: shapes, names or times are wrong, or a position is half missing.
    """

    names: Tuple[str, ...]  # of the markers, each once
    times: np.ndarray  # (T,) float64 [s], increasing
    positions: np.ndarray  # (T, M, 3) float64 [m]; NaN where a marker is hidden

    def __post_init__(self) -> None:
        values = checked(self.names, self.times, self.positions, (len(self.times), len(self.names)))
        for name, value in zip(('names', 'times', 'positions'), values):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.times)


def checked(names: Iterable[str], times: np.ndarray, positions: np.ndarray, shape: Tuple[int, ...]
            ) -> Tuple[Tuple[str, ...], np.ndarray, np.ndarray]:
    """Return names, times and positions in their types.

    Args:
        shape: of the positions, without their axis of x, y, z.

    Raises:
        ValueError: a name appears twice, times do not increase, a shape is wrong, or a position is half missing.
    """
    names, times, positions = tuple(names), np.asarray(times, np.float64), np.asarray(positions, np.float64)
    repeated = sorted(name for name, number in Counter(names).items() if number > 1)
    if repeated:
        raise ValueError(f"expected each name once, got more of {', '.join(repeated)}")
    if times.ndim != 1:
        raise ValueError(f'times: expected one axis, got shape {times.shape}')
    if not np.isfinite(times).all():
        raise ValueError(f'times: sample {int(np.argmin(np.isfinite(times)))} has none')
    late = np.flatnonzero(np.diff(times) <= 0)
    if len(late):
        raise ValueError(f'times: expected increasing ones, but {times[late[0]]:g} s is followed by '
                         f'{times[late[0] + 1]:g} s')
    if positions.shape != (*shape, 3):
        raise ValueError(f'positions: expected {(*shape, 3)}, got {positions.shape}')
    finite = np.isfinite(positions)
    if (finite.any(axis=-1) != finite.all(axis=-1)).any():
        raise ValueError('positions: x, y and z must be all finite or all NaN')
    return names, times, positions


def unique_names(names: Iterable[str]) -> List[str]:
    """Return names with the second of equal ones called `NAME (2)`, the third `NAME (3)` and so on."""
    result: Dict[str, None] = {}
    for name in names:
        candidates = chain([name], (f'{name} ({number})' for number in count(2)))
        result[next(candidate for candidate in candidates if candidate not in result)] = None
    return list(result)
