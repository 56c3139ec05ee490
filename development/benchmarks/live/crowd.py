"""RGB-D sequences with a chosen number of people, made of the shipped one, whose two people are cut out."""
import json
import shutil
from pathlib import Path
from typing import Dict, List, NamedTuple, Sequence

import cv2
import numpy as np

from accuracy_3d import open_sequence
from common import DEMO
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.rgbd_sequence import RgbdFrame, RgbdSequence

# Who stands in front of the scene by this much is somebody; more than a metre from everybody's joints, nobody [m].
BEFORE, AT_JOINT = 0.1, 0.5
# Copies: the person who is copied, how many frames later, how far to the right and away over the floor [m].
COPIES = ((1, 12, -0.5, 0.4), (0, 20, 1.3, 0.9), (1, 25, 0.8, 1.4), (0, 6, -0.7, 1.2), (1, 34, -1.4, 1.8),
          (0, 30, 0.3, 1.6))


class CutOut(NamedTuple):
    """Somebody in a frame: (H, W, 3) uint8 BGR, (H, W) float32 depth [m], (H, W) bool where the person is."""

    bgr: np.ndarray
    depth: np.ndarray
    mask: np.ndarray


def make_crowd(people: int, folder: Path) -> Path:
    """Write a sequence with 0 to 8 people and return its folder.

    One: the nearer of the two of the shipped sequence alone. More: both, and copies of them in other phases of their
    walk, farther away and aside. Shadows on the floor and contours are not those of a camera.
    """
    if people == 2:
        return DEMO
    sequence = open_sequence(DEMO)
    frames = list(sequence)
    scene = _scene(frames)
    cut = [_cut_out(frame, scene, joints) for frame, joints in zip(frames, _true_joints(DEMO))]
    for name in ('rgb', 'depth'):
        (folder / name).mkdir(parents=True)
    for name in ('camera.yaml', 'sequence.yaml'):
        shutil.copy(str(DEMO / name), str(folder / name))
    copies = [_moved([each[who] for each in cut], late, sideways, away, sequence)
              for who, late, sideways, away in COPIES[:max(people - 2, 0)]]
    for number, both in enumerate(cut):
        crowd = [*both[max(2 - people, 0):], *(copy[number] for copy in copies)]
        bgr, depth = scene.bgr.copy(), scene.depth.copy()
        for person in crowd:
            nearer = person.mask & ((depth == 0) | (person.depth < depth))
            bgr[nearer], depth[nearer] = person.bgr[nearer], person.depth[nearer]
        cv2.imwrite(str(folder / 'rgb' / f'{number:05d}.jpg'), bgr, [cv2.IMWRITE_JPEG_QUALITY, 92])
        cv2.imwrite(str(folder / 'depth' / f'{number:05d}.png'), np.rint(1000 * depth).astype(np.uint16))
    return folder


def _true_joints(folder: Path) -> List[Dict[int, np.ndarray]]:
    frames = json.loads((folder / 'gt.json').read_text())['frames']
    return [{person['id']: np.array(person['xyz'], np.float32) for person in frame['people']} for frame in frames]


def _scene(frames: Sequence[RgbdFrame]) -> CutOut:
    """Return the room without people: what each pixel shows where it is farthest away."""
    depths = np.array([frame.depth for frame in frames])
    farthest = depths.argmax(axis=0)
    bgr = np.array([frame.bgr for frame in frames])
    rows, columns = np.indices(farthest.shape)
    depth = depths.max(axis=0) / np.float32(1000)
    return CutOut(bgr[farthest, rows, columns], depth, np.ones(depth.shape, bool))


def _cut_out(frame: RgbdFrame, scene: CutOut, joints: Dict[int, np.ndarray]) -> List[CutOut]:
    """Return the people of a frame in the order of their ids."""
    depth = frame.depth / np.float32(1000)
    before = (depth > 0) & (depth < scene.depth - BEFORE)
    middles = [joints[person][:, 2].mean() for person in sorted(joints)]
    people = []
    for middle in middles:
        own = before & (np.abs(depth - middle) < AT_JOINT)
        # the contour has no depth: it gets that of the body
        mask = cv2.morphologyEx(own.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((7, 7), np.uint8)) > 0
        filled = np.where(own, depth, middle).astype(np.float32)
        people.append(CutOut(frame.bgr, filled, mask))
    return people


def _moved(person: Sequence[CutOut], late: int, sideways: float, away: float, sequence: RgbdSequence) -> List[CutOut]:
    """Return somebody in another phase of the walk, moved over the floor [m], forth and back in time."""
    there_and_back = [*range(len(person)), *range(len(person) - 2, 0, -1)]
    moved = []
    for number in range(len(person)):
        source = person[there_and_back[(number + late) % len(there_and_back)]]
        middle = float(np.median(source.depth[source.mask])) if source.mask.any() else 1.0
        moved.append(_shifted(source, middle, _step(sequence, sideways, away), sequence.camera))
    return moved


def _step(sequence: RgbdSequence, sideways: float, away: float) -> np.ndarray:
    """Return a step over the floor in the optical frame, (3,) [m]."""
    rotation = np.asarray(sequence.T_world_camera)[:3, :3]
    return rotation.T @ np.array([sideways, away, 0.0])


def _shifted(source: CutOut, middle: float, step: np.ndarray, camera: CameraModel) -> CutOut:
    """Return somebody at another place, as flat as a picture for the change of perspective."""
    scale = middle / (middle + step[2])
    focal, centre = camera.matrix[[0, 1], [0, 1]], camera.matrix[:2, 2]
    matrix = np.column_stack([scale * np.eye(2), centre - scale * centre + focal * step[:2] / (middle + step[2])])
    size = (camera.width, camera.height)
    depth = cv2.warpAffine(source.depth, matrix, size, flags=cv2.INTER_NEAREST)
    mask = cv2.warpAffine(source.mask.astype(np.uint8), matrix, size, flags=cv2.INTER_NEAREST) > 0
    return CutOut(cv2.warpAffine(source.bgr, matrix, size), depth + np.float32(step[2]), mask)
