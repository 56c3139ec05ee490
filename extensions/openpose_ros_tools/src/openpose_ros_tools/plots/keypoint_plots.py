"""Keypoints of a recording as plots: paths of people, joints over time, and when people were in view."""
from typing import Any, List, Tuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.ticker import MaxNLocator

from openpose_ros_tools.plots import plotting
from openpose_ros_tools.tables.keypoint_selection import Selection, ground_places, vertical_axis
from skeleton_extract_3d.people import INFERRED, MEASURED

# With more frames than this, points are small.
_MANY_FRAMES = 600
# Size of the camera in the view from above [m].
_CAMERA_SIZE = 0.25
_GREY = plotting.HELP_COLOUR


def paths_of_people(selection: Selection) -> Figure:
    """Draw the paths of the people, each from a ring at its begin to a dot at its end.

    They are seen from above, with the camera where the coordinates are the camera's; in the image, right and down.
    """
    in_space, (axis, sign) = selection.table.dimensions == 3, (1, -1)
    if in_space:
        axis, sign = vertical_axis(selection.table)
        # right-handed, seen against "up": across x along = up
        columns = [(axis + 1) % 3, (axis + 2) % 3][::sign]
    else:
        columns = [0, 1]
    figure = plotting.new_figure(
        9.5, 7.0, 'Paths of the people' + (', seen from above' if in_space else ' in the image'))
    axes = figure.subplots()
    axes.set_aspect('equal', adjustable='datalim')
    axes.margins(0.08)
    for person, colour in plotting.person_colours(selection.persons).items():
        rows = selection.table.of_person(person)
        places, joint = ground_places(rows)
        known = np.isfinite(places[:, columns]).all(axis=1)
        if known.any():
            right, up = (_broken(selection.seconds(rows.stamps), places[:, column], selection.gap)[1]
                         for column in columns)
            axes.plot(right, up, '.-', color=colour, linewidth=1.2, markersize=3,
                      label=f'person {person} ({plotting.joint_title(joint)})')
            for row, fill in ((0, 'white'), (-1, colour)):
                axes.plot(*places[known][row][columns], 'o', color=colour, markerfacecolor=fill, markersize=9, zorder=4)
    ends = [Line2D([], [], marker='o', color=_GREY, linestyle='', markerfacecolor=fill, label=label)
            for fill, label in (('white', 'begin'), (_GREY, 'end'))]
    axes.legend(handles=[*axes.get_legend_handles_labels()[0], *ends], loc='upper left', bbox_to_anchor=(1.0, 1.0),
                frameon=False, fontsize='small', handlelength=1.4)
    labels, _ = _coordinate_labels(selection)
    if not in_space:
        axes.invert_yaxis()
    elif (axis, sign) == (1, -1):
        axes.add_patch(Polygon([(0, 0), (-_CAMERA_SIZE / 2, _CAMERA_SIZE), (_CAMERA_SIZE / 2, _CAMERA_SIZE)],
                               color='#000000', zorder=3))
        axes.annotate('camera', (0, 0), (0, -4), textcoords='offset points', ha='center', va='top')
    else:
        axes.plot(0, 0, '+', color='#000000', markersize=12)
        axes.annotate(f'origin of {selection.frame_id}' if selection.frame_id else 'origin', (0, 0), (6, -4),
                      textcoords='offset points', va='top')
    plotting.tidy_axes(axes, *(labels[column] for column in columns))
    return figure


def trajectory(selection: Selection, joint: str) -> Figure:
    """Draw the coordinates of a joint over time, a colour for each person."""
    dimensions, number = selection.table.dimensions, selection.table.joints.index(joint)
    figure = plotting.new_figure(11.0, 1.4 + 2.2 * dimensions, plotting.joint_title(joint).capitalize())
    panels = figure.subplots(dimensions, 1, sharex=True)
    colours, small = plotting.person_colours(selection.persons), len(selection.frames) > _MANY_FRAMES
    for person, colour in colours.items():
        rows = selection.table.of_person(person)
        seconds, status, spread = selection.seconds(rows.stamps), rows.status[:, number], rows.sigma[:, number]
        for axes, values in zip(panels, rows.positions[:, number].T):
            axes.plot(*_broken(seconds, values, selection.gap), '-', linewidth=0.9, color=colour)
            axes.plot(seconds[status == MEASURED], values[status == MEASURED], '.', markersize=2 if small else 4.5,
                      color=colour)
            axes.plot(seconds[status == INFERRED], values[status == INFERRED], 'o', markersize=2 if small else 3.5,
                      markerfacecolor='white', markeredgewidth=0.8, color=colour)
            if np.isfinite(spread).any():
                axes.fill_between(*_broken(seconds, values - spread, selection.gap),
                                  _broken(seconds, values + spread, selection.gap)[1], color=colour, alpha=0.15,
                                  linewidth=0)
    labels, inverted = _coordinate_labels(selection)
    for axis, axes in enumerate(panels):
        plotting.tidy_axes(axes, ylabel=labels[axis])
        if axis == inverted:
            axes.invert_yaxis()
    plotting.time_axis(panels[-1], selection.span)
    handles: List[Any] = [Line2D([], [], color=colour, label=f'person {person}') for person, colour in colours.items()]
    if dimensions == 3:
        handles += [Line2D([], [], color=_GREY, marker=marker, linestyle='', markerfacecolor=fill, label=label)
                    for marker, fill, label in (('.', _GREY, 'measured'), ('o', 'white', 'inferred'))]
        if np.isfinite(selection.table.sigma).any():
            handles.append(Patch(color=_GREY, alpha=0.3, label='1 sigma'))
    panels[0].legend(handles=handles, loc='lower right', bbox_to_anchor=(1.0, 1.0), ncol=min(len(handles), 8),
                     frameon=False, fontsize='small', borderaxespad=0.2, handlelength=1.4, columnspacing=1.2)
    return figure


def detections(selection: Selection) -> Figure:
    """Draw when there were frames and people, and the number of people in view."""
    persons, frames = selection.persons, selection.seconds(selection.frames)
    figure = plotting.new_figure(11.0, 4.0 + 0.24 * len(persons),
                                 f'Detections over time; first frame: {selection.first_moment}')
    marks, counts = figure.subplots(2, 1, sharex=True, gridspec_kw={'height_ratios': (0.6 + 0.24 * len(persons), 1.3)})
    times = [frames, *(selection.seconds(selection.table.of_person(person).stamps) for person in persons)]
    for row, (moments, colour) in enumerate(zip(times, ['#000000', *plotting.person_colours(persons).values()])):
        marks.vlines(moments, row - 0.38, row + 0.38, color=colour, linewidth=0.8 if len(frames) < 1000 else 0.3)
    marks.set_yticks(range(len(times)))
    marks.set_yticklabels(['frames', *(f'person {person}' for person in persons)], fontsize='small')
    marks.set_ylim(len(times) - 0.5, -0.5)
    for side in ('top', 'right', 'left'):
        marks.spines[side].set_visible(False)
    marks.tick_params(axis='y', length=0)
    # of all rows: also of people that were not chosen
    in_view = np.bincount(np.searchsorted(selection.frames, selection.all_people.stamps), minlength=len(frames))
    counts.step(*_broken(frames, in_view, selection.gap, selection.period), where='post', color=plotting.PALETTE[0])
    counts.set_ylim(0, max(in_view.max(initial=0), 1) + 0.5)
    counts.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    plotting.tidy_axes(counts, ylabel='people in view')
    plotting.time_axis(counts, selection.span)
    return figure


def _coordinate_labels(selection: Selection) -> Tuple[List[str], int]:
    """Return the labels of the axes of coordinates, and which of them points down; -1: none."""
    if selection.table.dimensions == 2:
        return ['x: to the right [px]', 'y: down [px]'], 1
    axis, sign = vertical_axis(selection.table)
    if (axis, sign) == (1, -1):
        return ['x: to the right [m]', 'y: down [m]', 'z: away from\nthe camera [m]'], 1
    labels = ['x [m]', 'y [m]', 'z [m]']
    labels[axis] = f'{"xyz"[axis]}: {"up" if sign > 0 else "down"} [m]'
    return labels, axis if sign < 0 else -1


def _broken(seconds: np.ndarray, values: np.ndarray, gap: float, hold: float = 0.0) -> Tuple[np.ndarray, np.ndarray]:
    """Return times and values (R,) with NaN where times are further apart than `gap`, `hold` after the last [s]."""
    values = np.asarray(values, float)
    breaks = np.flatnonzero(np.diff(seconds) > gap) + 1
    moments, held = seconds[breaks - 1] + hold, values[breaks - 1]
    places = np.repeat(breaks, 2)
    return (np.insert(seconds, places, np.repeat(moments, 2)),
            np.insert(values, places, np.stack([held, np.full(len(held), np.nan)], 1).ravel()))
