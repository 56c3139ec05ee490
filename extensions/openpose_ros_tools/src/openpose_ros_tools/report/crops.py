"""Crops of people out of the images of a recording."""
from typing import Dict, List, NamedTuple, Sequence

import cv2
import numpy as np

from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.tables.keypoint_table import KeypointTable

# Crops have this height [px], and at most this width; quality of their JPEG.
_HEIGHT, _MOST_WIDTH, _QUALITY = 220, 330, 80
# Border beside the joints, as a share of the longer side of their box; least one [px].
_BORDER, _LEAST_BORDER = 0.18, 10
# Joints with a lower confidence are not drawn and count nothing.
_SURE = 0.2


class Crop(NamedTuple):
    """Where a person is well visible; joints: (18, 3) of COCO_18 [px], with confidence."""

    person: int
    stamp: int  # of the image [ns]
    joints: np.ndarray


class Thumbnail(NamedTuple):
    """An image of a person."""

    person: int
    stamp: int  # [ns]
    jpeg: bytes


def choose_crops(table: KeypointTable, persons: Sequence[int], number: int) -> Dict[int, List[Crop]]:
    """Return by stamp [ns] where people are most visible: large, with many sure joints.

    The time of each person is cut into `number` parts, with one crop each.

    Args:
        table: in the image.
    """
    columns = [table.joints.index(joint) for joint in COCO_18.joints]
    crops: Dict[int, List[Crop]] = {}
    for person in persons:
        rows = np.flatnonzero(table.ids == person)
        rows = rows[np.argsort(table.stamps[rows], kind='stable')]
        for part in np.array_split(rows, number):
            joints = np.concatenate([table.positions[part][:, columns],
                                     table.confidence[part][:, columns, np.newaxis]], axis=2)
            values = [_value(person_joints) for person_joints in joints]
            if max(values, default=0.0) > 0:
                best = int(np.argmax(values))
                stamp = int(table.stamps[part[best]])
                crops.setdefault(stamp, []).append(Crop(person, stamp, joints[best]))
    return crops


def cut(bgr: np.ndarray, crop: Crop) -> Thumbnail:
    """Return the crop of an image, (H, W, 3) uint8 BGR, with the skeleton."""
    sure = crop.joints[crop.joints[:, 2] >= _SURE]
    low, high = sure[:, :2].min(axis=0), sure[:, :2].max(axis=0)
    border = max(_BORDER * float((high - low).max()), _LEAST_BORDER)
    height, width = bgr.shape[:2]
    left, top = (int(max(value - border, 0)) for value in low)
    right, bottom = (int(min(value + border + 1, most)) for value, most in zip(high, (width, height)))
    part = bgr[top:max(bottom, top + 1), left:max(right, left + 1)]
    if not part.size:
        return Thumbnail(crop.person, crop.stamp, b'')
    scale = min(_HEIGHT / part.shape[0], _MOST_WIDTH / part.shape[1])
    small = cv2.resize(part, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC)
    joints = crop.joints.copy()
    joints[:, :2] = (joints[:, :2] - (left, top) + 0.5) * scale - 0.5
    joints[~(joints[:, 2] >= _SURE)] = (np.nan, np.nan, 0.0)
    people = People2D(COCO_18, joints[np.newaxis], np.ones(1), np.full(1, -1))
    drawn = draw_people(small, people, DrawParams(), boxes=False)
    return Thumbnail(crop.person, crop.stamp, cv2.imencode('.jpg', drawn, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
                                                           )[1].tobytes())


def _value(joints: np.ndarray) -> float:
    sure = joints[joints[:, 2] >= _SURE]
    return float(sure[:, 2].sum() * np.ptp(sure[:, :2], axis=0).max()) if len(sure) > 1 else 0.0
