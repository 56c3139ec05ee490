#!/usr/bin/python3
"""Measure how people_cloud labels the points of people, on rendered RGB-D sequences with known joints.

For each sequence it tells the share of the people's points that are found, the share of the scene's points that are
taken, and the milliseconds of processor time of a frame: the fastest of five runs, median and greatest of the frames.
A sequence folder holds rgb/, depth/ (16-bit PNG [mm]), meta.json and gt.json; the true masks are those of
PeopleMasks. The labels are those of the nodelet's own code, run by `label_people`.

    benchmarks/people_cloud.py SEQUENCE [SEQUENCE ...]                     # true joints
    benchmarks/accuracy_3d.py SEQUENCE [SEQUENCE ...] --out FOLDER
    benchmarks/people_cloud.py SEQUENCE [SEQUENCE ...] --joints FOLDER     # joints that the chain finds
    benchmarks/people_cloud.py SEQUENCE --images FOLDER                    # images of the labels
"""
import json
import subprocess
import sys
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple

import cv2
import numpy as np
import pandas as pd
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from accuracy_3d import PART_FIELDS, VISIBLE, open_sequence
from common import ROOT, Parser, errors_end_the_program, markdown, new_path
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import MEASURED
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

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

LABEL_PEOPLE = ROOT / 'devel' / 'lib' / 'openpose_ros_nodelets' / 'label_people'
# Joints that are not to be seen are given with this standard deviation [m], as the estimator's mostly are.
HIDDEN_SIGMA = 0.1

# From the number of a frame to its people, (N, 18, 4) float32: x, y, z, standard deviation of what is not seen [m].
People = Callable[[int], np.ndarray]


class PeopleMasks:
    """Which points of a rendered sequence are of people, from the depth images and the true joints.

    A pixel shows the scene where its depth is the greatest that it has in any frame, as people move before a scene
    that stands still. What is always there and stands off the floor is of people where most of that surface is near
    their true bones in some frame, and of the scene otherwise. Where the camera moves, each frame is judged by that
    alone.

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

    def mask(self, frame: int) -> np.ndarray:
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


def true_people(folder: Path) -> People:
    """Return the true joints of the frames."""
    truth = json.loads((folder / 'gt.json').read_text())
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]

    def people(frame: int) -> np.ndarray:
        persons = truth['frames'][frame]['people']
        rows = np.zeros((len(persons), len(order), 4), np.float32)
        for row, person in zip(rows, persons):
            row[:, :3] = np.array(person['xyz'])[order]
            row[:, 3] = np.where(np.array(person['vis'])[order] == VISIBLE, 0, HIDDEN_SIGMA)
        return rows

    return people


def found_people(path: Path, fps: float) -> People:
    """Return the joints of the frames as a CSV of accuracy_3d.py holds them."""
    table = pd.read_csv(path)
    frames = np.round(table['field.header.stamp'].to_numpy() * 1e-9 * fps).astype(int)
    values = table[[f'field.{joint}.{part}' for joint in COCO_18.joints for part in PART_FIELDS]].to_numpy()
    parts = dict(zip(PART_FIELDS, np.moveaxis(values.reshape(len(table), len(COCO_18.joints), -1), 2, 0)))
    uncertainty = np.where(parts['status'] == MEASURED, 0, parts['sigma'])
    rows = np.stack([parts['x'], parts['y'], parts['z'], uncertainty], axis=-1).astype(np.float32)
    return lambda frame: rows[frames == frame]


def labels_of(sequence: RgbdSequence, depths: np.ndarray, people: People, frames: Sequence[int]
              ) -> Iterator[Tuple[float, np.ndarray]]:
    """Return the milliseconds and the labels (H, W) uint32 of each of these frames."""
    matrix = sequence.camera.matrix
    height, width = depths.shape[1:]
    with subprocess.Popen([str(LABEL_PEOPLE)], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdin.write(np.array([width, height], np.uint32).tobytes())
        process.stdin.write(matrix[[0, 1, 0, 1], [0, 1, 2, 2]].astype(np.float32).tobytes())
        for frame in frames:
            rows = people(frame)
            process.stdin.write((depths[frame] / np.float32(1000)).tobytes() + np.uint32(len(rows)).tobytes() +
                                rows.tobytes())
            process.stdin.flush()
            milliseconds = np.frombuffer(process.stdout.read(4), np.float32)[0]
            labels = np.frombuffer(process.stdout.read(4 * width * height), np.uint32)
            yield float(milliseconds), labels.reshape(height, width)
        process.stdin.close()


def draw(bgr: np.ndarray, mask: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return the image with what is rightly taken in green, not found in red, wrongly taken in blue."""
    image = bgr // 2
    for channel, chosen in ((1, (mask == PERSON) & (labels > 0)), (2, (mask == PERSON) & (labels == 0)),
                            (0, (mask != PERSON) & (labels > 0))):
        image[chosen, channel] = np.minimum(image[chosen, channel].astype(int) + 127, 255)
    return image


def measure(folder: Path, joints: Optional[Path], images: Optional[Path], every: int) -> Dict[str, float]:
    """Return the figures of a sequence, of every so many frames."""
    sequence = open_sequence(folder)
    name = f'{folder.resolve().parent.name}_{folder.resolve().name}'
    people = true_people(folder) if joints is None else found_people(joints / f'{name}.csv', sequence.fps)
    depths = np.stack([frame.depth for frame in sequence])
    v, u = np.mgrid[:depths.shape[1], :depths.shape[2]]
    matrix = sequence.camera.matrix
    rays = np.stack([(u - matrix[0, 2]) / matrix[0, 0], (v - matrix[1, 2]) / matrix[1, 1], np.ones(u.shape)], axis=-1)
    counts: List[List[int]] = []
    times = []
    masks = PeopleMasks(folder, depths, rays.astype(np.float32))
    frames = range(0, len(depths), every)
    for frame, (milliseconds, labels) in zip(frames, labels_of(sequence, depths, people, frames)):
        mask = masks.mask(frame)
        counts.append([int((chosen & (labels > 0)).sum()) for chosen in (mask == PERSON, mask == SCENE)] +
                      [int(chosen.sum()) for chosen in (mask == PERSON, mask == SCENE)])
        times.append(milliseconds)
        if images:
            image = draw(sequence.frame(frame).bgr, np.where(depths[frame] > 0, mask, UNDECIDED), labels)
            cv2.imwrite(str(images / f'{name}_{frame:03d}.png'), image)
    found, taken, of_people, of_scene = np.sum(counts, axis=0)
    return {'found': found / of_people, 'taken': taken / of_scene, 'ms': float(np.median(times)),
            'most ms': float(np.max(times))}


def main() -> None:
    """Run the benchmark from the command line."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    parser.add_argument('--joints', type=Path,
                        help='folder of the CSV files of accuracy_3d.py (default: the true joints)')
    parser.add_argument('--every', type=int, default=1, help='look at every so many frames (default: 1)')
    parser.add_argument('--images', type=new_path, help='folder for images of the labels')
    arguments = parser.parse_args()
    rows: List[List[str]] = [['sequence', 'found', 'taken', 'ms', 'most ms']]
    with errors_end_the_program():
        if arguments.images:
            arguments.images.mkdir(parents=True, exist_ok=True)
        for folder in arguments.sequences:
            figures = measure(folder, arguments.joints, arguments.images, arguments.every)
            rows.append([folder.name, *(f'{figures[key]:.3f}' for key in ('found', 'taken')),
                         *(f'{figures[key]:.1f}' for key in ('ms', 'most ms'))])
    sys.stdout.write(markdown(rows))


if __name__ == '__main__':
    main()
