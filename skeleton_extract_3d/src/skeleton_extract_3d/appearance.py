"""What people wear: mean colours of the upper and the lower part of the clothes."""
from typing import Sequence, Tuple

import cv2
import numpy as np

from skeleton_extract_3d.body import HIPS, MIDDLES, SHOULDERS

_CHEST = np.concatenate([SHOULDERS, HIPS])
# Hip and knee of both sides, (2 sides, 2 ends).
_THIGHS = np.stack([HIPS, MIDDLES[2:]], axis=1)


def _between(shares: Sequence[float]) -> np.ndarray:
    """Return the weights of two ends at places between them, (N, 2)."""
    return np.array([(1 - share, share) for share in shares])


# Weights of the joints at pixels on the chest, in four rows of three, (12, 4), and of those on a thigh, (3, 2).
_ON_CHEST = np.kron(_between([0.2, 0.4, 0.6, 0.8]), _between([0.15, 0.5, 0.85]))
_ON_THIGH = _between([0.15, 0.4, 0.65])
# Where the pixels of the upper and the lower part begin among those of a person.
_PARTS = [0, len(_ON_CHEST)]
# A measured colour counts like so many frames at most, so that light may change.
MEMORY = 30.0


def clothes_pixels(uv: np.ndarray) -> np.ndarray:
    """Return twelve pixels on the chest and then six on the thighs, (P, 18, 2), NaN where joints are missing.

    Args:
        uv: (P, 18, 2) [px].
    """
    thighs = _ON_THIGH @ uv[:, _THIGHS]
    return np.concatenate([_ON_CHEST @ uv[:, _CHEST], thighs.reshape(len(uv), 2 * len(_ON_THIGH), 2)], axis=1)


def mean_colours(bgr: np.ndarray, pixels: np.ndarray, usable: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the mean colours of the upper and the lower part of the clothes (CIELAB, L 0..100), (P, 2, 3).

    Args:
        bgr: (H, W, 3) uint8.
        pixels: (P, 18, 2) of `clothes_pixels` [px of this image].
        usable: (P, 18) which of them show the person; these are finite.

    Returns:
        The colours, and of which parts they are known, (P, 2) bool.
    """
    height, width = bgr.shape[:2]
    at = np.rint(np.where(usable[..., None], pixels, -1.0)).astype(np.int64)
    u, v = at[..., 0], at[..., 1]
    usable = (u >= 0) & (v >= 0) & (u < width) & (v < height)
    if not usable.any():
        return np.zeros((len(pixels), 2, 3)), np.zeros((len(pixels), 2), bool)
    colours = bgr[np.where(usable, v, 0), np.where(usable, u, 0)]
    lab = cv2.cvtColor(colours.astype(np.float32) / 255, cv2.COLOR_BGR2LAB)
    lab = np.where(usable[..., None], lab, 0.0)
    total = np.add.reduceat(lab, _PARTS, axis=1)
    count = np.add.reduceat(usable, _PARTS, axis=1, dtype=np.int64)
    return total / np.maximum(count, 1)[..., None], count > 0


def colour_distances(first: np.ndarray, first_known: np.ndarray, second: np.ndarray, second_known: np.ndarray
                     ) -> np.ndarray:
    """Return the mean difference (Delta E of CIE 1976) of the clothes that are known of both, (T, P); 0 of nothing.

    Args:
        first: (T, 2, 3), first_known: (T, 2) bool; second: (P, 2, 3), second_known: (P, 2) bool.
    """
    both = first_known[:, None] & second_known[None]
    difference = np.sqrt(((first[:, None] - second[None]) ** 2).sum(axis=3))
    return np.where(both, difference, 0.0).sum(axis=2) / np.maximum(both.sum(axis=2), 1)
