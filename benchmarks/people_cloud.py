#!/usr/bin/python3
"""Measure how people_cloud labels the points of people, on rendered RGB-D sequences with known joints.

For each sequence it tells the share of the people's points that are found, the share of the scene's points that are
taken, and the milliseconds of processor time of a frame: the fastest of five runs, median and greatest of the frames.
A sequence folder holds rgb/, depth/ (16-bit PNG [mm]), meta.json and gt.json; the true masks are those of
people_masks.py. The labels are those of the nodelet's own code, run by `label_people`.

    benchmarks/people_cloud.py SEQUENCE [SEQUENCE ...]                     # true joints
    benchmarks/accuracy_3d.py SEQUENCE [SEQUENCE ...] --out FOLDER
    benchmarks/people_cloud.py SEQUENCE [SEQUENCE ...] --joints FOLDER     # joints that the chain finds
    benchmarks/people_cloud.py SEQUENCE --images FOLDER                    # images of the labels
"""
import json
import subprocess
import sys
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Tuple

import cv2
import numpy as np
import pandas as pd

from accuracy_3d import PART_FIELDS, VISIBLE, open_sequence
from common import ROOT, Parser, errors_end_the_program, markdown
from openpose_ros_pkg.skeletons import COCO_18
from people_masks import PERSON, SCENE, UNDECIDED, PeopleMasks
from skeleton_extract_3d.people import MEASURED
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

LABEL_PEOPLE = ROOT / 'devel' / 'lib' / 'openpose_ros_nodelets' / 'label_people'
# Joints that are not to be seen are given with this standard deviation [m], as the estimator's mostly are.
HIDDEN_SIGMA = 0.1

# From the number of a frame to its people, (N, 18, 4) float32: x, y, z, standard deviation of what is not seen [m].
People = Callable[[int], np.ndarray]


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


def labels_of(sequence: RgbdSequence, depths: np.ndarray, people: People) -> Iterator[Tuple[float, np.ndarray]]:
    """Return the milliseconds and the labels (H, W) uint32 of each frame."""
    matrix = sequence.camera.matrix
    height, width = depths.shape[1:]
    with subprocess.Popen([str(LABEL_PEOPLE)], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdin.write(np.array([width, height], np.uint32).tobytes())
        process.stdin.write(matrix[[0, 1, 0, 1], [0, 1, 2, 2]].astype(np.float32).tobytes())
        for frame, depth in enumerate(depths):
            rows = people(frame)
            process.stdin.write((depth / np.float32(1000)).tobytes() + np.uint32(len(rows)).tobytes() + rows.tobytes())
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


def measure(folder: Path, joints: Optional[Path], images: Optional[Path]) -> Dict[str, float]:
    """Return the figures of a sequence."""
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
    for frame, (mask, (milliseconds, labels)) in enumerate(zip(masks, labels_of(sequence, depths, people))):
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
    parser.add_argument('--images', type=Path, help='folder for images of the labels')
    arguments = parser.parse_args()
    rows: List[List[str]] = [['sequence', 'found', 'taken', 'ms', 'most ms']]
    with errors_end_the_program():
        if arguments.images:
            arguments.images.mkdir(parents=True, exist_ok=True)
        for folder in arguments.sequences:
            figures = measure(folder, arguments.joints, arguments.images)
            rows.append([folder.name, *(f'{figures[key]:.3f}' for key in ('found', 'taken')),
                         *(f'{figures[key]:.1f}' for key in ('ms', 'most ms'))])
    sys.stdout.write(markdown(rows))


if __name__ == '__main__':
    main()
