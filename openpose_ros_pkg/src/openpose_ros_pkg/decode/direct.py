"""From the outputs of networks that find people themselves to people: MoveNet, RTMO and YOLO-pose.

All give COCO's 17 joints. Those of other joint sets that are not among them are missing, but for the neck, which is
the middle between the shoulders and as sure as the less sure of them.
"""
from dataclasses import dataclass
from typing import Callable, Dict, Optional, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.ensemble import sigmas, similarity, surest
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import Poses, keypoints_in
from openpose_ros_pkg.skeletons import COCO_17


@dataclass(frozen=True)
class DirectDecodeParams(Parameters):
    """Thresholds for networks that find people themselves: MoveNet, RTMO and YOLO-pose."""

    direct_joint_score: float = parameter(
        0.05, 'Confidence that a joint needs. MoveNet also places occluded joints, with 0.1 and below. Raise it (0.3) '
              'to keep only joints that are clearly visible.', minimum=0.0, maximum=1.0)
    direct_person_score: float = parameter(
        0.0, 'Score that a person needs; 0: the one for the network, 0.15 for MoveNet, 0.7 for RTMO and '
             '0.25 for YOLO-pose.',
        minimum=0.0, maximum=1.0)


@dataclass(frozen=True)
class DirectConstants:
    """Scores of networks that find people themselves."""

    same_person: float = constant(
        0.6, 'Of two detections with a greater similarity (OKS, of the joints that both have) the less sure one goes. '
             'Unlike the overlap of boxes it separates people who cross.')
    rtmo_person: float = constant(0.7, 'Score that a person of RTMO needs.', source='rtmlib, rtmo.py, score_thr')
    rtmo_overlap: float = constant(
        0.45, 'Of two boxes of RTMO that share more of their union the less sure one goes.',
        source='rtmlib, rtmo.py, nms_thr')
    movenet_person: float = constant(
        0.15, 'Score that a person of MoveNet needs.',
        source='on 160 photographs with 166 annotated people, 77 % of the people above 0.15 were real, 86 % above 0.2 '
               'and all above 0.3, 55, 53 and 44 % of the annotated ones; AP falls by 0.02 from 0.15 to 0.2')

    yolo_person: float = constant(
        0.25, 'Score that a person of YOLO-pose needs.', source="docs.ultralytics.com, Predict, conf")
    yolo_overlap: float = constant(
        0.7, 'Of two boxes of YOLO-pose that share more of their union the less sure one goes.',
        source='docs.ultralytics.com, Predict, iou')


DIRECT = DirectConstants()


def decode_direct(outputs: Sequence[np.ndarray], model: Model, params: DirectDecodeParams, net_size: Tuple[int, int],
                  valid: Optional[Tuple[int, int, int, int]] = None, constants: DirectConstants = DIRECT) -> Poses:
    """Turn the outputs for one image into people.

    Args:
        outputs: float32, as `Backend.infer` gives them, without the first axis (the image).
        model: tells the decoder and the joints that are wanted.
        net_size: (width, height) of the network's input [px].
        valid: left, top, width and height of the image within it [px]; joints in the padding beyond are missing.
            None: all of it.

    Returns:
        People in pixels of the network's input, the surest first. Each has a joint.
    """
    joints, scores = _DECODERS[model.decoder](outputs, params.direct_person_score, net_size, constants)
    left, top, width, height = valid or (0, 0, *net_size)
    x, y, confidence = np.moveaxis(joints, 2, 0)
    # A pixel reaches half a pixel beyond its centre.
    seen = (np.abs(x - left + 0.5 - width / 2) <= width / 2) & (np.abs(y - top + 0.5 - height / 2) <= height / 2)
    seen &= (confidence > 0) & (confidence >= params.direct_joint_score)
    # before people are compared: the place of a joint out of sight is chance
    people = keypoints_in(np.where(seen[..., np.newaxis], joints, (np.nan, np.nan, 0)), COCO_17, model.skeleton)
    known = seen.any(axis=1)
    people, scores = people[known], scores[known]
    if len(people) > 1:
        alike = similarity(people[:, None], people, sigmas(model.skeleton)) > constants.same_person
        kept = surest(scores, alike)
        people, scores = people[kept], scores[kept]
    return Poses(people.astype(np.float32), scores.astype(np.float32))


def _decode_movenet(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int],
                    constants: DirectConstants) -> Tuple[np.ndarray, np.ndarray]:
    """Return joints (P, 17, 3) in pixels and scores (P,) of MoveNet MultiPose.

    Its model card: 17 times y, x, score, then ymin, xmin, ymax, xmax, score; positions as shares of the input.
    """
    rows = np.asarray(outputs[0], np.float64)
    rows = rows[rows[:, 55] >= (least or constants.movenet_person)]
    joints = rows[:, :51].reshape(-1, 17, 3)[..., [1, 0, 2]]
    joints[..., :2] = joints[..., :2] * net_size - 0.5
    return joints, rows[:, 55]


def _decode_single_person(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int],
                          constants: DirectConstants) -> Tuple[np.ndarray, np.ndarray]:
    """Return joints (P, 17, 3) in pixels and scores (P,) of MoveNet for one person; P is 0 or 1.

    It gives (1, 17, 3): y, x as shares of the input, and score. The person's score is the mean of those of the joints.
    """
    joints = np.asarray(outputs[0], np.float64)[..., [1, 0, 2]]
    joints[..., :2] = joints[..., :2] * net_size - 0.5
    scores = joints[..., 2].mean(axis=1)
    sure = scores >= (least or constants.movenet_person)
    return joints[sure], scores[sure]


def _decode_rtmo(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int],
                 constants: DirectConstants) -> Tuple[np.ndarray, np.ndarray]:
    """Return joints (P, 17, 3) in pixels and scores (P,) of RTMO, of boxes that overlap only the surest.

    It gives boxes (N, 5): x1, y1, x2, y2 [px of its input], score; and keypoints (N, 17, 3): x, y [px], score.
    """
    boxes, joints = (np.asarray(output, np.float64) for output in outputs)
    sure = boxes[:, 4] >= (least or constants.rtmo_person)
    boxes, joints = boxes[sure], joints[sure]
    kept = _without_overlap(boxes[:, :4], boxes[:, 4], constants.rtmo_overlap)
    return joints[kept], boxes[kept, 4]


def _decode_yolo(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int],
                 constants: DirectConstants) -> Tuple[np.ndarray, np.ndarray]:
    """Return joints (P, 17, 3) in pixels and scores (P,) of YOLO-pose (v8, 11, 26).

    It gives one of two forms, in pixels of its input from the corner of the first one (measured with mirror images),
    each with 17 times x, y, visibility at the end:
    - raw, (56, N): x and y of the middle of the box, its width, height and score;
    - end to end, (N, 57): x1, y1, x2, y2, score, class (there is one), of boxes that are different people already;
      unused rows are 0.
    Visibility supposes that there is a person, so the score of a joint is its visibility times the person's score.
    """
    output = outputs[0]
    end_to_end = output.shape[1] == 57
    rows = output if end_to_end else output.T
    rows = rows[rows[:, 4] >= (least or constants.yolo_person)].astype(np.float64)
    if not end_to_end:
        half = rows[:, 2:4] / 2
        boxes = np.hstack([rows[:, :2] - half, rows[:, :2] + half])
        rows = rows[_without_overlap(boxes, rows[:, 4], constants.yolo_overlap)]
    joints = rows[:, -51:].reshape(-1, 17, 3) - (0.5, 0.5, 0)
    joints[..., 2] *= rows[:, 4:5]
    return joints, rows[:, 4]


_DECODERS: Dict[str, Callable[..., Tuple[np.ndarray, np.ndarray]]] = {
    Decoder.MOVENET_MULTIPOSE: _decode_movenet, Decoder.MOVENET_SINGLEPOSE: _decode_single_person,
    Decoder.RTMO: _decode_rtmo, Decoder.YOLO_POSE: _decode_yolo}


def _without_overlap(boxes: np.ndarray, scores: np.ndarray, overlap: float) -> np.ndarray:
    """Return the indices of (N, 4) boxes x1, y1, x2, y2 without those that overlap a surer one (share of the union)."""
    sides = boxes[:, 2:] - boxes[:, :2]
    kept = cv2.dnn.NMSBoxes(np.hstack([boxes[:, :2], sides]).tolist(), scores.tolist(), 0.0, overlap)
    return np.asarray(kept, np.int64).ravel()
