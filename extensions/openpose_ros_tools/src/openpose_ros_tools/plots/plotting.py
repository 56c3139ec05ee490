"""Shared parts of plots: figures, colours, axes and files. No window, no global state."""
import io
from pathlib import Path
from typing import Any, Dict, Sequence, Tuple

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from openpose_ros_pkg.output.files import write_whole

# Resolution of PNG, and of the rasterized parts of SVG [dots per inch].
DOTS_PER_INCH = 120

# Okabe and Ito, "Color Universal Design" (2008): distinguishable with any colour vision. In place of their yellow,
# which is hard to see on white, the wine of Tol's "muted" scheme (Colour Schemes, SRON technical note, 2021).
PALETTE = ('#0072B2', '#D55E00', '#009E73', '#CC79A7', '#56B4E9', '#E69F00', '#000000', '#882255')
# Colour of auxiliary lines and text.
HELP_COLOUR = '#8C8C8C'


def new_figure(width: float, height: float, title: str = '') -> Figure:
    """Return an empty figure [inches] that arranges its axes by itself (constrained layout), its title at the left."""
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, constrained_layout=True)
    FigureCanvasAgg(figure)
    if title:
        figure.suptitle(title, x=0.01, ha='left', fontsize='large')
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure atomically, as the suffix says: PNG or SVG.

    Raises:
        OSError: it can not be written.
    """
    write_whole(path, figure_content(figure, path.suffix[1:]))


def figure_content(figure: Figure, kind: str) -> bytes:
    """Return a figure as png or svg; the same figure gives the same bytes."""
    # the date, and random names of clip paths, would make each file another one
    metadata = {'Date': None} if kind == 'svg' else {}
    content = io.BytesIO()
    with matplotlib.rc_context({'svg.hashsalt': 'openpose_ros_tools'}):
        figure.savefig(content, format=kind, dpi=DOTS_PER_INCH, metadata=metadata)
    return content.getvalue()


def person_colours(ids: Sequence[int]) -> Dict[int, str]:
    """Return a colour for each track id, in the order given; after eight people they repeat."""
    return {person: PALETTE[number % len(PALETTE)] for number, person in enumerate(ids)}


def joint_title(joint: str) -> str:
    """Return the name of a joint as people write it: 'right wrist'."""
    return joint.replace('_', ' ')


def tidy_axes(axes: Any, xlabel: str = '', ylabel: str = '') -> None:
    """Give axes the look of this package: labels, a light grid, no frame at the top and right."""
    axes.set(xlabel=xlabel, ylabel=ylabel)
    for side in ('top', 'right'):
        axes.spines[side].set_visible(False)
    axes.set_axisbelow(True)
    axes.grid(True, color='#E5E5E5', linewidth=0.7)


def time_axis(axes: Any, span: Tuple[float, float]) -> None:
    """Make the x axis one of time, from begin to end [s], also where both are the same."""
    begin, end = span
    margin = 0.01 * (end - begin) or 0.5
    axes.set(xlim=(begin - margin, end + margin), xlabel='time since the first frame [s]')
