"""Parts of bodies where they were last known, and how far links of a robot are from them."""
import math
from typing import Callable, NamedTuple, Sequence, Tuple

import numpy as np

# Steps of the search for a bound: to a hundredth of a millimetre in 100 m.
_STEPS = 24
# Spheres that stand for a link between two frames.
_MOST_SPHERES = 20


class Links(NamedTuple):
    """L parts of the robot as spheres, in the frame of the people."""

    names: Sequence[str]
    centres: np.ndarray  # (L, 3) [m]
    radii: np.ndarray  # (L,) [m]
    away: np.ndarray  # (L,) how far each may have moved since [m]


class MovingParts(NamedTuple):
    """N parts of bodies where they were last known."""

    persons: np.ndarray  # (N,) ids of people
    parts: np.ndarray  # (N,) places in `PARTS`
    status: np.ndarray  # (N,)
    stamps: np.ndarray  # (N,) when [s]
    ends: np.ndarray  # (N, 2, 3) [m]
    radii: np.ndarray  # (N,) that contain the part [m]
    skins: np.ndarray  # (N,) by which distances are told [m]
    sigma: np.ndarray  # (N, 2) root mean square errors of both ends [m]
    speeds: np.ndarray  # (N, 2) and of their velocities [m/s]
    velocity: np.ndarray  # (N, 2, 3) [m/s]
    swings: np.ndarray  # (N, 2) how far both ends may move about the root of their limb [m]

    @classmethod
    def none(cls) -> 'MovingParts':
        ids, values = np.zeros(0, np.int64), np.zeros(0)
        ends, points = np.zeros((0, 2)), np.zeros((0, 2, 3))
        return cls(ids, ids, ids, values, points, values, values, ends, ends, points, ends)

    def where(self, chosen: np.ndarray) -> 'MovingParts':
        return MovingParts(*(value[chosen] for value in self))

    def and_of(self, other: 'MovingParts') -> 'MovingParts':
        return MovingParts(*(np.concatenate(values) for values in zip(self, other)))


def spheres_of(ends: np.ndarray, radius: float) -> Tuple[np.ndarray, float]:
    """Return centres (M, 3) and a radius of spheres that hold the capsule between ends (2, 3) [m]; one, of a sphere."""
    length = float(np.linalg.norm(ends[1] - ends[0]))
    number = min(math.ceil(length / max(radius, 0.01)), _MOST_SPHERES - 1) + 1
    shares = np.linspace(0.0, 1.0, number)[:, np.newaxis]
    return ends[0] + shares * (ends[1] - ends[0]), math.hypot(radius, length / max(number - 1, 1) / 2)


def margins_of(known: MovingParts, ends: np.ndarray, sigma: np.ndarray, links: Links, grown: np.ndarray
               ) -> Tuple[np.ndarray, np.ndarray]:
    """Return how far links are from parts at their ends (N, 2, 3) [m] and at the nearest point between, and the root
    mean square errors along a line: both (3, L, N) [m].

    Where errors are the same along a part, the nearest point decides; where they differ, one of these nearly does.
    `sigma` (N, 2) is that of the ends, `grown` (N, 2) by how much they may be nearer [m].
    """
    begins, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    squares = np.maximum((along ** 2).sum(axis=1), 1e-12)
    offsets = links.centres[:, np.newaxis] - begins
    shares = np.clip((offsets * along).sum(axis=2) / squares, 0.0, 1.0)
    shares = np.stack([np.zeros_like(shares), shares, np.ones_like(shares)])
    distances = np.linalg.norm(offsets - shares[..., np.newaxis] * along, axis=3)

    def between(values: np.ndarray) -> np.ndarray:
        return (1 - shares) * values[:, 0] + shares * values[:, 1]

    distances = distances - known.radii - (links.radii + links.away)[:, np.newaxis]
    return distances - between(grown), np.maximum(between(sigma) / math.sqrt(3), 1e-9)


def greatest(probability: Callable[[float], float], most: float, highest: float) -> float:
    """Return the greatest bound from 0 to `highest` with at most that probability, which grows with it; else 0."""
    low, high = 0.0, max(highest, 0.0)
    if probability(low) > most:
        return 0.0
    for _ in range(_STEPS):
        middle = (low + high) / 2
        low, high = (middle, high) if probability(middle) <= most else (low, middle)
    return low
