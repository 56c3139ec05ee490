"""People as objects of a planning scene: which are added, moved and removed from frame to frame.

Each part of a body is an object by itself, a cylinder with a ball at each end, so that it moves as a whole: releases of
MoveIt differ in what they do when the shapes of one object move against each other. A planner can allow contact with
single parts, such as a hand that takes something.
"""
from dataclasses import dataclass
from typing import Dict, List, NamedTuple, Tuple

import numpy as np

from openpose_ros_bridges.capsules import PARTS, Capsules
from openpose_ros_pkg.params.constants import constant

ADD, REMOVE, MOVE = 'ADD', 'REMOVE', 'MOVE'
"""Operations, as moveit_msgs/CollisionObject names them."""


@dataclass(frozen=True)
class SceneConstants:
    """When an object is added anew, rather than moved."""

    slack: float = constant(0.01, 'A new shape is larger than its part by this, and is kept until that outgrows it, or '
                                  'until it is too large by three times this.', unit='m', source='chosen')
    refresh: float = constant(1.0, 'Each object is added anew after this time, for planners that started later.',
                              unit='s', source='chosen')


SCENE = SceneConstants()


class Solid(NamedTuple):
    """A capsule in space."""

    centre: np.ndarray  # (3,) [m]
    orientation: np.ndarray  # (4,) unit quaternion x, y, z, w: z along its axis
    length: float  # of the axis [m]
    radius: float  # [m]


class Change(NamedTuple):
    """What a planner has to do with an object; `solid` is where it is, or was."""

    operation: str
    name: str
    solid: Solid


def solids_of(capsules: Capsules, sigmas: float) -> Dict[str, Solid]:
    """Return the parts of people by their names, such as person_5_left_hand.

    Args:
        sigmas: multiple of the greater sigma of the two ends by which the radius grows.
    """
    axes = capsules.ends[:, 1] - capsules.ends[:, 0]
    lengths = np.linalg.norm(axes, axis=1)
    radii = capsules.radii + sigmas * capsules.known_sigma.max(axis=1, initial=0.0)
    names = (f'person_{person}_{PARTS[part]}' for person, part in zip(capsules.persons, capsules.parts))
    return {name: Solid(centre, orientation, float(length), float(radius)) for name, centre, orientation, length, radius
            in zip(names, capsules.ends.mean(axis=1), _turns(axes, lengths), lengths, radii)}


def _turns(axes: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return the shortest turns of z to directions (N, 3), (N, 4) unit quaternions x, y, z, w."""
    x, y, z = (axes / np.where(lengths > 0, lengths, 1.0)[:, np.newaxis]).T
    turns = np.stack((-y, x, np.zeros_like(x), 1 + z), axis=-1)
    turns[1 + z < 1e-9] = (1.0, 0.0, 0.0, 0.0)  # straight down
    return np.asarray(turns / np.linalg.norm(turns, axis=1, keepdims=True))


class SceneObjects:
    """The objects that a planner knows."""

    def __init__(self, constants: SceneConstants = SCENE) -> None:
        self._constants = constants
        self._known: Dict[str, Tuple[Solid, float]] = {}  # shapes as they are known, and when they were added [s]

    def update(self, solids: Dict[str, Solid], stamp: float) -> List[Change]:
        """Return what changes with a frame of a stamp [s]."""
        changes = [Change(REMOVE, name, solid) for name, (solid, _) in self._known.items() if name not in solids]
        for change in changes:
            del self._known[change.name]
        for name, solid in solids.items():
            known, added = self._known.get(name, (solid, -np.inf))
            keep = self._fits(known, solid) and 0 <= stamp - added < self._constants.refresh
            slack = self._constants.slack
            length, radius = (known.length, known.radius) if keep else (solid.length + slack, solid.radius + slack)
            shown = solid._replace(length=length, radius=radius)
            self._known[name] = shown, added if keep else stamp
            changes.append(Change(MOVE if keep else ADD, name, shown))
        return changes

    def _fits(self, known: Solid, solid: Solid) -> bool:
        return all(size <= has <= size + 3 * self._constants.slack for has, size in (
            (known.length, solid.length), (known.radius, solid.radius)))
