"""Cameras and people from above."""
from typing import Dict, Tuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

from openpose_ros_tools.calibration.calibrate import Calibrated
from openpose_ros_tools.plots.plotting import HELP_COLOUR, PALETTE, new_figure, tidy_axes

# Length and half the opening of the fields of view that are drawn [m, degrees].
_REACH, _OPENING = 0.8, 30.0


def rig_figure(found: Calibrated) -> Figure:
    """Return the drawing: cameras with their fields of view, lines between cameras with common people, people."""
    figure = new_figure(7, 6, f'cameras in {found.rig.fixed_frame}, from above')
    axes = figure.add_subplot()
    places = np.array([np.nanmedian(person, axis=0)[:2] for person in found.people if np.isfinite(person).any()])
    axes.plot(*places.T, '.', color=HELP_COLOUR, markersize=2, alpha=0.5, label='people')
    centres: Dict[str, Tuple[float, float]] = {}
    for number, camera in enumerate(found.rig.cameras):
        rotation, centre = camera.pose
        angle = float(np.degrees(np.arctan2(rotation[1, 2], rotation[0, 2])))
        colour = PALETTE[number % len(PALETTE)]
        axes.add_patch(Wedge(tuple(centre[:2]), _REACH, angle - _OPENING, angle + _OPENING, color=colour, alpha=0.35))
        axes.plot(*centre[:2], 'o', color=colour)
        axes.annotate(f'{camera.name}\n{centre[2]:.2f} m high', tuple(centre[:2]), xytext=(6, 6),
                      textcoords='offset points', fontsize='small', color=colour)
        centres[camera.name] = (float(centre[0]), float(centre[1]))
    for edge in found.edges:
        ends = np.array([centres[edge.first], centres[edge.second]])
        axes.plot(*ends.T, '--', color=HELP_COLOUR, linewidth=0.7, zorder=0)
        labels = [f'{1e3 * edge.distance:.0f} mm'] * bool(np.isfinite(edge.distance)) + [
            f'{edge.pixels:.1f} px'] * bool(np.isfinite(edge.pixels))
        axes.annotate(', '.join(labels), tuple(ends.mean(axis=0)), fontsize='x-small', color=HELP_COLOUR, ha='center')
    axes.set_aspect('equal', 'datalim')
    tidy_axes(axes, 'x [m]', 'y [m]')
    return figure
