"""Growth of memory, threads and files in a long run."""
from typing import List, Sequence, Tuple

import pandas as pd
from scipy.stats import theilslopes


def least_growth(values: pd.Series) -> float:
    """Return the growth of values from the first time to the last, which form the index.

    By the least slope of the 95 % confidence interval of Theil and Sen.
    """
    return float(theilslopes(values, values.index, 0.95)[2]) * (values.index[-1] - values.index[0])


def growth(samples: Sequence[Tuple[float, ...]], cycle: float, limits: Tuple[float, float, int]
           ) -> Tuple[List[str], List[str]]:
    """Return the least memory [MB], threads and files of a node in each cycle, and what grew by more than the limits.

    Args:
        samples: time [s], memory [MB], threads and files.
        cycle: its length [s].
        limits: share of the memory, memory [MB], and number of threads or files.
    """
    if not samples:
        return ['-'] * 3, ['no samples']
    table = pd.DataFrame(samples, columns=('time', 'memory', 'threads', 'files'))
    least = table.groupby((table.time // cycle).astype(int)).min().drop(columns='time')
    most = {**dict.fromkeys(least, limits[2]), 'memory': limits[0] * least.memory.median() + limits[1]}
    grown = {name: least_growth(values) for name, values in least.items()}
    return ([' '.join(f'{value:.0f}' for value in values) for _, values in least.items()],
            [f'{name} grew by at least {grown[name]:.1f}' for name in least if grown[name] > most[name]])
