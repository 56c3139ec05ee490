"""Distance, speed and joint angles of people over time, on the time axis of a page."""
from typing import Dict, List, Sequence, Tuple

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from openpose_ros_tools.motion.angles import ANGLES, SIDED_ANGLES, joint_angles
from openpose_ros_tools.plots import plotting
from openpose_ros_tools.tables.keypoint_selection import Selection, ground_places

LEFT, RIGHT = 0.08, 0.985
"""Where the time axis begins and ends, as shares of a figure's width."""
_WIDTH, _ROW, _TOP, _BOTTOM = 11.0, 0.95, 0.25, 0.5  # [inches]
_SIDES = {'right': plotting.PALETTE[1], 'left': plotting.PALETTE[0]}
# Lines are simplified where they change by less [px].
_SIMPLIFIED = 0.5

Line = Tuple[np.ndarray, np.ndarray]
"""Times [s] and values."""
# A plot over time: its label, and its lines with their colours.
_Row = Tuple[str, List[Tuple[Line, str]]]


def way_plot(selection: Selection, speeds: Dict[int, Line], colours: Dict[int, str]) -> str:
    """Return the SVG of the distances of people from the origin of their frame, and of their speeds.

    Args:
        speeds: [m/s], by person.
        colours: by person.
    """
    distances = []
    for person in selection.persons:
        rows = selection.table.of_person(person)
        places = np.linalg.norm(ground_places(rows)[0].astype(np.float64), axis=1)
        distances.append(((selection.seconds(rows.stamps), places), colours[person]))
    return _svg(selection, [('distance [m]', distances),
                            ('speed [m/s]', [(line, colours[person]) for person, line in speeds.items()])])


def angle_plot(selection: Selection, person: int) -> str:
    """Return the SVG of the joint angles of a person that are known."""
    rows = selection.table.of_person(person)
    seconds, angles = selection.seconds(rows.stamps), joint_angles(rows.joints, rows.positions)
    plots = [(name, {f'{side}_{name}': colour for side, colour in _SIDES.items()}) for name in SIDED_ANGLES]
    plots += [(name, {name: plotting.HELP_COLOUR}) for name in ANGLES if 'neck' in name]
    known = [(plotting.joint_title(label).replace(' ', '\n', 1),
              [((seconds, angles[name]), colour) for name, colour in lines.items()])
             for label, lines in plots if any(np.isfinite(angles[name]).any() for name in lines)]
    return _svg(selection, known) if known else ''


def _svg(selection: Selection, rows: Sequence[_Row]) -> str:
    height = _TOP + _ROW * len(rows) + _BOTTOM
    figure = Figure(figsize=(_WIDTH, height))
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False, gridspec_kw={
        'left': LEFT, 'right': RIGHT, 'bottom': _BOTTOM / height, 'top': 1 - _TOP / height, 'hspace': 0.25})[:, 0]
    for axes, (label, lines) in zip(panels, rows):
        for (seconds, values), colour in lines:
            # the line breaks where frames are missing
            breaks = np.flatnonzero(np.diff(seconds) > selection.gap) + 1
            axes.plot(np.insert(seconds, breaks, np.nan), np.insert(values.astype(float), breaks, np.nan),
                      color=colour, linewidth=0.9)
        plotting.tidy_axes(axes, ylabel=label)
        axes.yaxis.label.set_fontsize('small')
        axes.tick_params(labelsize='small')
    begin, end = selection.span
    panels[-1].set(xlim=(begin, max(end, begin + 1e-3)), xlabel='time since the first frame [s]')
    with matplotlib.rc_context({'path.simplify_threshold': _SIMPLIFIED, 'svg.fonttype': 'none'}):
        return plotting.figure_content(figure, 'svg').decode()
