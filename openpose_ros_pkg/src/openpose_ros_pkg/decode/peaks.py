"""Peaks of confidence maps: where joints may be."""
from dataclasses import dataclass
from typing import Optional, Tuple

import cv2
import numpy as np


@dataclass(frozen=True)
class Peaks:
    """N possible joints, sorted by joint, the strongest of each joint first.

    Attributes:
        joint: (N,) int64, channel of the joint.
        xy: (N, 2) float32 [px of the network's input].
        score: (N,) float32, height of the peak, at most 1.
    """

    joint: np.ndarray
    xy: np.ndarray
    score: np.ndarray

    def __len__(self) -> int:
        return len(self.joint)

    def take(self, which: np.ndarray) -> 'Peaks':
        """Return some of the peaks, by index or mask."""
        return Peaks(self.joint[which], self.xy[which], self.score[which])


def find_peaks(heatmaps: np.ndarray, stride: int, upsample: int, threshold: float, max_per_joint: int,
               max_total: int, valid_size: Optional[Tuple[int, int]] = None) -> Peaks:
    """Find local maxima above a threshold, with sub-pixel positions.

    Args:
        heatmaps: (K, h, w) float32, one per joint.
        stride: network pixels per cell.
        upsample: factor by which the maps are enlarged first.
        threshold: height that a peak must exceed.
        max_per_joint, max_total: how many are kept, the strongest first.
        valid_size: (width, height) [px of the network's input]; peaks beyond are left out.
    """
    maps = framed_maps(heatmaps, upsample)
    row = maps.shape[2]
    flat = maps.reshape(-1)
    found = np.flatnonzero(flat > threshold)
    # Strict on one side only, so that two equal neighbours are one peak.
    for step in (-1, -row, -row - 1, -row + 1):
        found = found[flat[found] > flat[found + step]]
    for step in (1, row, row - 1, row + 1):
        found = found[flat[found] >= flat[found + step]]

    joint, y, x = np.unravel_index(found, maps.shape)
    xy = np.stack([x - 1 + _parabola_offset(flat, found, 1), y - 1 + _parabola_offset(flat, found, row)], axis=1)
    xy = (xy + 0.5) * (stride / upsample) - 0.5
    peaks = Peaks(joint, xy.astype(np.float32), np.minimum(flat[found], 1.0))
    if valid_size is not None:
        peaks = peaks.take((peaks.xy <= np.subtract(valid_size, 0.5)).all(axis=1))
    return _strongest(peaks, max_per_joint, max_total)


def framed_maps(heatmaps: np.ndarray, upsample: int) -> np.ndarray:
    """Enlarge maps and frame them with -inf, so that every real cell has eight neighbours that it can beat.

    Returns:
        (K, h * upsample + 2, w * upsample + 2) float32.
    """
    count, height, width = heatmaps.shape
    height, width = height * upsample, width * upsample
    padded = np.full((count, height + 2, width + 2), -np.inf, np.float32)
    for source, target in zip(heatmaps, padded[:, 1:-1, 1:-1]):
        target[:] = source if upsample == 1 else cv2.resize(source, (width, height), interpolation=cv2.INTER_CUBIC)
    return padded


def _parabola_offset(flat: np.ndarray, centre: np.ndarray, step: int) -> np.ndarray:
    """Return where the parabola through a peak and its two neighbours has its top [cells, within +-0.5]."""
    before, top, after = flat[centre - step], flat[centre], flat[centre + step]
    inside = np.isfinite(before) & np.isfinite(after)
    before, after = np.where(inside, before, 0), np.where(inside, after, 0)
    curvature = 2 * top - before - after
    offset = np.divide(after - before, 2 * curvature, out=np.zeros_like(top), where=inside & (curvature > 0))
    return np.clip(offset, -0.5, 0.5)


def _strongest(peaks: Peaks, max_per_joint: int, max_total: int) -> Peaks:
    """Sort by joint and falling score, and keep the strongest."""
    peaks = peaks.take(np.lexsort((-peaks.score, peaks.joint)))
    rank = np.arange(len(peaks)) - np.searchsorted(peaks.joint, peaks.joint)
    peaks = peaks.take(rank < max_per_joint)
    if len(peaks) > max_total:
        peaks = peaks.take(np.sort(np.argsort(-peaks.score, kind='stable')[:max_total]))
    return peaks
