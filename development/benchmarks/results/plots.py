"""Plots of figures with their intervals."""
from typing import Any, Dict, Mapping, Sequence

import numpy as np
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

import results
from openpose_ros_tools.plots.plotting import PALETTE, new_figure, save_figure, tidy_axes
from results import Picture
from scoring.figures import Figure


def error_bars(figures: Sequence[Figure]) -> Any:
    """Return the lengths of the bars below and above figures, (2, N)."""
    return np.array([[0.0 if end is None else abs(end - figure.value) for end in (figure.low, figure.high)]
                     for figure in figures]).T.reshape(2, -1)


def by_group(name: str, text: str, panels: Mapping[str, Mapping[str, Any]]) -> Picture:
    """Draw figures of groups as points with intervals.

    Args:
        panels: title of an axis -> series -> (group -> name -> figure) and the name of the figures that are drawn.
    """
    names = list(dict.fromkeys(name for series in panels.values() for groups, _ in series.values() for name in groups))
    drawing = new_figure(4.2 * len(panels), 0.9 + 0.24 * len(names))
    for axes, (title, series) in zip(np.atleast_1d(drawing.subplots(1, len(panels), sharey=True)), panels.items()):
        for number, (label, (groups, key)) in enumerate(series.items()):
            there = {group: each[key] for group, each in groups.items() if each[key].value is not None}
            rows = [names.index(group) + 0.18 * (number - (len(series) - 1) / 2) for group in there]
            axes.errorbar([figure.value for figure in there.values()], rows, xerr=error_bars([*there.values()]),
                          fmt='o', ms=4, lw=1, color=PALETTE[number], label=label)
        axes.set_yticks(range(len(names)))
        axes.set_yticklabels([group.replace('_', ' ') for group in names])
        axes.set_ylim(len(names) - 0.5, -0.5)
        tidy_axes(axes, title)
        if len(series) > 1:
            axes.legend(frameon=False, fontsize='small')
    return saved(drawing, name, text)


def curves(name: str, text: str, lines: Mapping[str, Any], labels: Dict[str, str]) -> Picture:
    """Draw curves: label -> (x, y); labels: of the axes x and y."""
    drawing = new_figure(5.0, 3.6)
    axes = drawing.subplots()
    for colour, (label, (x, y)) in zip(PALETTE, lines.items()):
        axes.plot(x, y, color=colour, label=label)
    tidy_axes(axes, labels['x'], labels['y'])
    axes.legend(frameon=False, fontsize='small')
    return saved(drawing, name, text)


def trade_off(name: str, text: str, points: Mapping[str, Any], labels: Dict[str, str]) -> Picture:
    """Draw figures against time: label -> (time, figure)."""
    drawing = new_figure(6.5, 4.0)
    axes = drawing.subplots()
    for number, (label, (time, figure)) in enumerate(points.items()):
        axes.errorbar([time], [figure.value], yerr=error_bars([figure]), fmt='o', color=PALETTE[number % len(PALETTE)],
                      label=label)
    axes.set_xscale('log')
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FormatStrFormatter('%g'))
    axes.xaxis.set_minor_locator(NullLocator())
    tidy_axes(axes, labels['x'], labels['y'])
    axes.legend(frameon=False, fontsize='small')
    return saved(drawing, name, text)


def saved(drawing: Any, name: str, text: str) -> Picture:
    """Write a drawing as docs/images/results_NAME.svg and return it."""
    save_figure(drawing, results.IMAGES / f'results_{name}.svg')
    return Picture(f'results_{name}.svg', text)
