"""Hands in the image and in space against the true hand points of a scene.

A true hand counts where 5 points are in the image. Hands of a frame are paired whatever their side, by the median
distance of their points in the image, in sizes of the hand: the longer edge of the box around its true points.
"""
import json
from pathlib import Path
from typing import Callable, Dict, Iterable, List, NamedTuple, Sequence, Tuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from .counts import Counts, tags_of
from .figures import Quantile, Ratio
from .people import OUTSIDE, VISIBLE

LEAST_POINTS = 5
# Maximum median distance of a pair, in sizes of the hand.
GATE = 1.0
FINGERS = ('wrist', 'thumb', 'index', 'middle', 'ring', 'little')
# One row for each point of each true hand: error in space [m] and in the image [hand sizes].
POINT = np.dtype([('left', '?'), ('finger', 'u1'), ('label', 'u1'), ('error', 'f8'), ('apart', 'f8')])


class Hand(NamedTuple):
    """A hand: whether it is the left one, its points in the image (21, 2) [px] and in space (21, 3) [m]."""

    left: bool
    uv: np.ndarray
    xyz: np.ndarray


def score_hands(folder: Path, frames: Iterable[Tuple[float, Sequence[Hand]]]) -> Counts:
    """Count the hands of each true frame of a scene; frames are given by their stamps [s]."""
    truth = json.loads((folder / 'gt.json').read_text())['frames']
    times = np.array([frame['t'] for frame in truth])
    found: List[List[Hand]] = [[] for _ in truth]
    for seconds, hands in frames:
        found[int(np.abs(times - seconds).argmin())] += hands
    sums: Dict[str, float] = dict.fromkeys(('true', 'found', 'paired', 'sides'), 0)
    rows = [np.zeros(0, POINT)]
    for frame, hands in zip(truth, found):
        true = [(Hand(hand['side'] == 'left', np.array(hand['uv']), np.array(hand['xyz'])), np.array(hand['vis']))
                for person in frame['people'] for hand in person.get('hands', ())]
        true = [(hand, labels) for hand, labels in true if (labels != OUTSIDE).sum() >= LEAST_POINTS]
        apart = np.array([[_apart(hand, other) for other in hands] for hand, _ in true]).reshape(len(true), len(hands))
        pairs = {row: hands[other] for row, other in zip(*linear_sum_assignment(apart)) if apart[row, other] <= GATE}
        for name, count in (('true', len(true)), ('found', len(hands)), ('paired', len(pairs)),
                            ('sides', sum(true[row][0].left == other.left for row, other in pairs.items()))):
            sums[name] += count
        rows += [_rows(hand, labels, pairs.get(row)) for row, (hand, labels) in enumerate(true)]
    return Counts(folder.resolve().name, tags_of(folder), sums, {'points': np.concatenate(rows)})


def _size(hand: Hand) -> float:
    return float(np.ptp(hand.uv, axis=0).max())


def _apart(true: Hand, other: Hand) -> float:
    distances = np.linalg.norm(true.uv - other.uv, axis=1) / _size(true)
    return min(float(np.nanmedian(distances)), 1e3) if np.isfinite(distances).any() else 1e3


def _rows(true: Hand, labels: np.ndarray, found: Hand) -> np.ndarray:
    rows = np.zeros(len(labels), POINT)
    rows['left'], rows['label'] = true.left, labels
    rows['finger'] = (np.arange(len(labels)) + 3) // 4
    rows['error'] = np.nan if found is None else np.linalg.norm(true.xyz - found.xyz, axis=1)
    rows['apart'] = np.nan if found is None else np.linalg.norm(true.uv - found.uv, axis=1) / _size(true)
    return rows


def _points(visible: bool) -> Callable[[Counts], np.ndarray]:
    return lambda counts: counts.rows['points'][(counts.rows['points']['label'] == VISIBLE) if visible else (
        (counts.rows['points']['label'] != VISIBLE) & (counts.rows['points']['label'] != OUTSIDE))]


def _share(text: str, visible: bool, column: str, most: float) -> Ratio:
    rows = _points(visible)
    return Ratio(text, lambda counts: float((rows(counts)[column] <= most).sum()),
                 lambda counts: float(len(rows(counts))))


def _median(text: str, column: str, unit: str, digits: int, factor: float) -> Quantile:
    rows = _points(True)
    return Quantile(text, lambda counts: rows(counts)[column][np.isfinite(rows(counts)[column])], 0.5, unit, digits,
                    factor)


STATISTICS = {
    'recall': Ratio('hands found, of the true ones', lambda counts: counts.sums['paired'],
                    lambda counts: counts.sums['true']),
    'precision': Ratio('hands that are real, of those found', lambda counts: counts.sums['paired'],
                       lambda counts: counts.sums['found']),
    'side': Ratio('of these with the right side', lambda counts: counts.sums['sides'],
                  lambda counts: counts.sums['paired']),
    'visible_20': _share('visible points within 20 mm', True, 'error', 0.02),
    'visible_10': _share('visible points within 10 mm', True, 'error', 0.01),
    'visible_median': _median('median error of visible points', 'error', 'mm', 1, 1e3),
    'hidden_20': _share('hidden points within 20 mm', False, 'error', 0.02),
    'image_01': _share('visible points within 0.1 hand sizes in the image', True, 'apart', 0.1),
    'image_02': _share('visible points within 0.2 hand sizes in the image', True, 'apart', 0.2),
    'image_median': _median('median error of visible points in the image', 'apart', 'hand sizes', 3, 1.0)}
