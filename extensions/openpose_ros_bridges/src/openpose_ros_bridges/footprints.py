"""What people take up on the floor, now and in the next seconds, for planners that move a robot over it.

All is in a frame whose z is upwards.
"""
import math
from typing import List, NamedTuple, Sequence

import numpy as np

from openpose_ros_bridges.located import Located, velocity_sigma
from openpose_ros_signals.capsules import CAPSULES, Capsules


class Circle(NamedTuple):
    """A circle on the floor that moves."""

    id: int  # of the person
    centre: np.ndarray  # (2,) [m]
    radius: float  # [m]
    velocity: np.ndarray  # (2,) [m/s]; zeros: standing still, or not known
    velocity_sigma: float  # root mean square length of its error [m/s]; NaN: not known


def circles_of(persons: Sequence[Located], capsules: Capsules, sigmas: float) -> List[Circle]:
    """Return the footprints of people: circles round their places that hold all of their capsules.

    Radii grow by `sigmas` times the sigma of the joints.
    """
    radii = capsules.radii[:, np.newaxis] + sigmas * capsules.known_sigma
    circles = []
    for person in persons:
        velocity = np.zeros(2) if person.velocity is None else np.asarray(person.velocity[:2])
        centre, own = np.asarray(person.position[:2]), capsules.persons == person.id
        reach = np.linalg.norm(capsules.ends[own, :, :2] - centre, axis=2) + radii[own]
        circles.append(Circle(person.id, centre, float(reach.max(initial=CAPSULES.shin)), velocity,
                              velocity_sigma(person)))
    return circles


def predicted(circle: Circle, horizon: float, step: float, sigmas: float) -> List[Circle]:
    """Return a footprint now and, of one that moves, each `step` [s] up to `horizon` [s].

    It goes on with its velocity; its radius grows with the error of that, `sigmas` times that over the floor.
    """
    growth = 0.0 if math.isnan(circle.velocity_sigma) else sigmas * math.sqrt(2 / 3) * circle.velocity_sigma
    times = np.arange(0.0, horizon + step / 2, step) if circle.velocity.any() else [0.0]
    return [circle._replace(centre=circle.centre + time * circle.velocity, radius=circle.radius + time * growth)
            for time in times]


def points_in(circles: Sequence[Circle], spacing: float, near: float, far: float) -> np.ndarray:
    """Return the points of a square grid that lie in any of the circles, (N, 2) [m], each once.

    Points nearer to the origin than `near` or farther than `far` [m] are left out.
    """
    cells = [np.zeros((0, 2))]
    for circle in circles:
        least, most = (np.clip((circle.centre + side * circle.radius) / spacing, -far / spacing, far / spacing)
                       for side in (-1, 1))
        x, y = np.mgrid[np.ceil(least[0]):most[0] + 1, np.ceil(least[1]):most[1] + 1]
        grid = np.column_stack((x.ravel(), y.ravel()))
        cells.append(grid[np.linalg.norm(grid * spacing - circle.centre, axis=1) <= circle.radius])
    # complex numbers: np.unique(..., axis=0) of NumPy 1.17 fails on an empty array
    places = np.unique(np.concatenate(cells) @ np.array([1, 1j]))
    points = np.stack([places.real, places.imag], axis=1) * spacing
    distances = np.linalg.norm(points, axis=1)
    return np.asarray(points[(distances >= near) & (distances <= far)])
