"""Gated assignment (Hungarian method): which tracks and which detections belong together."""
from typing import List, Tuple

import numpy as np
from scipy.optimize import linear_sum_assignment

# Cost of a forbidden pair: any number of allowed pairs costs less.
_FORBIDDEN = 1e3


def match(costs: np.ndarray, allowed: np.ndarray) -> List[Tuple[int, int]]:
    """Return the pairs with the most matches and, among these, the least sum of costs, by ascending row.

    Args:
        costs: (N, M) float, below 1000 in sum; those of forbidden pairs may be NaN or infinite.
        allowed: (N, M) bool.

    Returns:
        Pairs of row and column, each row and each column once at most; forbidden pairs are left out.
    """
    if not np.size(costs):
        return []
    rows, columns = linear_sum_assignment(np.where(allowed, costs, _FORBIDDEN))
    return [(row, column) for row, column in zip(rows.tolist(), columns.tolist()) if allowed[row, column]]
