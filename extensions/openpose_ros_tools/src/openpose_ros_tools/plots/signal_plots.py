"""Signals of a recording as a plot over time."""
from typing import Any, Dict, List, Sequence

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from openpose_ros_signals.records import BOTH, GESTURES, LEFT, POSTURES, RIGHT, UNKNOWN
from openpose_ros_tools.plots import plotting
from openpose_ros_tools.tables.keypoint_selection import Selection
from openpose_ros_tools.tables.signal_timeline import GESTURE, POSTURE, WALKING, SignalTimeline, Span

# Light colours for postures, strong ones for gestures, which are drawn above them.
_POSTURES: Dict[str, Dict[str, Any]] = {
    name: {'facecolor': colour, 'linewidth': 0} for name, colour in zip(
        POSTURES, ('#A6CEE3', '#B2DF8A', '#FDBF6F', '#CAB2D6', '#FB9A99'))}
_POSTURES[UNKNOWN] = {'facecolor': 'white', 'edgecolor': '#BFBFBF', 'hatch': '////', 'linewidth': 0}
_GESTURES = dict(zip(GESTURES, plotting.PALETTE))
# Top and height of bars of a person's row, from -0.5 to 0.5: gestures of the left arm, of the right one, of both.
_ARMS = {LEFT: (-0.46, 0.19), RIGHT: (-0.25, 0.19), BOTH: (-0.46, 0.40)}
_POSTURE, _WALKING = (-0.03, 0.30), (0.30, 0.08)
_FALL = '#B2182B'


def signals(selection: Selection, timeline: SignalTimeline) -> Figure:
    """Draw a row for each person: posture, above it gestures by arm, below it walking; and falls.

    A frame lasts until the next one of the person.
    """
    rows = {person: row for row, person in enumerate(selection.persons)}
    figure = plotting.new_figure(11.0, 1.7 + 0.62 * len(rows), 'Postures and gestures')
    axes = figure.subplots()
    spans = [span for span in timeline.spans if span.person in rows]
    for span in spans:
        _draw(axes, span, rows[span.person], selection)
    fallen = [(fall.stamp - selection.begin * 1e-9, rows[person]) for person, fall in timeline.falls if person in rows]
    for moment, row in fallen:
        axes.plot(moment, row - 0.03, marker='v', color=_FALL, markersize=10, markeredgecolor='white', zorder=5)
    begin, end = selection.span
    plotting.tidy_axes(axes, grid='x')
    plotting.label_rows(axes, [f'person {person}' for person in rows])
    plotting.time_axis(axes, (begin, end + selection.period))
    plotting.legend_beside(axes, _legend(spans, bool(fallen)))
    return figure


def _draw(axes: Any, span: Span, row: int, selection: Selection) -> None:
    begin, end = (moment - selection.begin * 1e-9 for moment in (span.begin, span.end))
    low, high = selection.span
    begin, end = max(begin, low), min(max(end, begin + selection.period), high + selection.period)
    if begin >= end:
        return
    styles: Dict[str, Any] = {'facecolor': plotting.HELP_COLOUR}
    top, height = _WALKING
    if span.kind == POSTURE:
        (top, height), styles = _POSTURE, _POSTURES.get(span.name, _POSTURES[UNKNOWN])
    elif span.kind == GESTURE:
        top, height = _ARMS.get(span.arm, _ARMS[BOTH])
        styles = {'facecolor': _GESTURES.get(span.name, plotting.HELP_COLOUR)}
        axes.text(begin, row + top + height / 2, {LEFT: 'L ', RIGHT: 'R '}.get(span.arm, 'LR '), ha='right',
                  va='center', fontsize='x-small', color=plotting.HELP_COLOUR)
    axes.broken_barh([(begin, end - begin)], (row + top, height), **styles)


def _legend(spans: Sequence[Span], has_falls: bool) -> List[Any]:
    shown = {(span.kind, span.name) for span in spans}
    postures = [Patch(label=plotting.joint_title(name), **style) for name, style in _POSTURES.items()
                if (POSTURE, name) in shown]
    gestures = [Patch(label=plotting.joint_title(name), facecolor=colour) for name, colour in _GESTURES.items()
                if (GESTURE, name) in shown]
    lines = [Line2D([], [], color=plotting.HELP_COLOUR, linewidth=3, label='walking')] * ((WALKING, '') in shown)
    lines += [Line2D([], [], color=_FALL, marker='v', linestyle='', label='fall')] * has_falls
    arms = [Line2D([], [], linestyle='', label='L, R: left, right arm')] * bool(gestures)
    return [*postures, *gestures, *lines, *arms]
