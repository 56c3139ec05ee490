"""Stick figures of a comparison with motion capture."""
from typing import Any, Optional, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.mocap.evaluation import Comparison
from openpose_ros_tools.plots.plotting import HELP_COLOUR, new_figure, person_colours
from openpose_ros_tools.tables.keypoint_selection import upright_axis
from skeleton_extract_3d.people import INFERRED, MEASURED

_REFERENCE_COLOUR = '#000000'
# Lines of stick figures: reference, estimate.
_THIN, _THICK = 1.3, 2.0
# Number of stick figures, and the margin around them [m].
_MOMENTS, _MARGIN = 6, 0.1
# Direction from which stick figures are seen: angle to the side, angle above [degrees].
_VIEW = (20.0, 14.0)


def stick_figures(comparison: Comparison) -> Figure:
    """Draw the people at some times, estimate over reference, seen from above the side, all at the same scale."""
    moments = np.unique(comparison.times[comparison.found])
    moments = moments[np.unique(np.linspace(0, len(moments) - 1, _MOMENTS + 2).round().astype(int)[1:-1])]
    shown = np.isin(comparison.times, moments)
    project = _view(comparison, shown)
    corners = (comparison.truth[shown] @ project.T).reshape(-1, 2)
    low, high = np.nanmin(corners, axis=0) - _MARGIN, np.nanmax(corners, axis=0) + _MARGIN
    width, height = high - low
    columns = min(len(moments), 3 if width > 0.7 * height else _MOMENTS)
    lines = -(-len(moments) // columns)
    figure = new_figure(11.5, min(lines * (11.5 / columns * height / width + 0.3), 14.0) + 0.5)
    grid = np.array(figure.subplots(lines, columns, squeeze=False)).ravel()
    colours = person_colours(np.unique(comparison.subject[comparison.found]).tolist())
    for axes, moment in zip(grid, moments):
        for row in np.flatnonzero(comparison.times == moment):
            _stick_figure(axes, comparison.joints, comparison.truth[row] @ project.T, _REFERENCE_COLOUR)
            if comparison.found[row]:
                _stick_figure(axes, comparison.joints, comparison.estimate[row] @ project.T,
                              colours[comparison.subject[row]], comparison.status[row])
        axes.set_title(f'{moment:.2f} s', fontsize='small')
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect='equal')
    for axes in grid:
        axes.set_axis_off()
    handles = [Line2D([], [], color=_REFERENCE_COLOUR, linewidth=_THIN, label='reference'),
               *(Line2D([], [], color=colour, linewidth=_THICK, label=comparison.subjects[person])
                 for person, colour in colours.items()),
               Line2D([], [], color=HELP_COLOUR, marker='o', markerfacecolor='white', linestyle='',
                      label='inferred joint')]
    figure.suptitle(' ', fontsize='medium')  # a row of its own, which the arrangement of the plots leaves free
    figure.legend(handles=handles, loc='upper center', ncol=min(len(handles), 8), frameon=False, fontsize='small')
    return figure


def has_limbs(comparison: Comparison) -> bool:
    """Return whether stick figures have a line."""
    return any({start, end} <= set(comparison.joints) for start, end in COCO_18.drawn_limbs)


def _stick_figure(axes: Any, joints: Sequence[str], points: np.ndarray, colour: str,
                  status: Optional[np.ndarray] = None) -> None:
    """Draw a person, (K, 2) [m] in the plot; with a status joints as well, those that are inferred as circles."""
    for limb in COCO_18.drawn_limbs:
        if set(limb) <= set(joints):
            axes.plot(*points[[joints.index(joint) for joint in limb]].T, color=colour, solid_capstyle='round',
                      linewidth=_THIN if status is None else _THICK, alpha=1.0 if status is None else 0.8)
    if status is not None:
        for kind, face, size in ((MEASURED, colour, 3.0), (INFERRED, 'white', 4.0)):
            axes.plot(*points[status == kind].T, 'o', color=colour, markerfacecolor=face, markersize=size)


def _view(comparison: Comparison, shown: np.ndarray) -> np.ndarray:
    """Return the parallel projection (2, 3) from the reference's frame: from above, a little to the side.

    Args:
        shown: (N,) bool, rows that are drawn; where they spread most is from left to right.
    """
    axis, sign = upright_axis(comparison.joints, comparison.truth[comparison.found]) or (2, 1)
    up = sign * np.eye(3)[axis]
    points = comparison.truth[shown].reshape(-1, 3)
    ground = points[np.isfinite(points).all(axis=1)]
    ground = ground - np.outer(ground @ up, up)
    across = np.linalg.svd(ground - ground.mean(axis=0), full_matrices=False)[2][0]
    away = np.cross(up, across)
    turn, above = np.radians(_VIEW)
    back = np.cos(turn) * away - np.sin(turn) * across
    return np.stack([np.cos(turn) * across + np.sin(turn) * away, np.sin(above) * back + np.cos(above) * up])
