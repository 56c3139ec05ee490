"""What people wear: mean colours of the upper and the lower part of the clothes."""
from typing import Sequence, Tuple

import cv2
import numpy as np

from skeleton_extract_3d.body.body import HIPS, MIDDLES, SHOULDERS

_CHEST = np.concatenate([SHOULDERS, HIPS])
# Hip and knee of both sides, (2 sides, 2 ends).
_THIGHS = np.stack([HIPS, MIDDLES[2:]], axis=1)


def _between(shares: Sequence[float]) -> np.ndarray:
    """Return the weights of two ends at places between them, (N, 2)."""
    return np.array([(1 - share, share) for share in shares])


# Weights of the joints at pixels on the chest, in four rows of three, (12, 4), and of those on a thigh, (3, 2).
_ON_CHEST = np.kron(_between([0.2, 0.4, 0.6, 0.8]), _between([0.15, 0.5, 0.85]))
_ON_THIGH = _between([0.15, 0.4, 0.65])
# A measured colour counts like so many frames at most, so that light may change.
MEMORY = 30.0


def clothes_pixels(uv: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return pixels on the chest and on the thighs, (P, 12, 2) and (P, 6, 2), NaN where joints are missing.

    Args:
        uv: (P, 18, 2) [px].
    """
    thighs = _ON_THIGH @ uv[:, _THIGHS]
    return _ON_CHEST @ uv[:, _CHEST], thighs.reshape(len(uv), 2 * len(_ON_THIGH), 2)


def mean_colours(bgr: np.ndarray, pixels: np.ndarray, usable: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the mean colour at pixels of each person (CIELAB, L 0..100), (P, 3), and how many were usable, (P,).

    Args:
        bgr: (H, W, 3) uint8.
        pixels: (P, N, 2) [px of this image].
        usable: (P, N) which of them show the person.
    """
    height, width = bgr.shape[:2]
    at = np.rint(np.where(usable[..., None] & np.isfinite(pixels), pixels, -1.0)).astype(np.int64)
    u, v = at[..., 0], at[..., 1]
    usable = (u >= 0) & (v >= 0) & (u < width) & (v < height)
    if not usable.any():
        return np.zeros((len(pixels), 3)), np.zeros(len(pixels), np.int64)
    colours = bgr[np.where(usable, v, 0), np.where(usable, u, 0)]
    lab = cv2.cvtColor(colours.astype(np.float32) / 255, cv2.COLOR_BGR2LAB)
    count = usable.sum(axis=1)
    return (lab * usable[..., None]).sum(axis=1) / np.maximum(count, 1)[:, None], count


def colour_distances(first: np.ndarray, first_known: np.ndarray, second: np.ndarray, second_known: np.ndarray
                     ) -> np.ndarray:
    """Return the mean difference (Delta E of CIE 1976) of the clothes that are known of both, (T, P); 0 of nothing.

    Args:
        first: (T, 2, 3), first_known: (T, 2) bool; second: (P, 2, 3), second_known: (P, 2) bool.
    """
    both = first_known[:, None] & second_known[None]
    difference = np.sqrt(((first[:, None] - second[None]) ** 2).sum(axis=3))
    return np.where(both, difference, 0.0).sum(axis=2) / np.maximum(both.sum(axis=2), 1)
