"""The time report as plots: delays over time, their distribution and that of the steps between the stages."""
from typing import Any, Dict, Sequence, Tuple

import numpy as np
from matplotlib.figure import Figure

from openpose_ros_tools.delays.stage_delays import (
    CAMERA_ROLES,
    IMAGE,
    PEOPLE_2D,
    PEOPLE_3D,
    ROLES,
    Chain,
    Spread,
    steps,
)
from openpose_ros_tools.plots import plotting

_COLOURS: Dict[str, str] = dict(zip(ROLES, ('#56B4E9', '#8C8C8C', '#000000', '#F0B429', '#0072B2', '#D55E00', '#CC79A7',
                                            '#009E73')))
_BINS = 40
_SINCE = {'stamp': "since the camera's stamp", 'arrival': "since the frame's first camera message"}


def delays_over_time(chain: Chain) -> Figure:
    """Draw when the frames reached each stage, and the rates of the stages."""
    figure = plotting.new_figure(11.0, 7.0)
    above, below = figure.subplots(2, 1, sharex=True, gridspec_kw={'height_ratios': (2.2, 1)})
    delays, seconds = 1000 * chain.delays, chain.seconds
    span = (0.0, float(seconds[-1]) if len(seconds) else 0.0)
    for number in chain.main_stages:
        role = chain.stages[number].role
        known = np.isfinite(delays[:, number])
        above.plot(seconds[known], delays[known, number], '.-', color=_COLOURS[role], label=ROLES[role], markersize=4,
                   linewidth=0.7, rasterized=len(seconds) > 10 * plotting.DOTS_PER_INCH)
        if role in (*CAMERA_ROLES, PEOPLE_2D, PEOPLE_3D):
            # wide lines where another one usually lies on top
            below.plot(*plotting.rates_over_time(seconds[chain.reached[:, number]], span), color=_COLOURS[role],
                       linewidth=4.0 if role in (IMAGE, PEOPLE_2D) else 1.5)
    plotting.tidy_axes(above, ylabel=f'delay [ms] {_SINCE[chain.counted_from]}')
    above.set_ylim(bottom=min(0.0, above.get_ylim()[0]))
    above.tick_params(labelbottom=True)
    plotting.tidy_axes(below, ylabel='frames per second')
    below.set_ylim(bottom=0.0)
    plotting.time_axis(below, span)
    plotting.set_title(figure, f'When each stage had the frame: {chain.namespace}')
    plotting.legend_above(above, above.get_lines())
    return figure


def delay_distribution(chain: Chain) -> Figure:
    """Draw a histogram of the delay of each stage and, beside it, of the step to it from the stage before."""
    mains = chain.main_stages
    figure = plotting.new_figure(12.0, 1.2 + 1.15 * max(len(mains), 1))
    grid = figure.subplots(max(len(mains), 1), 2, sharex='col', squeeze=False)
    delays = 1000 * chain.delays
    step_of = {step.after: step for step in steps(chain)}
    limits = (_limits([delays[:, number] for number in mains]),
              _limits([1000 * step.seconds for step in step_of.values()]))
    for (left, right), number in zip(grid, mains):
        role = chain.stages[number].role
        _histogram(left, delays[:, number], limits[0], _COLOURS[role])
        left.set_ylabel(ROLES[role], rotation=0, ha='right', va='center')
        if role in step_of:
            _histogram(right, 1000 * step_of[role].seconds, limits[1], _COLOURS[role])
            right.set_ylabel(f'from {step_of[role].before_name}', rotation=0, ha='right', va='center',
                             fontsize='small', color=plotting.HELP_COLOUR)
        else:
            right.set_axis_off()
    grid[0, 0].set_title(f'Delay {_SINCE[chain.counted_from]}', loc='left', fontsize='medium')
    grid[0, 1].set_title('Step from the stage before', loc='left', fontsize='medium')
    for axes in grid[-1]:
        axes.set_xlabel('[ms]')
    plotting.set_title(figure, f'{chain.namespace}: {len(chain.frames)} frames; line: median, dashed: 95 % are below')
    return figure


def _limits(columns: Sequence[np.ndarray]) -> Tuple[float, float]:
    """Return the range that is shown of several stages: without the greatest 0.5 % of each, which are counted at the
    border."""
    known = [column[np.isfinite(column)] for column in columns if np.isfinite(column).any()]
    if not known:
        return 0.0, 1.0
    low, high = min(0.0, *(column.min() for column in known)), max(np.percentile(column, 99.5) for column in known)
    return float(low), float(high if high > low else low + 1.0)


def _histogram(axes: Any, values: np.ndarray, limits: Tuple[float, float], colour: str) -> None:
    known = values[np.isfinite(values)]
    axes.hist(np.minimum(known, limits[1]), _BINS, range=limits, color=colour, alpha=0.6)
    plotting.tidy_axes(axes, grid='x')
    axes.set_yticks([])
    axes.spines['left'].set_visible(False)
    if not len(known):
        axes.text(0.5, 0.5, 'not known', transform=axes.transAxes, ha='center', va='center',
                  color=plotting.HELP_COLOUR)
        return
    spread = Spread.of(known)
    axes.axvline(spread.median, color=colour, linewidth=2.0)
    axes.axvline(min(spread.p95, limits[1]), color=colour, linewidth=1.2, linestyle='--')
    axes.set_title(f'{spread.median:.1f} / {spread.p95:.1f} ms', loc='right', fontsize='small')
