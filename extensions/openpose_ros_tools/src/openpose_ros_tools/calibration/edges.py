"""The relative pose of two cameras by the people that both see; and a tree of the best of these edges."""
from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.alignment.alignment import AlignmentParams, align
from openpose_ros_tools.calibration.recording import CameraPaths, overlap
from skeleton_extract_3d.points.transform import Transform

# Alignments with larger residuals are of other people [m].
_LARGEST_RESIDUAL = 0.1
# Another solution of this share of the merit makes an edge useless.
_RIVAL = 0.95
# Maximum clock offset where the stamps of two recordings overlap by half or more; else any is searched [s].
_CLOCK_SEARCH = 2.0


@dataclass(frozen=True, eq=False)
class Edge:
    """Two cameras: x_second = rotation x_first + translation.

    Attributes:
        first, second: numbers of the cameras.
        transform: rotation and translation [m].
        clock_offset: [s], added to the times of the first camera gives those of the second.
        cost: the less, the better the edge is known.
    """

    first: int
    second: int
    transform: Transform
    clock_offset: float
    cost: float

    @property
    def second_pose(self) -> 'CameraPose':
        """The second camera in the frame of the first one."""
        rotation, translation = self.transform
        return CameraPose((rotation.T, -rotation.T @ translation), -self.clock_offset)


@dataclass(frozen=True, eq=False)
class CameraPose:
    """A camera in the frame of the root: x_root = R x_camera + t; its times plus the offset [s] are the root's."""

    pose: Transform
    clock_offset: float

    def seen_from(self, root: 'CameraPose', scale: float = 1.0) -> 'CameraPose':
        """Return it in the frame of another root, distances multiplied by a scale."""
        rotation, shift = root.pose
        return CameraPose((rotation.T @ self.pose[0], scale * rotation.T @ (self.pose[1] - shift)),
                          self.clock_offset - root.clock_offset)


def align_in_space(first: CameraPaths, second: CameraPaths, clock_offset: Optional[float]
                   ) -> Tuple[Transform, float, float]:
    """Return the transform from the first camera to the second, both with depth, the clock offset, and the cost.

    Args:
        clock_offset: if it is known [s].

    Raises:
        BadInputError: they have nothing in common, or too little to tell.
    """
    search = _CLOCK_SEARCH if overlap(first, second) >= 0.5 else None
    found = align(first.recording, second, AlignmentParams(clock_offset, max_clock_offset=search, use_sigma=True,
                                                           clock_option='--clocks-agree'))
    if found.residual > _LARGEST_RESIDUAL:
        raise BadInputError(f'half of the joints are more than {1e3 * found.residual:.0f} mm off at the best fit')
    if found.rival > _RIVAL:
        raise BadInputError(f'two poses fit nearly alike ({100 * found.rival:.0f} %); people must walk about')
    return (found.rotation, found.translation), found.clock_offset, found.residual / np.sqrt(found.samples)


def spanning_tree(cameras: Sequence[str], edges: Sequence[Edge], reasons: Dict[Tuple[int, int], str]
                  ) -> List[CameraPose]:
    """Return the poses of all cameras in the frame of the first one, the root, by the tree of edges of least cost.

    Args:
        cameras: names.
        reasons: why other pairs have no edge.

    Raises:
        BadInputError: not all cameras are connected; the text names the groups and the reasons.
    """
    count = len(cameras)
    poses_to: Dict[Tuple[int, int], CameraPose] = {}  # of the first camera in the frame of the second one
    costs = np.zeros((count, count))
    for edge in sorted(edges, key=lambda one: -one.cost):
        poses_to[edge.first, edge.second] = CameraPose(edge.transform, edge.clock_offset)
        poses_to[edge.second, edge.first] = edge.second_pose
        # an entry of 0 would be no edge
        costs[edge.first, edge.second] = costs[edge.second, edge.first] = edge.cost + np.finfo(float).tiny
    graph = csr_matrix(costs)
    groups, labels = connected_components(graph, directed=False)
    if groups > 1:
        names = [', '.join(name for name, label in zip(cameras, labels) if label == group) for group in range(groups)]
        why = '; '.join(f'{cameras[first]} and {cameras[second]}: {reason}' for (first, second), reason in
                        sorted(reasons.items()) if labels[first] != labels[second])
        raise BadInputError(f'the cameras fall into {groups} groups that share no people: {" | ".join(names)}. {why}')
    order, before = breadth_first_order(minimum_spanning_tree(graph), 0, directed=False)
    poses = {0: CameraPose((np.eye(3), np.zeros(3)), 0.0)}
    for camera in order[1:].tolist():
        step, parent = poses_to[camera, int(before[camera])], poses[int(before[camera])]
        rotation, translation = parent.pose
        poses[camera] = CameraPose((rotation @ step.pose[0], rotation @ step.pose[1] + translation),
                                   parent.clock_offset + step.clock_offset)
    return [poses[camera] for camera in range(count)]
