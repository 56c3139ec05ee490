"""Whether points are the depth of a view: no depth at all, another unit, the same depth again and again."""
from typing import NamedTuple, Optional, Tuple

import numpy as np

from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.points.point_grid import PointGrid

_PLAUSIBLE = METHOD.plausibility


class Doubt(NamedTuple):
    """Something that is wrong with the input although it can be read.

    Attributes:
        event: what a node counts.
        text: what is wrong, with values, and a likely cause.
    """

    event: str
    text: str


class PointSummary(NamedTuple):
    """What points are like as a whole.

    Attributes:
        sample: distances of a grid of them [m]; NaN where missing.
        valid: share of these that are valid.
        depth: median of these [m]; NaN if there is none.
        doubt: why they are no depth in metres; None: they may be.
    """

    sample: np.ndarray
    valid: float
    depth: float
    doubt: Optional[Doubt]


def summarize(points: PointGrid) -> PointSummary:
    """Return what points are like."""
    columns, rows = _sample_pixels(points.width, points.height)
    sample = points.distances(columns, rows)
    distances = sample[np.isfinite(sample)]
    share = distances.size / sample.size
    if distances.size < _PLAUSIBLE.least_valid:
        return PointSummary(sample, share, np.nan, Doubt(
            'no depth', f'{100 * share:.2g} % of the points are valid, the others are '
                        f'{points.missing_values(columns, rows)}: is the depth camera covered, or is this another '
                        'topic?'))
    depth, (least, most) = float(np.median(distances)), _PLAUSIBLE.depths
    doubt = None
    if depth > most:
        doubt = Doubt('implausible depth', f'the median depth is {depth:.4g} m, expected up to {most:g} m: is it in '
                                           'millimetres?')
    elif depth < least:
        doubt = Doubt('implausible depth', f'the median depth is {depth:.4g} m, expected at least {least:g} m: is it '
                                           'in metres?')
    return PointSummary(sample, share, depth, doubt)


class Stillness(NamedTuple):
    """Since when the depth is the same.

    Attributes:
        sample: see `PointSummary`.
        shape: of the image when this depth came first.
        green: of that image, in the pixels of a grid.
        frames: that have the same depth and another image than that, in a row.
    """

    sample: np.ndarray
    shape: Tuple[int, ...]
    green: np.ndarray
    frames: int = 0

    def doubt(self) -> Optional[Doubt]:
        """Return what is wrong, if anything is."""
        if self.frames < _PLAUSIBLE.still_frames:
            return None
        return Doubt('depth stands still', f'the depth is the same to the bit in {self.frames} frames with other '
                                           'images: does the depth camera hang?')


def stillness(before: Optional[Stillness], summary: PointSummary, bgr: np.ndarray) -> Stillness:
    """Return since when the depth is the same, after a frame; `before` is None in the first one."""
    columns, rows = _sample_pixels(bgr.shape[1], bgr.shape[0])
    green = bgr[rows, columns, 1].astype(np.int16)
    if (before is None or before.shape != bgr.shape
            or before.sample.tobytes() != summary.sample.tobytes()):
        return Stillness(summary.sample, bgr.shape, green)
    has_changed = (np.abs(green - before.green) > _PLAUSIBLE.changed_by).mean() > _PLAUSIBLE.changed
    return before._replace(frames=before.frames + 1 if has_changed else 0)


def _sample_pixels(width: int, height: int) -> Tuple[np.ndarray, np.ndarray]:
    """Return columns (1, N) and rows (M, 1) of the pixels that are judged."""
    columns, rows = (np.linspace(0, size - 1, min(count, size)).astype(np.int64)
                     for size, count in zip((width, height), _PLAUSIBLE.grid))
    return columns[None], rows[:, None]
