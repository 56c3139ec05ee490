"""What people wear: mean colours of the upper and the lower part of the clothes."""
from typing import Tuple

import cv2
import numpy as np

from skeleton_extract_3d.body import HIPS, MIDDLES, SHOULDERS

_SHARES = np.array([0.2, 0.4, 0.6, 0.8])
_SIDEWAYS = np.array([0.15, 0.5, 0.85])
_DOWN = np.array([0.15, 0.4, 0.65])
# A measured colour counts like so many frames at most, so that light may change.
MEMORY = 30.0


def clothes_pixels(uv: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return pixels on the chest and on the thighs, (P, 12, 2) and (P, 6, 2), NaN where joints are missing.

    Args:
        uv: (P, 18, 2) [px].
    """
    top = uv[:, SHOULDERS[0], None] + _SIDEWAYS[:, None] * (uv[:, SHOULDERS[1], None] - uv[:, SHOULDERS[0], None])
    bottom = uv[:, HIPS[0], None] + _SIDEWAYS[:, None] * (uv[:, HIPS[1], None] - uv[:, HIPS[0], None])
    chest = top[:, None] + _SHARES[:, None, None] * (bottom - top)[:, None]
    knees = uv[:, MIDDLES[2:]]
    thighs = uv[:, HIPS, None] + _DOWN[:, None] * (knees - uv[:, HIPS])[:, :, None]
    return chest.reshape(len(uv), -1, 2), thighs.reshape(len(uv), -1, 2)


def mean_colours(bgr: np.ndarray, pixels: np.ndarray, usable: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the mean colour at pixels of each person (CIELAB, L 0..100), (P, 3), and how many were usable, (P,).

    Args:
        bgr: (H, W, 3) uint8.
        pixels: (P, N, 2) [px of this image].
        usable: (P, N) which of them show the person.
    """
    height, width = bgr.shape[:2]
    at = np.rint(np.where(np.isfinite(pixels), pixels, -1)).astype(np.int64)
    usable = usable & (at >= 0).all(axis=2) & (at[..., 0] < width) & (at[..., 1] < height)
    if not usable.any():
        return np.zeros((len(pixels), 3)), np.zeros(len(pixels))
    colours = bgr[np.where(usable, at[..., 1], 0), np.where(usable, at[..., 0], 0)]
    lab = cv2.cvtColor(colours.astype(np.float32) / 255, cv2.COLOR_BGR2LAB)
    count = usable.sum(axis=1)
    return (lab * usable[..., None]).sum(axis=1) / np.maximum(count, 1)[:, None], count.astype(np.float64)


def colour_distances(first: np.ndarray, first_known: np.ndarray, second: np.ndarray, second_known: np.ndarray
                     ) -> np.ndarray:
    """Return the mean difference (Delta E of CIE 1976) of the clothes that are known of both, (T, P); 0 of nothing.

    Args:
        first: (T, 2, 3), first_known: (T, 2) bool; second: (P, 2, 3), second_known: (P, 2) bool.
    """
    both = first_known[:, None] & second_known[None]
    difference = np.sqrt(((first[:, None] - second[None]) ** 2).sum(axis=3))
    return np.where(both, difference, 0.0).sum(axis=2) / np.maximum(both.sum(axis=2), 1)
