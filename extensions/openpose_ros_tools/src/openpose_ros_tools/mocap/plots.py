"""Plots of a comparison with motion capture."""
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.alignment.alignment import Alignment
from openpose_ros_tools.mocap.evaluation import Comparison
from openpose_ros_tools.plots.plotting import (
    HELP_COLOUR,
    STATUS_COLOURS,
    STATUS_NAMES,
    joint_title,
    legend_above,
    new_figure,
    person_colours,
    tidy_axes,
    time_axis,
)
from skeleton_extract_3d.people import INFERRED, MEASURED

TRAJECTORIES = 'trajectories_'
"""What the names of plots of one person's joints begin with."""

REFERENCE_COLOUR, _FLOOR_COLOUR = '#000000', '#DDDDDD'
# Lines of stick figures: reference, estimate.
_THIN, _THICK = 1.3, 2.0
# Joints whose paths are drawn, as many of them as are compared: they move most.
TRAJECTORY_JOINTS = ('right_wrist', 'left_wrist', 'right_ankle')
# Moments of which stick figures are drawn, and times between which the clock's curve is drawn [s].
_MOMENTS, _CURVE_SPAN = 6, 5.0
# Direction from which stick figures are seen: angle to the side, angle above [degrees].
_VIEW = (20.0, 14.0)
# Lines break where a person was not found for more frames than this.
_BREAK_FRAMES = 2.5
# A world is upright by one of its axes if people stand within this of it [degrees].
_UPRIGHT = 30.0


def error_per_joint(comparison: Comparison) -> Figure:
    """Draw median (bar) and 90th percentile (line) of the errors of each joint, measured and inferred apart."""
    figure = new_figure(9, 0.34 * len(comparison.joints) + 1.6)
    axes = figure.add_subplot(1, 1, 1)
    table, places = comparison.table().dropna(subset=['error']), np.arange(len(comparison.joints))[::-1]
    handles, labels = [], []
    for status, shift in ((MEASURED, 0.19), (INFERRED, -0.19)):
        errors = 1e3 * table.error[table.status == status]
        if not len(errors):
            continue
        by_joint, at = errors.groupby(table.joint.astype(str)), places + shift
        # one by one, as versions of pandas differ in the order of several at a time
        median, high = (by_joint.quantile(share).reindex(list(comparison.joints)) for share in (0.5, 0.9))
        handles.append(axes.barh(at, median.fillna(0), 0.34, color=STATUS_COLOURS[status]))
        axes.hlines(at, median, high, color=STATUS_COLOURS[status], linewidth=1.6)
        axes.plot(high, at, '|', color=STATUS_COLOURS[status], markersize=7, markeredgewidth=1.6)
        labels.append(f'{STATUS_NAMES[status]}: median')
    handles.append(Line2D([], [], color=HELP_COLOUR, marker='|', markersize=7, linewidth=1.6))
    labels.append('up to the 90th percentile')
    axes.set_yticks(places)
    axes.set_yticklabels([joint_title(joint) for joint in comparison.joints])
    axes.set_ylim(-0.6, len(places) - 0.4)
    axes.set_xlim(left=0)
    tidy_axes(axes, 'distance from the reference [mm]', grid='x')
    legend_above(axes, handles, labels)
    return figure


def error_over_time(comparison: Comparison) -> Figure:
    """Draw the median error of each person's joints over time, with the span from the 10th to the 90th percentile."""
    people = _people(comparison)
    figure = new_figure(9, 3.6)
    axes, colours = figure.add_subplot(1, 1, 1), person_colours(people)
    table, handles = comparison.table().dropna(subset=['error']), []
    for person in people:
        of_person = table[table.subject == comparison.subjects[person]]
        by_time = 1e3 * of_person.set_index('time').error
        low, middle, high = (by_time.groupby(level=0).quantile(share) for share in (0.1, 0.5, 0.9))
        times, (low, middle, high) = _with_breaks(low.index.to_numpy(), np.stack([low, middle, high]))
        axes.fill_between(times, low, high, color=colours[person], alpha=0.15, linewidth=0)
        handles += axes.plot(times, middle, color=colours[person], linewidth=1.6)
    tidy_axes(axes, ylabel='error [mm]')
    axes.set_ylim(bottom=0)
    time_axis(axes, (float(table.time.min()), float(table.time.max())))
    axes.set_title('median of the joints; shaded: 10th to 90th percentile', loc='left', fontsize='small', pad=22)
    legend_above(axes, handles, [comparison.subjects[person] for person in people])
    return figure


def trajectories(comparison: Comparison, person: int) -> Figure:
    """Draw x, y and z of some joints of a subject over time, the estimate on top of the reference."""
    joints = [joint for joint in TRAJECTORY_JOINTS if joint in comparison.joints] or list(comparison.joints[:3])
    rows = np.flatnonzero(comparison.subject == person)
    times = comparison.times[rows]
    figure = new_figure(max(4.0 * len(joints) + 0.6, 7.0), 6.2)
    grid = np.array(figure.subplots(3, len(joints), sharex=True, squeeze=False))
    for column, joint in enumerate(joints):
        number = comparison.joints.index(joint)
        estimate, status = comparison.estimate[rows, number], comparison.status[rows, number]
        at, truth = _with_breaks(times, comparison.truth[rows, number].T)
        for axis, name in enumerate('xyz'):
            axes = grid[axis, column]
            axes.plot(at, truth[axis], color=REFERENCE_COLOUR, linewidth=1.2)
            for kind in (MEASURED, INFERRED):
                axes.plot(times[status == kind], estimate[status == kind, axis], '.', markersize=5,
                          color=STATUS_COLOURS[kind], alpha=0.8)
            tidy_axes(axes, ylabel=f'{name} [m]' if column == 0 else '')
            _at_least(axes, 0.1)
        grid[0, column].set_title(joint_title(joint), fontsize='medium')
        shown = times[comparison.found[rows]]
        time_axis(grid[2, column], (float(shown.min()), float(shown.max())), 'time [s]')
    handles = [Line2D([], [], color=REFERENCE_COLOUR), *(Line2D([], [], color=STATUS_COLOURS[kind], marker='.',
                                                                linestyle='') for kind in (MEASURED, INFERRED))]
    figure.suptitle(f'{comparison.subjects[person]}, in the frame of the reference', fontsize='medium', x=0.01,
                    ha='left')
    figure.legend(handles, ['reference', *(STATUS_NAMES[kind] for kind in (MEASURED, INFERRED))], loc='upper right',
                  ncol=3, frameon=False, fontsize='small')
    return figure


def stick_figures(comparison: Comparison) -> Figure:
    """Draw the people of some moments in space, estimate over reference, upright and all at the same scale."""
    moments = np.unique(comparison.times[comparison.found])
    moments = moments[np.unique(np.linspace(0, len(moments) - 1, _MOMENTS + 2).round().astype(int)[1:-1])]
    shown, upright = np.isin(comparison.times, moments), _upright(comparison)
    everything = comparison.truth[shown] @ upright.T
    view = _view(everything, comparison.joints)
    floor, square = _floor(everything.reshape(-1, 3))
    corners = np.concatenate([everything.reshape(-1, 3), floor.reshape(-1, 3)]) @ view.T
    low, high = np.nanmin(corners, axis=0) - 0.1, np.nanmax(corners, axis=0) + 0.1
    width, height = high - low
    columns = min(len(moments), 3 if width > 0.7 * height else _MOMENTS)
    lines = -(-len(moments) // columns)
    panel = 11.5 / columns
    figure = new_figure(11.5, min(lines * (panel * height / width + 0.3), 14.0) + 0.5)
    grid = np.array(figure.subplots(lines, columns, squeeze=False)).ravel()
    colours, project = person_colours(_people(comparison)), view @ upright
    for axes, moment in zip(grid, moments):
        for line in floor @ view.T:
            axes.plot(*line.T, color=_FLOOR_COLOUR, linewidth=0.7, zorder=0)
        rows = np.flatnonzero(comparison.times == moment)
        for row in rows:
            _stick_figure(axes, comparison.joints, comparison.truth[row] @ project.T, REFERENCE_COLOUR)
        for row in rows[comparison.found[rows]]:
            _stick_figure(axes, comparison.joints, comparison.estimate[row] @ project.T,
                          colours[comparison.subject[row]], comparison.status[row])
        axes.set_title(f'{moment:.2f} s', fontsize='small')
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect('equal')
    for axes in grid:
        axes.set_axis_off()
    _stick_legend(figure, comparison, f'floor, squares of {square:g} m', (comparison.status[shown] == INFERRED).any())
    return figure


def _stick_legend(figure: Figure, comparison: Comparison, floor: str, with_inferred: bool) -> None:
    people = _people(comparison)
    colours = person_colours(people)
    handles = {'reference': Line2D([], [], color=REFERENCE_COLOUR, linewidth=_THIN)}
    handles.update({comparison.subjects[person]: Line2D([], [], color=colours[person], linewidth=_THICK)
                    for person in people})
    if with_inferred:
        handles['inferred joint'] = Line2D([], [], color=HELP_COLOUR, marker='o', markerfacecolor='white', linestyle='')
    handles[floor] = Line2D([], [], color=_FLOOR_COLOUR, marker='s', markerfacecolor='white', linestyle='',
                            markersize=9)
    # a row of its own, which the arrangement of the plots leaves free
    figure.suptitle(' ', fontsize='medium')
    figure.legend(list(handles.values()), list(handles), loc='upper center', ncol=min(len(handles), 8), frameon=False,
                  fontsize='small')


def clock_curve(alignment: Alignment) -> Optional[Figure]:
    """Draw the correlation of the joints' speeds around the clock offset and at large; None if it was given."""
    curve = alignment.curve
    if curve is None:
        return None
    # from the offset that was found: clocks may differ by years
    shift = curve.offsets - alignment.clock_offset
    wide = np.abs(shift).max() > 2 * _CURVE_SPAN
    figure = new_figure(9, 3.4)
    grid = np.array(figure.subplots(1, 2 if wide else 1, squeeze=False))[0]
    for axes, span in zip(grid, (None, _CURVE_SPAN) if wide else (None,)):
        shown = np.full(len(shift), True) if span is None else np.abs(shift) <= span
        axes.axvline(0, color='#D55E00', linewidth=1.2)
        axes.plot(shift[shown], curve.correlation[shown], color='#0072B2', linewidth=1.0)
        tidy_axes(axes, 'offset, from the one that was found [s]')
        axes.set_ylim(min(-0.25, np.nanmin(np.append(curve.correlation[shown], 0)) - 0.05), 1.02)
    grid[0].set_ylabel('correlation of joint speeds')
    if wide:
        grid[0].set_title('all that was searched', fontsize='small', loc='left')
        grid[1].set_title('near the result', fontsize='small', loc='left')
    figure.suptitle(f'clock offset {alignment.clock_offset:.4f} s', fontsize='small', x=0.99, ha='right')
    return figure


def all_figures(comparison: Comparison, alignment: Alignment) -> Dict[str, Tuple[str, Figure]]:
    """Return caption and plot by file name, in the order of the report."""
    figures = {
        'error_per_joint': ('Error per joint', error_per_joint(comparison)),
        'error_over_time': ('Error over time', error_over_time(comparison))}
    if any({start, end} <= set(comparison.joints) for start, end in COCO_18.drawn_limbs):
        figures['stick_figures'] = ('Stick figures: estimate over reference', stick_figures(comparison))
    for person in _people(comparison):
        name = ''.join(sign if sign.isalnum() else '_' for sign in comparison.subjects[person])
        figures[f'{TRAJECTORIES}{person + 1}_{name}'] = (f'Trajectories of {comparison.subjects[person]}',
                                                        trajectories(comparison, person))
    curve = clock_curve(alignment)
    if curve is not None:
        figures['clock_correlation'] = ('Correlation of joint speeds over the clock offset', curve)
    return figures


def _people(comparison: Comparison) -> List[int]:
    """Return the subjects that the estimate has."""
    return np.unique(comparison.subject[comparison.found]).tolist()


def _with_breaks(times: np.ndarray, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return times (N',) and values (V, N') with NaN in between where rows are far apart, so that lines break."""
    steps = np.diff(times)
    if not len(steps):
        return times, values
    gaps = np.flatnonzero(steps > _BREAK_FRAMES * np.median(steps)) + 1
    return np.insert(times, gaps, times[gaps - 1]), np.insert(values, gaps, np.nan, axis=1)


def _at_least(axes: Any, span: float) -> None:
    """Let the y axis span at least `span` [m]: noise of a resting joint is not to look like a movement."""
    low, high = axes.get_ylim()
    if high - low < span:
        middle = (low + high) / 2
        axes.set_ylim(middle - span / 2, middle + span / 2)


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


def _view(people: np.ndarray, joints: Sequence[str]) -> np.ndarray:
    """Return the parallel projection (2, 3) of a world with z up: from above, a little to the side, people abreast.

    Args:
        people: (P, K, 3) [m].
    """
    ground = people[..., :2].reshape(-1, 2)
    ground = ground[np.isfinite(ground).all(axis=1)]
    across = np.linalg.svd(ground - ground.mean(axis=0), full_matrices=False)[2][0]
    away = np.array([-across[1], across[0]])
    if 'nose' in joints and 'neck' in joints:
        faces = (people[:, joints.index('nose')] - people[:, joints.index('neck')])[:, :2] @ away
        if np.nansum(faces) > 0:  # seen from the front
            across, away = -across, -away
    turn, above = np.radians(_VIEW)
    right = np.append(np.cos(turn) * across + np.sin(turn) * away, 0)
    back = np.append(np.cos(turn) * away - np.sin(turn) * across, 0)
    return np.stack([right, np.sin(above) * back + np.cos(above) * np.array([0, 0, 1])])


def _floor(points: np.ndarray) -> Tuple[np.ndarray, float]:
    """Return the lines (L, 2, 3) of squares on the floor under points (N, 3), z up, and the size of a square [m]."""
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    square = 0.5 if (high - low)[:2].max() < 3 else 1.0
    first, last = np.floor(low[:2] / square), np.ceil(high[:2] / square)
    lines = []
    for axis in (0, 1):
        for number in np.arange(first[axis], last[axis] + 1):
            line = np.full((2, 3), low[2])
            line[:, axis] = number * square
            line[:, 1 - axis] = first[1 - axis] * square, last[1 - axis] * square
            lines.append(line)
    return np.array(lines), square


def _upright(comparison: Comparison) -> np.ndarray:
    """Return the rotation (3, 3) from the reference's frame to one with z up, by how people stand in it.

    Laboratories have y or z up; if people stand along none of the axes, up is where their necks are.
    """
    up = np.zeros(3)
    joints, truth = comparison.joints, comparison.truth[comparison.found]
    for high, low in (('neck', 'right_hip'), ('neck', 'left_hip'), ('right_shoulder', 'right_ankle'),
                      ('left_shoulder', 'left_ankle'), ('nose', 'neck')):
        if high in joints and low in joints:
            bodies = truth[:, joints.index(high)] - truth[:, joints.index(low)]
            bodies = bodies[np.isfinite(bodies).all(axis=1)]
            if len(bodies):
                up += np.median(bodies, axis=0)
    if not np.linalg.norm(up):
        return np.eye(3)
    up /= np.linalg.norm(up)
    nearest = np.zeros(3)
    nearest[np.abs(up).argmax()] = np.sign(up[np.abs(up).argmax()])
    if up @ nearest > np.cos(np.radians(_UPRIGHT)):
        up = nearest
    # the horizontal axes: the frame's own, as far as they go
    other = np.eye(3)[np.abs(up).argmin()] if np.abs(up[0]) > 0.9 else np.eye(3)[0]
    right = other - (other @ up) * up
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(up, right), up])
