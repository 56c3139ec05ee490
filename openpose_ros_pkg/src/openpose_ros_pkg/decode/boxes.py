"""From the outputs of networks that find people's boxes (YOLOX, PicoDet) to boxes."""
from dataclasses import dataclass
from typing import NamedTuple, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.networks.model_types import Decoder
from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class BoxConstants:
    """Thresholds for boxes of people."""

    yolox_person: float = constant(
        0.3, 'Score that a box of YOLOX needs.', source='rtmlib 0.0.16, yolox.py, postprocess, of files with NMS')
    yolox_overlap: float = constant(
        0.45, 'Of two boxes of YOLOX that share more of their union the less sure one goes; its file with NMS did so '
              'itself.', source='rtmlib 0.0.16, yolox.py, nms_thr')
    picodet_person: float = constant(
        0.15, 'Score that a box of PicoDet needs: what sees the person in it decides.', source='trials.md, PP-TinyPose')
    picodet_overlap: float = constant(
        0.6, 'The same as yolox_overlap, of PicoDet. Both also hold among the views of an image.',
        source='PaddleDetection, configs/picodet, nms_threshold')


BOXES = BoxConstants()
# Input pixels per cell of the three grids of YOLOX, in the order of its rows.
_STRIDES = (8, 16, 32)
# The class of people: the first of COCO's, and the only one of networks for people.
_PERSON = 0


class Boxes(NamedTuple):
    """Boxes of people, the surest first."""

    boxes: np.ndarray  # (N, 4) float32: x1, y1, x2, y2 [px of the network's input, an integer is a pixel's centre]
    scores: np.ndarray  # (N,) float32 [0..1]


def decode_boxes(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int],
                 decoder: str = Decoder.BOXES, constants: BoxConstants = BOXES) -> Boxes:
    """Return the boxes of people that a network found.

    Files of YOLOX have one of two forms; all are in pixels from the corner of the first one:
    - end to end (mmdeploy): boxes (N, 5): x1, y1, x2, y2, score; and classes (N,). Different people already;
    - raw, (N, 5 + C): x and y of the middle and the logarithms of width and height in cells of three grids, score of a
      box, and scores of C classes.
    PicoDet gives boxes (N, 4): x1, y1, x2, y2, and scores (1, N).

    Args:
        outputs: float32, as `Backend.infer` gives them, without the first axis (the image).
        least: score that a box needs; 0: that of the constants.
        net_size: (width, height) of the network's input [px].
        decoder: one of `BOX_DECODERS`.
    """
    rows, person, overlap = np.asarray(outputs[0], np.float64), constants.yolox_person, constants.yolox_overlap
    end_to_end = decoder == Decoder.BOXES and len(outputs) == 2
    if decoder == Decoder.PICODET:
        rows = np.hstack([rows, np.asarray(outputs[1], np.float64).T])
        person, overlap = constants.picodet_person, constants.picodet_overlap
    elif end_to_end:
        rows = rows[np.asarray(outputs[1]) == _PERSON]
    else:
        rows = _rows_of_grids(rows, net_size)
    rows = rows[np.isfinite(rows).all(axis=1) & (rows[:, 4] >= (least or person))]
    rows = rows[np.argsort(-rows[:, 4], kind='stable')]
    if not end_to_end:
        rows = rows[without_overlap(rows[:, :4], rows[:, 4], overlap)]
    # A box may reach beyond the input, as a person does at its border, but not far.
    side = np.tile(net_size, 2)
    boxes = np.minimum(np.maximum(rows[:, :4], -side), 2 * side) - 0.5
    return Boxes(boxes.astype(np.float32), np.minimum(rows[:, 4], 1).astype(np.float32))


def _rows_of_grids(rows: np.ndarray, net_size: Tuple[int, int]) -> np.ndarray:
    """Return x1, y1, x2, y2, score of people, (N, 5), of the raw form of YOLOX."""
    grids = []
    for stride in _STRIDES:
        y, x = np.mgrid[:net_size[1] // stride, :net_size[0] // stride]
        grids.append(np.stack([x.ravel(), y.ravel(), np.full(x.size, stride)], axis=1))
    x, y, stride = np.concatenate(grids).T
    with np.errstate(over='ignore', invalid='ignore'):
        middle = (rows[:, :2] + np.stack([x, y], axis=1)) * stride[:, None]
        half = np.exp(rows[:, 2:4]) * stride[:, None] / 2
        score = rows[:, 4] * rows[:, 5 + _PERSON]
        return np.concatenate([middle - half, middle + half, score[:, None]], axis=1)


def cells(net_size: Tuple[int, int]) -> int:
    """Return the number of rows of the raw form of YOLOX for an input of (width, height) [px]."""
    return sum((net_size[0] // stride) * (net_size[1] // stride) for stride in _STRIDES)


def without_overlap(boxes: np.ndarray, scores: np.ndarray, overlap: float) -> np.ndarray:
    """Return the indices of (N, 4) boxes x1, y1, x2, y2 without those that overlap a surer one (share of the union)."""
    sides = boxes[:, 2:] - boxes[:, :2]
    kept = cv2.dnn.NMSBoxes(np.hstack([boxes[:, :2], sides]).tolist(), scores.tolist(), 0.0, overlap)
    return np.asarray(kept, np.int64).ravel()


def overlaps(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the shares of their union that boxes, (N, 4) and (M, 4) x1, y1, x2, y2, have in common, (N, M)."""
    low = np.maximum(one[:, None, :2], other[:, :2])
    common = np.maximum(np.minimum(one[:, None, 2:], other[:, 2:]) - low, 0).prod(axis=2)
    areas = [np.maximum(boxes[:, 2:] - boxes[:, :2], 0).prod(axis=1) for boxes in (one, other)]
    return common / np.maximum(areas[0][:, None] + areas[1] - common, 1e-9)
