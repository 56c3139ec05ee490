"""What a motion capture system recorded: the type that all its file formats are read into."""
from dataclasses import dataclass
from itertools import chain, count
from typing import Dict, Iterable, List, Tuple

import numpy as np


@dataclass(frozen=True)
class MarkerRecording:
    """Positions of M markers at T times, in the frame and by the clock of the motion capture system.

    Attributes:
        names: of the markers, each once. Motive's bones and rigid bodies are among them, see `motive.read_motive_csv`.
        times: (T,) float64 [s], increasing.
        positions: (T, M, 3) float64 [m]; NaN where a marker was not seen.

    Raises:
        ValueError: shapes, names or times are wrong, or a position is half missing.
    """

    names: Tuple[str, ...]
    times: np.ndarray
    positions: np.ndarray

    def __post_init__(self) -> None:
        names, times = tuple(self.names), np.asarray(self.times, np.float64)
        positions = np.asarray(self.positions, np.float64)
        repeated = sorted(name for name in set(names) if names.count(name) > 1)
        if repeated:
            raise ValueError(f"names: expected each once, got more of {', '.join(repeated)}")
        check_times(times)
        if positions.shape != (len(times), len(names), 3):
            raise ValueError(f'positions: expected {(len(times), len(names), 3)}, got {positions.shape}')
        check_positions(positions)
        for name, value in (('names', names), ('times', times), ('positions', positions)):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.times)

    @property
    def rate(self) -> float:
        """Mean number of samples per second [Hz]; NaN of fewer than two."""
        return (len(self) - 1) / float(self.times[-1] - self.times[0]) if len(self) > 1 else np.nan


def check_times(times: np.ndarray) -> None:
    """Raise ValueError unless times are one axis of finite, increasing numbers."""
    if times.ndim != 1:
        raise ValueError(f'times: expected one axis, got shape {times.shape}')
    if not np.isfinite(times).all():
        raise ValueError(f'times: sample {int(np.argmin(np.isfinite(times)))} has none')
    late = np.diff(times) <= 0
    if late.any():
        row = int(np.argmax(late))
        raise ValueError(f'times: expected increasing ones, but {times[row]:g} s is followed by {times[row + 1]:g} s')


def check_positions(positions: np.ndarray) -> None:
    """Raise ValueError if a position has some of x, y, z but not all."""
    finite = np.isfinite(positions)
    if (finite.any(axis=-1) != finite.all(axis=-1)).any():
        raise ValueError('positions: x, y and z must be all finite or all NaN')


def unique_names(names: Iterable[str]) -> List[str]:
    """Return names with the second of equal ones called `NAME (2)`, the third `NAME (3)` and so on."""
    result: Dict[str, None] = {}
    for name in names:
        candidates = chain([name], (f'{name} ({number})' for number in count(2)))
        result[next(candidate for candidate in candidates if candidate not in result)] = None
    return list(result)
