"""Keypoints of a recording as pictures for everybody: where people went, what was seen of them, and when."""
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from openpose_ros_tools.plots.plotting import (
    GAP_COLOUR,
    HELP_COLOUR,
    STATUS_COLOURS,
    STATUS_NAMES,
    integer_ticks,
    joint_title,
    legend_above,
    new_figure,
    person_colours,
    rates_over_time,
    set_title,
    tidy_axes,
    time_axis,
)
from openpose_ros_tools.tables.keypoint_selection import Selection, ground_places, vertical_axis
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING

# Joints as a person has them, from the head to the feet: the rows of a timeline.
BODY_ORDER = (
    'head_top', 'nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear', 'neck', 'chest', 'right_shoulder',
    'right_elbow', 'right_wrist', 'left_shoulder', 'left_elbow', 'left_wrist', 'mid_hip', 'right_hip', 'right_knee',
    'right_ankle', 'right_heel', 'right_big_toe', 'right_small_toe', 'left_hip', 'left_knee', 'left_ankle', 'left_heel',
    'left_big_toe', 'left_small_toe')
# Columns of the pictures over time; where there are more frames, each column is their mean.
_COLUMNS = 1200
# More frames than this are drawn with small points, and as pixels also in PDF and SVG.
_MANY_FRAMES = 600
# Marks of people and camera in the view from above [m].
_CAMERA_SIZE = 0.25
_AXES = 'xyz'


def top_view(selection: Selection) -> Figure:
    """Draw the ways of the people as seen from above, with the camera where the coordinates are the camera's.

    Raises:
        ValueError: the keypoints are in the image.
    """
    if selection.table.dimensions != 3:
        raise ValueError('a view from above needs keypoints in space')
    axis, sign = vertical_axis(selection.table)
    after, before = (axis + 1) % 3, (axis + 2) % 3
    # right-handed, seen against "up": across x along = up
    across, along = (after, before) if sign > 0 else (before, after)
    figure = new_figure(9.5, 7.0)
    axes = figure.subplots()
    _draw_ways(axes, selection, [across, along])
    is_camera = (axis, sign) == (1, -1)
    if is_camera:
        axes.add_patch(Polygon([(0, 0), (-_CAMERA_SIZE / 2, _CAMERA_SIZE), (_CAMERA_SIZE / 2, _CAMERA_SIZE)],
                               color='#000000', zorder=3))
        axes.annotate('camera', (0, 0), (0, -4), textcoords='offset points', ha='center', va='top')
        labels = ('x: to the right of the camera [m]', 'z: away from the camera [m]')
    else:
        axes.plot(0, 0, '+', color='#000000', markersize=12)
        axes.annotate(f'origin of {selection.frame_id}' if selection.frame_id else 'origin', (0, 0), (6, -4),
                      textcoords='offset points', va='top')
        labels = (f'{_AXES[across]} [m]', f'{_AXES[along]} [m]')
    tidy_axes(axes, *labels)
    axes.set_aspect('equal', adjustable='datalim')
    axes.margins(0.08)
    set_title(figure, 'Ways of the people, seen from above')
    _legend_of_ways(axes)
    return figure


def image_paths(selection: Selection) -> Figure:
    """Draw the ways of the people in the image, pixels to the right and down."""
    figure = new_figure(10.0, 6.0)
    axes = figure.subplots()
    _draw_ways(axes, selection, [0, 1])
    tidy_axes(axes, 'x: to the right [px]', 'y: down [px]')
    axes.set_aspect('equal', adjustable='datalim')
    axes.margins(0.08)
    axes.invert_yaxis()
    set_title(figure, 'Ways of the people in the image')
    _legend_of_ways(axes)
    return figure


def trajectory(selection: Selection, joint: str) -> Figure:
    """Draw the coordinates of a joint over time, a colour for each person."""
    table, dimensions = selection.table, selection.table.dimensions
    number = table.joints.index(joint)
    figure = new_figure(11.0, 1.4 + 2.2 * dimensions)
    panels = figure.subplots(dimensions, 1, sharex=True)
    labels, inverted = _coordinate_labels(selection)
    colours, small = person_colours(selection.persons), len(selection.frames) > _MANY_FRAMES
    for person in selection.persons:
        rows = selection.rows_of(person)
        seconds = selection.seconds(rows.stamps)
        status = rows.status[:, number]
        for axis, axes in enumerate(panels):
            values = rows.positions[:, number, axis]
            style = {'color': colours[person], 'rasterized': small}
            axes.plot(*_broken(seconds, values, selection.gap), '-', linewidth=0.9, **style)
            axes.plot(seconds[status == MEASURED], values[status == MEASURED], '.', markersize=2 if small else 4.5,
                      **style)
            axes.plot(seconds[status == INFERRED], values[status == INFERRED], 'o', markersize=2 if small else 3.5,
                      markerfacecolor='white', markeredgewidth=0.8, **style)
            spread = rows.sigma[:, number]
            if np.isfinite(spread).any():
                axes.fill_between(*_broken(seconds, values - spread, selection.gap),
                                  _broken(seconds, values + spread, selection.gap)[1], color=colours[person],
                                  alpha=0.15, linewidth=0)
    for axis, axes in enumerate(panels):
        _shade_gaps(axes, selection)
        tidy_axes(axes, ylabel=labels[axis])
        if axis in inverted:
            axes.invert_yaxis()
    time_axis(panels[-1], selection.span)
    set_title(figure, joint_title(joint).capitalize())
    legend_above(panels[0], _legend_of_people(selection, colours))
    return figure


def visibility(selection: Selection, person: int) -> Figure:
    """Draw for each joint of a person when it was measured, inferred or missing."""
    rows, joints = selection.rows_of(person), _in_body_order(selection)
    numbers = [selection.table.joints.index(joint) for joint in joints]
    status = rows.status[:, numbers]
    colours = np.ones((len(selection.frames), len(numbers), 3))
    table = np.array([to_rgb(STATUS_COLOURS[value]) for value in sorted(STATUS_COLOURS)])
    colours[np.searchsorted(selection.frames, rows.stamps)] = table[status]
    figure = new_figure(11.5, 1.5 + 0.25 * len(joints))
    axes = figure.subplots()
    _draw_columns(axes, selection, colours)
    _label_rows(axes, joints)
    shown = (MEASURED, MISSING) if selection.table.dimensions == 2 else (MEASURED, INFERRED, MISSING)
    names = {**STATUS_NAMES, MEASURED: 'detected'} if selection.table.dimensions == 2 else STATUS_NAMES
    shares = 100 * np.array([(status == value).mean(axis=0) for value in shown]) if len(rows) else np.zeros((3, 0))
    axes.text(1.01, -1, 'of the rows', va='center', fontsize='small', transform=axes.get_yaxis_transform())
    for row, values in enumerate(shares.T):
        axes.text(1.01, row, ' / '.join(f'{value:.0f}' for value in values) + ' %', va='center', fontsize='small',
                  transform=axes.get_yaxis_transform())
    handles = [Patch(facecolor=STATUS_COLOURS[value], label=names[value]) for value in shown]
    handles.append(Patch(facecolor='white', edgecolor=HELP_COLOUR, label='person not found'))
    set_title(figure, f'Person {person}: what was seen of each joint')
    _legend_with_gaps(axes, selection, handles)
    return figure


def confidence(selection: Selection, person: int) -> Figure:
    """Draw the confidence of each joint of a person over time, as a heat map."""
    rows, joints = selection.rows_of(person), _in_body_order(selection)
    numbers = [selection.table.joints.index(joint) for joint in joints]
    values = np.full((len(selection.frames), len(numbers)), np.nan)
    values[np.searchsorted(selection.frames, rows.stamps)] = rows.confidence[:, numbers]
    figure = new_figure(11.5, 1.5 + 0.25 * len(joints))
    axes = figure.subplots()
    picture = _draw_columns(axes, selection, values[..., None])
    _label_rows(axes, joints)
    figure.colorbar(picture, ax=axes, label='confidence', pad=0.01)
    set_title(figure, f'Person {person}: confidence of the detection of each joint')
    _legend_with_gaps(axes, selection, [])
    return figure


def detections(selection: Selection) -> Figure:
    """Draw when frames and people were there, how many per second, and how many people were in view."""
    table, persons = selection.all_people, selection.persons
    figure = new_figure(11.0, 5.6 + 0.24 * len(persons))
    marks, rates, counts = figure.subplots(3, 1, sharex=True, gridspec_kw={
        'height_ratios': (0.6 + 0.24 * len(persons), 1.6, 1.3)})
    colours, frames = person_colours(persons), selection.seconds(selection.frames)
    times = [frames, *[selection.seconds(selection.rows_of(person).stamps) for person in persons]]
    for row, (moments, colour) in enumerate(zip(times, ['#000000', *colours.values()])):
        marks.vlines(moments, row - 0.38, row + 0.38, color=colour, linewidth=0.8 if len(frames) < 1000 else 0.3,
                     rasterized=len(frames) > _MANY_FRAMES)
    _label_rows(marks, ['frames', *[f'person {person}' for person in persons]])
    marks.set_ylim(len(times) - 0.5, -0.5)
    span = selection.span
    rates.plot(*rates_over_time(frames, span), color='#000000', label='frames')
    rates.plot(*rates_over_time(selection.seconds(table.stamps), span), color=STATUS_COLOURS[MEASURED],
               label='people found in them')
    rates.set_ylim(bottom=0.0)
    in_view = np.bincount(np.searchsorted(selection.frames, table.stamps), minlength=len(frames)).astype(float)
    # of all rows: also of people who were not chosen
    counts.step(*_broken(frames, in_view, selection.gap, selection.period), where='post',
                color=STATUS_COLOURS[MEASURED])
    counts.set_ylim(0, max(in_view.max(initial=0.0), 1.0) + 0.5)
    integer_ticks(counts.yaxis)
    for axes, label in ((rates, 'per second'), (counts, 'people in view')):
        tidy_axes(axes, ylabel=label)
    for axes in (marks, rates, counts):
        _shade_gaps(axes, selection)
    time_axis(counts, span)
    set_title(figure, f'Detections over time; first frame: {selection.first_moment}')
    _legend_with_gaps(rates, selection, list(rates.get_lines()))
    return figure


def _draw_ways(axes: Any, selection: Selection, columns: List[int]) -> None:
    """Draw the ways of all people; `columns`: coordinates to the right and upwards."""
    colours = person_colours(selection.persons)
    for person in selection.persons:
        rows = selection.rows_of(person)
        places, joint = ground_places(rows)
        _draw_way(axes, selection, rows.stamps, places[:, columns], colours[person],
                  f'person {person} ({joint_title(joint)})')


def _draw_way(axes: Any, selection: Selection, stamps: np.ndarray, places: np.ndarray, colour: str, label: str) -> None:
    """Draw the way of a person, (R, 2), from a ring at its begin to a dot at its end."""
    known = np.isfinite(places).all(axis=1)
    if not known.any():
        return
    seconds = selection.seconds(stamps)
    _, first = _broken(seconds, places[:, 0], selection.gap)
    _, second = _broken(seconds, places[:, 1], selection.gap)
    axes.plot(first, second, '.-', color=colour, linewidth=1.2, markersize=3, label=label,
              rasterized=len(stamps) > _MANY_FRAMES)
    for row, fill in ((0, 'white'), (-1, colour)):
        axes.plot(*places[known][row], 'o', color=colour, markerfacecolor=fill, markersize=9, zorder=4)


def _legend_of_ways(axes: Any) -> None:
    handles, labels = axes.get_legend_handles_labels()
    ends = [Line2D([], [], marker='o', color=HELP_COLOUR, linestyle='', markerfacecolor=fill, label=label)
            for fill, label in (('white', 'begin'), (HELP_COLOUR, 'end'))]
    axes.legend([*handles, *ends], [*labels, 'begin', 'end'], loc='upper left', bbox_to_anchor=(1.0, 1.0),
                frameon=False, fontsize='small', handlelength=1.4)


def _legend_of_people(selection: Selection, colours: Dict[int, str]) -> List[Any]:
    handles = [Line2D([], [], color=colour, label=f'person {person}') for person, colour in colours.items()]
    if selection.table.dimensions == 3:
        handles += [Line2D([], [], color=HELP_COLOUR, marker=marker, linestyle='', markerfacecolor=fill, label=label)
                    for marker, fill, label in (('.', HELP_COLOUR, 'measured'), ('o', 'white', 'inferred'))]
        if np.isfinite(selection.table.sigma).any():
            handles.append(Patch(color=HELP_COLOUR, alpha=0.3, label='1 sigma'))
    if selection.gaps:
        handles.append(_gap_patch(selection))
    return handles


def _legend_with_gaps(axes: Any, selection: Selection, handles: List[Any]) -> None:
    if selection.gaps:
        handles.append(_gap_patch(selection))
    if handles:
        legend_above(axes, handles)


def _gap_patch(selection: Selection) -> Patch:
    return Patch(facecolor=GAP_COLOUR, edgecolor=HELP_COLOUR, hatch='////', linewidth=0, label=(
        'no frames' if selection.knows_empty_frames else 'nobody found, or no frames'))


def _shade_gaps(axes: Any, selection: Selection) -> None:
    for begin, end in selection.gaps:
        axes.axvspan(begin, end, facecolor=GAP_COLOUR, edgecolor=HELP_COLOUR, hatch='////', linewidth=0, zorder=0)


def _coordinate_labels(selection: Selection) -> Tuple[List[str], Sequence[int]]:
    """Return the labels of the axes of coordinates, and which of them point down."""
    if selection.table.dimensions == 2:
        return ['x: to the right [px]', 'y: down [px]'], [1]
    axis, sign = vertical_axis(selection.table)
    if (axis, sign) == (1, -1):
        return ['x: to the right [m]', 'y: down [m]', 'z: away from\nthe camera [m]'], [1]
    labels = [f'{name} [m]' for name in _AXES]
    labels[axis] = f'{_AXES[axis]}: {"up" if sign > 0 else "down"} [m]'
    return labels, [axis] if sign < 0 else []


def _in_body_order(selection: Selection) -> List[str]:
    return [joint for joint in BODY_ORDER if joint in selection.joints]


def _label_rows(axes: Any, names: Sequence[str]) -> None:
    axes.set_yticks(range(len(names)))
    axes.set_yticklabels([joint_title(name) for name in names], fontsize='small')
    for side in ('top', 'right', 'left'):
        axes.spines[side].set_visible(False)
    axes.tick_params(axis='y', length=0)


def _draw_columns(axes: Any, selection: Selection, values: np.ndarray) -> Any:
    """Draw (N, K, C) values of the frames, colours or one number, as a picture of rows over time; gaps are shaded.

    A frame reaches to the next one. A column of the picture is the mean of the frames in it, so that none is lost.
    """
    begin, end = selection.span
    edges = np.linspace(begin, end + selection.period, _COLUMNS + 1)
    frames = selection.seconds(selection.frames)
    first, last = np.searchsorted(frames, edges[:-1]), np.searchsorted(frames, edges[1:])
    # a column without a frame of its own belongs to the frame before it
    first = np.where(last > first, first, np.maximum(first - 1, 0))
    last = np.maximum(last, first + 1)
    known = np.isfinite(values)
    sums, counts = (np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(part, axis=0)])
                    for part in (np.where(known, values, 0.0), known))
    with np.errstate(invalid='ignore'):
        # sums of many numbers are a little off
        picture = np.clip((sums[last] - sums[first]) / (counts[last] - counts[first]), 0.0, 1.0)
    rows = values.shape[1]
    shown = axes.imshow(np.swapaxes(picture, 0, 1).squeeze(axis=2) if values.shape[2] == 1 else
                        np.swapaxes(picture, 0, 1), extent=(edges[0], edges[-1], rows - 0.5, -0.5), aspect='auto',
                        interpolation='nearest', cmap='viridis', vmin=0.0, vmax=1.0)
    for row in range(1, rows):
        axes.axhline(row - 0.5, color='white', linewidth=1.0)
    for gap in selection.gaps:
        axes.axvspan(*gap, facecolor=GAP_COLOUR, edgecolor=HELP_COLOUR, hatch='////', linewidth=0, zorder=2)
    time_axis(axes, (begin, end + selection.period))
    return shown


def _broken(seconds: np.ndarray, values: np.ndarray, gap: float, hold: float = 0.0) -> Tuple[np.ndarray, np.ndarray]:
    """Return times and values (R,) with NaN put in where times are further apart than `gap` [s], so that a line breaks.

    Args:
        hold: that much [s] after the last value before the gap, the value still holds.
    """
    breaks = np.flatnonzero(np.diff(seconds) > gap) + 1
    moments, held = seconds[breaks - 1] + hold, np.asarray(values, float)[breaks - 1]
    places = np.repeat(breaks, 2)
    return (np.insert(seconds, places, np.repeat(moments, 2)),
            np.insert(np.asarray(values, float), places, np.stack([held, np.full(len(held), np.nan)], 1).ravel()))
