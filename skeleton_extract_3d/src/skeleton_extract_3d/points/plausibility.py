"""Plausibility of points as the depth of a view: no depth at all, another unit, the same depth in each frame."""
from contextlib import suppress
from typing import NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.calibration import Calibration
from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.points.camera import calibrated_camera, sample_pixels
from skeleton_extract_3d.points.constants import PlausibilityConstants
from skeleton_extract_3d.points.point_grid import PointGrid

# Points that miss their pixels by a greater share of the image's width do not belong to the image.
_GREATEST_MISFIT = 0.01

NO_DEPTH = 'no depth'


class Doubt(NamedTuple):
    """A fault of the input that does not keep it from being read: what nodes count, and a text with values and a cause.
    """

    event: str
    text: str


class PointSummary(NamedTuple):
    """Distances of a grid of points [m], NaN where missing, share and median [m] of valid ones, and why they are no
    depth in metres; None: plausible.
    """

    sample: np.ndarray
    valid: float
    depth: float
    doubt: Optional[Doubt]


def summarize(points: PointGrid, constants: PlausibilityConstants = METHOD.plausibility) -> PointSummary:
    """Return the summary of points."""
    columns, rows = sample_pixels(points.width, points.height)
    sample = points.distances(columns, rows)
    distances = sample[np.isfinite(sample)]
    share = distances.size / sample.size
    if distances.size < constants.least_valid:
        return PointSummary(sample, share, np.nan, Doubt(
            NO_DEPTH, f'{100 * share:.2g} % of the points are valid, the others are '
                        f'{points.missing_values(columns, rows)}: is the depth camera covered, or is this another '
                        'topic?'))
    depth, (least, most) = float(np.median(distances)), constants.depths
    doubt = None
    if not least <= depth <= most:
        said, unit = (f'up to {most:g}', 'millimetres') if depth > most else (f'at least {least:g}', 'metres')
        doubt = Doubt('implausible depth', f'the median depth is {depth:.4g} m, expected {said} m: is it in {unit}?')
    return PointSummary(sample, share, depth, doubt)


def registration_fault(points: PointGrid, calibration: Optional[Calibration]) -> str:
    """Return why points are not those of the pixels of an image; '': they are, or its camera is not known.

    Args:
        calibration: of the image, which may be rectified.
    """
    u, v = (axis.ravel() for axis in np.meshgrid(*(np.linspace(0, size - 1, 24).astype(np.int64)
                                                   for size in (points.width, points.height))))
    sample, misfits = points.window(u, v, 1)[:, 0], []
    if calibration is None or not np.isfinite(sample).all(axis=1).any() or np.nanmin(sample[:, 2]) < 0:
        return ''
    for rectified in (False, True):
        with suppress(BadInputError):  # not calibrated
            camera = calibrated_camera(calibration, rectified)
            pixels = np.stack([u, v], axis=1) * (camera.width / points.width, camera.height / points.height)
            misfits.append(float(np.nanmedian(np.hypot(*(camera.project(sample) - pixels).T))) / camera.width)
    if not misfits or min(misfits) <= _GREATEST_MISFIT:
        return ''
    return (f'its points miss their pixels in the image by {100 * min(misfits):.2g} % of the width: it is not '
            'registered to the colour image')


class Stillness(NamedTuple):
    """Since when the depth is the same: shape and green of the image then, and frames in a row with another image."""

    sample: np.ndarray
    shape: Tuple[int, ...]
    green: np.ndarray
    frames: int = 0

    def doubt(self, constants: PlausibilityConstants = METHOD.plausibility) -> Optional[Doubt]:
        """Return the doubt that the depth camera works, if there is one."""
        if self.frames < constants.still_frames:
            return None
        return Doubt('depth stands still', f'the depth is the same to the bit in {self.frames} frames with other '
                                           'images: does the depth camera hang?')


def stillness(before: Optional[Stillness], summary: PointSummary, bgr: np.ndarray,
              constants: PlausibilityConstants = METHOD.plausibility) -> Stillness:
    """Return since when the depth is the same, after a frame; `before` is None in the first one."""
    columns, rows = sample_pixels(bgr.shape[1], bgr.shape[0])
    green = bgr[rows, columns, 1].astype(np.int16)
    if (before is None or before.shape != bgr.shape
            or before.sample.tobytes() != summary.sample.tobytes()):
        return Stillness(summary.sample, bgr.shape, green)
    has_changed = (np.abs(green - before.green) > constants.changed_by).mean() > constants.changed
    return before._replace(frames=before.frames + 1 if has_changed else 0)
