"""Boxes round people."""
from typing import NamedTuple

import numpy as np


class Box(NamedTuple):
    """A box along the axes.

    Attributes:
        centre, size: (D,), in the unit of the points.
    """

    centre: np.ndarray
    size: np.ndarray


def box_round(points: np.ndarray, margin: float) -> Box:
    """Return the box round the points (K, D) that are not NaN, one at least, wider by a margin on each side."""
    known = points[np.isfinite(points).all(axis=1)].astype(np.float64)
    least, most = known.min(axis=0), known.max(axis=0)
    return Box((least + most) / 2, most - least + 2 * margin)
