"""RGB-D sequences with a chosen number of people: the two of the shipped one, cut out and pasted."""
import shutil
from pathlib import Path
from typing import List, NamedTuple, Sequence, Tuple

import cv2
import numpy as np

from chain_runs import open_sequence
from common import DEMO
from ground_truth import TrueFrame, true_frames
from skeleton_extract_3d.points.rgbd_sequence import RgbdFrame, RgbdSequence

# Depth before the empty scene, and from the mean depth of the joints, of the pixels of a person [m].
_BEFORE, _AT_JOINTS = 0.1, 0.5
# Copies: person, delay [frames], shift to the right and away over the floor [m].
_COPIES: Tuple[Tuple[int, int, float, float], ...] = (
    (1, 12, -0.5, 0.4), (0, 20, 1.3, 0.9), (1, 25, 0.8, 1.4), (0, 6, -0.7, 1.2), (1, 34, -1.4, 1.8), (0, 30, 0.3, 1.6))


class CutOut(NamedTuple):
    """A person in a frame: (H, W, 3) uint8 BGR, (H, W) float32 depth [m], (H, W) bool mask."""

    bgr: np.ndarray
    depth: np.ndarray
    mask: np.ndarray


def make_crowd(folder: Path, parts: Sequence[int], frames: int = 40) -> Path:
    """Write a sequence of parts with 0 to 8 people, of so many frames each, if it is not there; return its folder.

    One: the nearer of the two of the shipped sequence alone. More: both, and copies of them in other phases of their
    walk, farther away and aside. Shadows on the floor and contours are not those of a camera.
    """
    if folder.is_dir():
        return folder
    sequence = open_sequence(DEMO)
    shipped = list(sequence)
    for name in ('rgb', 'depth'):
        (folder / name).mkdir(parents=True)
    for name in ('camera.yaml', 'sequence.yaml'):
        shutil.copy(str(DEMO / name), str(folder / name))
    depths = np.array([frame.depth for frame in shipped])
    farthest, (rows, columns) = depths.argmax(axis=0), np.indices(depths.shape[1:])
    room = np.array([frame.bgr for frame in shipped])[farthest, rows, columns]
    room_depth = depths.max(axis=0) / np.float32(1000)
    cut = [_cut_out(frame, room_depth, true) for frame, true in zip(shipped, true_frames(DEMO))]
    forth_and_back = cut + cut[-2:0:-1]
    for number, count in enumerate(people for people in parts for _ in range(frames)):
        people = forth_and_back[number % len(forth_and_back)][2 - min(count, 2):]
        for row, late, *shift in _COPIES[:max(count - 2, 0)]:
            people.append(_moved(forth_and_back[(number + late) % len(forth_and_back)][row], shift, sequence))
        bgr, depth = room.copy(), room_depth.copy()
        for person in people:
            nearer = person.mask & ((depth == 0) | (person.depth < depth))
            bgr[nearer], depth[nearer] = person.bgr[nearer], person.depth[nearer]
        cv2.imwrite(str(folder / 'rgb' / f'{number:05d}.jpg'), bgr, [cv2.IMWRITE_JPEG_QUALITY, 92])
        cv2.imwrite(str(folder / 'depth' / f'{number:05d}.png'), np.rint(1000 * depth).astype(np.uint16))
    return folder


def _cut_out(frame: RgbdFrame, room_depth: np.ndarray, true: TrueFrame) -> List[CutOut]:
    """Return the true people of a frame, in the order of their ids."""
    depth, cut = frame.depth / np.float32(1000), []
    for person in np.argsort(true.ids):
        middle = true.xyz[person, :, 2].astype(np.float32).mean()
        own = (depth > 0) & (depth < room_depth - _BEFORE) & (np.abs(depth - middle) < _AT_JOINTS)
        # the contour has no depth: it gets that of the body
        mask = cv2.morphologyEx(own.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((7, 7), np.uint8)) > 0
        cut.append(CutOut(frame.bgr, np.where(own, depth, middle).astype(np.float32), mask))
    return cut


def _moved(person: CutOut, shift: Sequence[float], sequence: RgbdSequence) -> CutOut:
    """Return a person moved over the floor [m], as flat as a picture for the change of perspective."""
    camera, step = sequence.camera, np.asarray(sequence.T_world_camera)[:3, :3].T @ np.array([*shift, 0.0])
    middle = float(np.median(person.depth[person.mask])) if person.mask.any() else 1.0
    scale = middle / (middle + step[2])
    focal, centre = camera.matrix[[0, 1], [0, 1]], camera.matrix[:2, 2]
    matrix = np.column_stack([scale * np.eye(2), centre - scale * centre + focal * step[:2] / (middle + step[2])])
    bgr, depth, mask = (cv2.warpAffine(image, matrix, (camera.width, camera.height), flags=flags) for image, flags in (
        (person.bgr, cv2.INTER_LINEAR), (person.depth, cv2.INTER_NEAREST),
        (person.mask.astype(np.uint8), cv2.INTER_NEAREST)))
    return CutOut(bgr, depth + np.float32(step[2]), mask > 0)
