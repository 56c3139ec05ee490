"""Which points of a rendered RGB-D sequence are of people, from the depth images and the true joints.

A pixel shows the scene where its depth is the greatest that it has in any frame, as people move before a scene that
stands still. What is always there and stands off the floor is of people where most of that surface is near their true
bones in some frame, and of the scene otherwise. Where the camera moves, each frame is judged by that alone.
"""
import json
from pathlib import Path
from typing import Iterator, List, Sequence, Tuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from openpose_ros_pkg.skeletons import COCO_18

# Values of a mask: no depth, or not to be decided (mixed depths of an edge, far from people and before the scene).
UNDECIDED, SCENE, PERSON = 0, 1, 2

# Noise of the rendered depth at 1 m, and what is added by the square of z / 2 m; the noise of surfaces seen at a flat
# angle [m]. A depth within this many standard deviations of the scene is the scene's.
NOISE, NOISE_SQUARE, FLAT_ANGLE, DEVIATIONS = 0.0015, 0.0018, 2.6, 4.0
# Up to this height, a surface that is always there is the floor [m].
FLOOR = 0.03
# A surface is of people if most of its points are this near to bones; clothes, hair, hands and feet are this near [m].
NEAR_BONE, AT_BONE = 0.25, 0.45
# Neighbours in the image are of one surface up to this difference of depth, per m of depth.
STEP = 0.02

_BONES = (*COCO_18.drawn_limbs, ('right_shoulder', 'right_hip'), ('left_shoulder', 'left_hip'))


class PeopleMasks:
    """The masks of a sequence folder with meta.json and gt.json.

    Args:
        folder: of the sequence.
        depths: (F, H, W) uint16 [mm], of all frames.
        rays: (H, W, 3), each with z = 1, in the optical frame.
    """

    def __init__(self, folder: Path, depths: np.ndarray, rays: np.ndarray) -> None:
        meta = json.loads((folder / 'meta.json').read_text())
        truth = json.loads((folder / 'gt.json').read_text())
        order = [[truth['joints'].index(joint) for joint in bone] for bone in _BONES]
        self._bones = [np.array([np.array(person['xyz'])[order] for person in frame['people']],
                                np.float32).reshape(-1, 2, 3) for frame in truth['frames']]
        self._depths, self._rays = depths, rays
        self._poses = np.array(meta.get('poses', [meta['T_world_camera']] * len(depths)))
        self._scene = None if 'poses' in meta else _greatest(depths)
        self._always = np.zeros(depths.shape[1:], bool)
        if self._scene is not None:
            self._always = self._surfaces_of_people(self._scene, range(0, len(depths), 8))

    def __iter__(self) -> Iterator[np.ndarray]:
        return (self._mask(frame) for frame in range(len(self._depths)))

    def _mask(self, frame: int) -> np.ndarray:
        """Return (H, W) uint8: UNDECIDED, SCENE or PERSON."""
        depth = self._depths[frame] / np.float32(1000)
        mask = np.where(depth > 0, SCENE, UNDECIDED).astype(np.uint8)
        if self._scene is None:
            mask[self._surfaces_of_people(depth, [frame])] = PERSON
            return mask
        before = (depth > 0) & (depth < self._scene - _tolerance(self._scene))
        mask[before] = UNDECIDED
        for chosen, reach in ((self._always & (depth > 0) & ~before, NEAR_BONE), (before, AT_BONE)):
            rows, columns = np.nonzero(chosen)
            near = distances(depth[rows, columns, None] * self._rays[rows, columns], self._bones[frame]) < reach
            mask[rows[near], columns[near]] = PERSON
        return mask

    def _surfaces_of_people(self, depth: np.ndarray, frames: Sequence[int]) -> np.ndarray:
        """Return (H, W) bool: on a surface off the floor, most of which is near bones in any of these frames."""
        pose = self._poses[frames[0]]
        points = depth[..., None] * self._rays
        off_floor = (depth > 0) & (points @ pose[2, :3] + pose[2, 3] > FLOOR)
        surface = _components(depth, off_floor)
        number = surface.max() + 1
        rows, columns = np.nonzero(off_floor)
        near = np.any([distances(points[rows, columns], self._bones[frame]) < NEAR_BONE for frame in frames], axis=0)
        share = np.bincount(surface[rows, columns], near, number) / np.maximum(
            np.bincount(surface[rows, columns], minlength=number), 1)
        return off_floor & (share > 0.5)[surface]


def distances(points: np.ndarray, bones: np.ndarray) -> np.ndarray:
    """Return the distance of each point (N, 3) to the nearest bone (B, 2, 3), (N,) [m]."""
    least = np.full(len(points), np.inf, np.float32)
    for start, end in bones:
        along = end - start
        share = np.clip((points - start) @ along / (along @ along), 0, 1)
        least = np.minimum(least, np.linalg.norm(points - start - share[:, None] * along, axis=1))
    return least


def _tolerance(depth: np.ndarray) -> np.ndarray:
    """Return what the depth of the scene varies by (H, W) [m]."""
    return DEVIATIONS * FLAT_ANGLE * (NOISE + NOISE_SQUARE * (depth / 2) ** 2)


def _greatest(depths: np.ndarray) -> np.ndarray:
    """Return the mean of the greatest depths of each pixel, (H, W) float32 [m], 0: never any."""
    greatest = depths.max(axis=0) / np.float32(1000)
    least = greatest - 1.5 * _tolerance(greatest)
    count, total = np.zeros_like(greatest), np.zeros_like(greatest)
    for depth in depths:
        there = (depth > 0) & (depth / np.float32(1000) >= least)
        count += there
        total += np.where(there, depth / np.float32(1000), 0)
    return total / np.maximum(count, 1)


def _components(depth: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return the number of the surface of each chosen pixel, (H, W) int."""
    index = np.arange(depth.size).reshape(depth.shape)
    pairs: List[Tuple[np.ndarray, np.ndarray]] = []
    for one, other in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        joined = chosen[one] & chosen[other] & (np.abs(depth[one] - depth[other]) < STEP * depth[one])
        pairs.append((index[one][joined], index[other][joined]))
    rows, columns = (np.concatenate(part) for part in zip(*pairs))
    graph = coo_matrix((np.ones(len(rows), bool), (rows, columns)), shape=(depth.size, depth.size))
    return connected_components(graph, directed=False)[1].reshape(depth.shape)
