"""People as a network gives them, and which of their points are in its image and sure enough."""
from typing import NamedTuple, Tuple

import numpy as np


class Decoded(NamedTuple):
    """People of a network, with as many points as `Model.points` and in their order."""

    points: np.ndarray  # (P, K, 3) float64: x, y [px of the input, an integer is a pixel's centre], score
    scores: np.ndarray  # (P,) float64


def only_seen(points: np.ndarray, valid: Tuple[int, int, int, int], least: float) -> np.ndarray:
    """Return points (P, K, 3), x, y [px of the network's input], score; (NaN, NaN, 0) where they are missing.

    Args:
        valid: left, top, width and height of the image within the input [px]; points beyond are missing.
        least: score that a point needs, besides one above 0.
    """
    left, top, width, height = valid
    x, y, confidence = np.moveaxis(points, 2, 0)
    with np.errstate(invalid='ignore'):
        # A pixel reaches half a pixel beyond its centre.
        seen = (np.abs(x - left + 0.5 - width / 2) <= width / 2) & (np.abs(y - top + 0.5 - height / 2) <= height / 2)
        seen &= (confidence > 0) & (confidence >= least) & (confidence < np.inf)
    return np.where(seen[..., np.newaxis], points, (np.nan, np.nan, 0))
