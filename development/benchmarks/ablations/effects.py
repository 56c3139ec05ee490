"""Figures of an ablation: counts of a scene that add up, and paired differences between variants."""
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.people import People2D
from scoring.figures import LEVEL, draws
from scoring.people import STATISTICS, is_visible, score_people
from skeleton_extract_3d.people import People3D

# Shares by name, and which way is better.
BETTER = {'persons_recall': 1, 'persons_precision': 1, 'visible_100': 1, 'hidden_150': 1, 'lies': -1, 'switches': -1,
          'visible_median': -1, 'within_2_sigma': 1, 'image_switches': -1}
TITLES = {'persons_recall': 'found', 'persons_precision': 'real', 'visible_100': 'visible', 'hidden_150': 'hidden',
          'lies': 'lies', 'switches': 'switches', 'visible_median': 'median [mm]', 'within_2_sigma': 'in 2 sigma',
          'image_switches': 'switches in the image'}
_RATIOS = [name for name in BETTER if name in STATISTICS and name != 'visible_median']
# Bins of the errors of visible joints: 1 mm wide, the last one open.
_BINS = 300
# In the image, a person is the true one within this median distance, in half diagonals of the true joints.
_SAME_IN_IMAGE = 0.5
# Differences below these tell nothing, in the unit of the figure.
_LEAST = {'visible_median': 0.1}

Sums = Dict[str, Any]
"""Of a scene, by figure: top and bottom of shares and counts; of the median, the histogram of errors [mm]."""


class Effect(NamedTuple):
    """Change of a figure against the present values, with its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def moves(self) -> bool:
        """Whether the change is beyond noise."""
        return self.low > 0 or self.high < 0


def sums_of(folder: Path, frames: Sequence[Tuple[float, People3D]]) -> Sums:
    """Return the sums of what was found in a scene: seconds from the first frame, and people."""
    counts = score_people(folder, frames)
    sums: Sums = {}
    for name in _RATIOS:
        ratio = STATISTICS[name]
        sums[name] = [ratio.top(counts), ratio.bottom(counts) if ratio.bottom else 1.0]
    joints = counts.rows['joints']
    errors = joints['error'][is_visible(joints) & np.isfinite(joints['error'])]
    sums['visible_median'] = np.bincount(np.minimum(1e3 * errors, _BINS - 1).astype(int), minlength=_BINS).tolist()
    return sums


def image_switches(true: Sequence[Sequence[Tuple[int, np.ndarray, np.ndarray]]], found: Sequence[People2D]) -> Sums:
    """Return how often a person in the image gets another id; `true`: id, uv (K, 2) [px] and labels (K,) by frame."""
    last: Dict[int, int] = {}
    switches = 0
    for there, people in zip(true, found):
        costs = np.array([[_apart(xy, uv, labels) for xy in people.xy] for _, uv, labels in there])
        for row, other in match(costs, costs < _SAME_IN_IMAGE) if costs.size else ():
            name = int(people.ids[other])
            switches += last.get(there[row][0], name) != name
            last[there[row][0]] = name
    return {'image_switches': [switches, 1.0]}


def _apart(xy: np.ndarray, uv: np.ndarray, labels: np.ndarray) -> float:
    distances = np.linalg.norm(xy - uv, axis=1)[labels > 0]
    if not np.isfinite(distances).any():
        return 1e3
    return float(np.nanmedian(distances) / max(np.linalg.norm(np.ptp(uv[labels > 0], axis=0)) / 2, 1.0))


def figures(scenes: Sequence[Sums], weights: np.ndarray) -> Dict[str, np.ndarray]:
    """Return the figures of pooled scenes for each row of weights (B, S), (B,) each."""
    found = {}
    for name in scenes[0]:
        sums = weights @ np.array([scene[name] for scene in scenes], np.float64)
        if name == 'visible_median':
            found[name] = _medians(sums)
        elif 'switches' in name:
            found[name] = sums[:, 0]
        else:
            found[name] = np.divide(sums[:, 0], sums[:, 1], out=np.zeros(len(sums)), where=sums[:, 1] > 0)
    return found


def _medians(histograms: np.ndarray) -> np.ndarray:
    """Return the medians of histograms (B, bins) [mm], linear within the bin."""
    below = histograms.cumsum(axis=1)
    half = below[:, -1:] / 2
    bins = (below < half).sum(axis=1)
    rows = np.arange(len(below))
    inside = np.maximum(histograms[rows, bins], 1e-9)
    return bins + (half[:, 0] - (below[rows, bins] - histograms[rows, bins])) / inside


def effects(scenes: Sequence[Mapping[str, Sums]], base: str) -> Dict[str, Dict[str, Effect]]:
    """Return the effect of each variant on each figure, against the base, by the scenes that have the variant."""
    result, known = {}, {}
    for variant in {name: None for scene in scenes for name in scene}:
        chosen = tuple(number for number, scene in enumerate(scenes) if variant in scene)
        weights = draws(len(chosen))
        if chosen not in known:
            known[chosen] = figures([scenes[number][base] for number in chosen], weights)
        changed = figures([scenes[number][variant] for number in chosen], weights)
        result[variant] = {name: _effect(values - known[chosen][name], _LEAST.get(name, 0.0))
                           for name, values in changed.items()}
    return result


def _effect(values: np.ndarray, least: float) -> Effect:
    low, high = np.quantile(values[1:], ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    if abs(values[0]) < least:
        return Effect(float(values[0]), min(low, 0.0), max(high, 0.0))
    return Effect(float(values[0]), float(low), float(high))


def hurts(effect: Mapping[str, Effect]) -> List[str]:
    """Return the figures that get worse beyond noise."""
    return [name for name, one in effect.items() if one.moves and one.value * BETTER[name] < 0]


def helps(effect: Mapping[str, Effect]) -> List[str]:
    """Return the figures that get better beyond noise."""
    return [name for name, one in effect.items() if one.moves and one.value * BETTER[name] > 0]
