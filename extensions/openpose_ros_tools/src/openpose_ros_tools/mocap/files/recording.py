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
        repeated = sorted(name for name, number in Counter(self.names).items() if number > 1)
        if repeated:
            raise ValueError(f"expected each name once, got more of {', '.join(repeated)}")
        if not np.isfinite(self.times).all():
            raise ValueError(f'times: sample {int(np.argmin(np.isfinite(self.times)))} has none')
        late = np.flatnonzero(np.diff(self.times) <= 0)
        if len(late):
            raise ValueError(f'times: expected increasing ones, but {self.times[late[0]]:g} s is followed by '
                             f'{self.times[late[0] + 1]:g} s')
        if self.positions.shape != (len(self.times), len(self.names), 3):
            raise ValueError(f'positions: expected {(len(self.times), len(self.names), 3)}, got {self.positions.shape}')
        finite = np.isfinite(self.positions)
        if (finite.any(axis=-1) != finite.all(axis=-1)).any():
            raise ValueError('positions: x, y and z must be all finite or all NaN')

    def __len__(self) -> int:
        return len(self.times)


def unique_names(names: Iterable[str]) -> List[str]:
    """Return names with the second of equal ones called `NAME (2)`, the third `NAME (3)` and so on."""
    result: Dict[str, None] = {}
    for name in names:
        candidates = chain([name], (f'{name} ({number})' for number in count(2)))
        result[next(candidate for candidate in candidates if candidate not in result)] = None
    return list(result)
