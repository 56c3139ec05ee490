"""How two cameras stand to each other, by the people that both see; and a tree of the best of these edges."""
from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.alignment.alignment import AlignmentParams, align
from openpose_ros_tools.calibration.constants import CALIBRATION
from openpose_ros_tools.calibration.recording import CameraPaths, overlap
from skeleton_extract_3d.points.transform import Transform

# Alignments with larger residuals are of other people [m].
_LARGEST_RESIDUAL = 0.1
# Another solution of this share of the merit makes an edge useless.
_RIVAL = 0.95


@dataclass(frozen=True, eq=False)
class Edge:
    """Two cameras: x_second = rotation x_first + translation.

    Attributes:
        first, second: numbers of the cameras.
        rotation, translation: (3, 3) and (3,) [m].
        clock_offset: [s], added to the times of the first camera gives those of the second.
        cost: the less, the better the edge is known.
    """

    first: int
    second: int
    rotation: np.ndarray
    translation: np.ndarray
    clock_offset: float
    cost: float

    def reversed(self) -> 'Edge':
        """Return the same edge from the second to the first camera."""
        return Edge(self.second, self.first, self.rotation.T, -self.rotation.T @ self.translation, -self.clock_offset,
                    self.cost)


@dataclass(frozen=True, eq=False)
class Standing:
    """Where a camera stands: x_root = R x_camera + t, and what is added to its times to get those of the root [s]."""

    pose: Transform
    clock_offset: float


def align_in_space(first: CameraPaths, second: CameraPaths, clock_offset: Optional[float]
                   ) -> Tuple[Transform, float, float]:
    """Return the transform from the first camera to the second, the clock offset, and the cost.

    Args:
        first, second: cameras with depth.
        clock_offset: if it is known [s].

    Raises:
        BadInputError: they have nothing in common, or too little to tell.
    """
    search = CALIBRATION.edges.clock_search if overlap(first, second) >= 0.5 else None
    found = align(first.measured(), second, AlignmentParams(clock_offset, max_clock_offset=search, use_sigma=True,
                                                            clock_option='--clocks-agree'))
    if found.residual > _LARGEST_RESIDUAL:
        raise BadInputError(f'half of the joints are more than {1e3 * found.residual:.0f} mm off at the best fit')
    if found.rival > _RIVAL:
        raise BadInputError(f'two ways to stand fit nearly alike ({100 * found.rival:.0f} %); people must walk about')
    return (found.rotation, found.translation), found.clock_offset, found.residual / np.sqrt(found.samples)


def check_motion(paths: CameraPaths) -> None:
    """Raise unless the people in space of a camera walk.

    Raises:
        BadInputError: all of them stay in one place.
    """
    least = CALIBRATION.edges.least_walk
    middles = np.nanmedian(paths.recording.points, axis=1)
    ways = np.linalg.svd(middles - middles.mean(axis=0), compute_uv=False) / np.sqrt(len(middles))
    if ways[0] < least:
        raise BadInputError(f'the people whom {paths.name} sees stay in one place: their middles spread by '
                            f'{ways[0]:.2f} m, expected {least:g} m or more; let somebody walk through the room')


def spanning_tree(cameras: Sequence[str], edges: Sequence[Edge], reasons: Dict[Tuple[int, int], str], root: int
                  ) -> List[Standing]:
    """Return where all cameras stand to one of them, by the tree of edges with the least cost.

    Args:
        cameras: names.
        reasons: why other pairs have no edge.
        root: number of the camera whose frame and clock count.

    Raises:
        BadInputError: not all cameras are connected; the text names the groups and the reasons.
    """
    count = len(cameras)
    best: Dict[Tuple[int, int], Edge] = {}
    for edge in sorted(edges, key=lambda one: -one.cost):
        best[edge.first, edge.second] = edge
        best[edge.second, edge.first] = edge.reversed()
    pairs = np.array(list(best)).reshape(-1, 2)
    graph = coo_matrix(([edge.cost for edge in best.values()], (pairs[:, 0], pairs[:, 1])), (count, count)).tocsr()
    groups, labels = connected_components(graph, directed=False)
    if groups > 1:
        names = [', '.join(name for name, label in zip(cameras, labels) if label == group) for group in range(groups)]
        why = '; '.join(f'{cameras[first]} and {cameras[second]}: {reason}' for (first, second), reason in
                        sorted(reasons.items()) if labels[first] != labels[second])
        raise BadInputError(f'the cameras fall into {groups} groups that share no people: {" | ".join(names)}. {why}')
    order, before = breadth_first_order(minimum_spanning_tree(graph), root, directed=False)
    standing = {root: Standing((np.eye(3), np.zeros(3)), 0.0)}
    for camera in order[1:].tolist():
        edge, parent = best[camera, int(before[camera])], standing[int(before[camera])]
        rotation, translation = parent.pose
        standing[camera] = Standing((rotation @ edge.rotation, rotation @ edge.translation + translation),
                                    parent.clock_offset + edge.clock_offset)
    return [standing[camera] for camera in range(count)]
