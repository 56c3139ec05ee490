"""Depth of the view that an image shows, as far as those who look for people in it use it."""
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class DepthView:
    """How far away what an image shows is.

    Attributes:
        depth: (h, w) float32 [m], along the optical axis; NaN where missing. Of the same view as the image, at any
            size.
        focal: focal length, in pixels of `depth`.
    """

    depth: np.ndarray
    focal: float
