"""True people: gt.json of a sequence, gt_world.json of a stage."""
import json
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence

import numpy as np

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import MEASURED, People3D

# Labels of joints: what hides them.
OUTSIDE, OWN_BODY, VISIBLE, OTHER_PERSON, FURNITURE = range(5)
_SIZES = {'xyz': (3,), 'uv': (2,), 'vis': ()}


class TrueFrame(NamedTuple):
    """P true people of a frame, joints in the order of COCO_18.

    Attributes:
        time: stamp [s], 0 for the first frame.
        ids: (P,).
        xyz, labels: joints in the frame of the camera, or of the world (P, 18, 3) [m]; their labels (P, 18).
        uv: pixels of the joints (P, 18, 2); of stages (0,).
        feet, feet_labels: toes and heels (P, 6, 3) [m] and (P, 6); where they are not known (0, ...).
        cameras: of stages, the number of cameras that see a joint (P, 18).
    """

    time: float
    ids: Sequence[int]
    xyz: np.ndarray
    labels: np.ndarray
    uv: np.ndarray = np.zeros(0)
    feet: np.ndarray = np.zeros((0, 6, 3))
    feet_labels: np.ndarray = np.zeros((0, 6))
    cameras: Any = 0

    @property
    def people(self) -> People3D:
        """The people as if all joints were measured."""
        shape = self.labels.shape
        return People3D(COCO_18, self.xyz, np.ones(shape), np.full(shape, MEASURED), np.full(shape, 0.02), self.ids)

    @property
    def people_2d(self) -> People2D:
        """The people by the true pixels: each joint within the image, hidden or not."""
        inside, count = self.labels[..., np.newaxis] != OUTSIDE, len(self.ids)
        keypoints = np.where(inside, np.insert(self.uv, 2, 1, axis=2), (np.nan, np.nan, 0)).astype(np.float32)
        return People2D(COCO_18, keypoints, np.ones(count), np.full(count, -1))

    def apart_in_image(self, found: np.ndarray) -> np.ndarray:
        """Return how far found people (N, 18, 2) [px] are from the true ones, (P, N).

        It is the median distance of joints as a share of half the diagonal of their true box; 1000: they share none.
        """
        apart = np.full((len(self.uv), len(found)), 1e3)
        for row, (uv, labels) in enumerate(zip(self.uv, self.labels)):
            distances = np.linalg.norm(found - uv, axis=2)[:, labels != OUTSIDE]
            near = np.isfinite(distances).any(axis=1)
            size = max(np.linalg.norm(np.ptp(uv[labels != OUTSIDE], axis=0)) / 2, 1.0) if near.any() else 1.0
            apart[row, near] = np.nanmedian(distances[near], axis=1) / size
        return apart


def true_frames(folder: Path) -> List[TrueFrame]:
    """Return the frames of a sequence."""
    truth, frames = json.loads((folder / 'gt.json').read_text()), []
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]
    for frame in truth['frames']:
        people, feet = frame['people'], [person['feet'] for person in frame['people'] if 'feet' in person]
        frames.append(TrueFrame(frame['t'], [person['id'] for person in people],
                                *(_values(people, key, order) for key in ('xyz', 'vis', 'uv')),
                                *(_values(feet, key, range(6)) for key in ('xyz', 'vis'))))
    return frames


def true_world(folder: Path) -> List[TrueFrame]:
    """Return the frames of a stage, with the people of whom a camera sees a joint."""
    truth, frames = json.loads((folder / 'gt_world.json').read_text()), []
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]
    for frame in truth['frames']:
        people = frame['people']
        cameras = np.sum([_values([{'vis': person['vis'][name]} for person in people], 'vis', order) == VISIBLE
                          for name in truth['cameras']], axis=0)
        seen = np.flatnonzero(cameras.any(axis=1))
        frames.append(TrueFrame(frame['t'], [people[row]['id'] for row in seen], _values(people, 'xyz', order)[seen],
                                np.where(cameras[seen] > 0, VISIBLE, OWN_BODY), cameras=cameras[seen]))
    return frames


def _values(people: Sequence[Dict[str, Any]], key: str, order: Sequence[int]) -> np.ndarray:
    return np.array([person[key] for person in people], float).reshape(-1, len(order), *_SIZES[key])[:, order]
