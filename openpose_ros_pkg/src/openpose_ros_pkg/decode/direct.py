"""From the outputs of networks that find people themselves to people: MoveNet and RTMO.

Both give COCO's 17 joints. Those of other joint sets that are not among them are missing, but for the neck, which is
the middle between the shoulders and as sure as the less sure of them.
"""
from dataclasses import dataclass
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.networks.models import Model
from openpose_ros_pkg.oks import sigmas, similarity
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import Poses, keypoints_in
from openpose_ros_pkg.skeletons import COCO_17


@dataclass(frozen=True)
class DirectDecodeParams(Parameters):
    """Thresholds for networks that find people themselves: MoveNet and RTMO."""

    direct_joint_score: float = parameter(
        0.05, 'Confidence that a joint needs. MoveNet also places occluded joints, with 0.1 and below. Raise it (0.3) '
              'to keep only joints that are clearly visible.', minimum=0.0, maximum=1.0)
    direct_person_score: float = parameter(
        0.0, 'Score that a person needs; 0: the one for the network, 0.15 for MoveNet and 0.7 for RTMO.',
        minimum=0.0, maximum=1.0)
    direct_same_person: float = parameter(
        0.6, 'Similarity (OKS, of the joints that both have) above which two detections are the same person, and the '
             'one with the lower score is dropped. Unlike the overlap of boxes it separates people who cross.',
        minimum=0.0, maximum=1.0)


@dataclass(frozen=True)
class DirectConstants:
    """Scores of networks that find people themselves."""

    rtmo_person: float = constant(0.7, 'Score that a person of RTMO needs.', source='rtmlib, rtmo.py, score_thr')
    rtmo_overlap: float = constant(
        0.45, 'Of two boxes of RTMO that share more of their union the less sure one goes.',
        source='rtmlib, rtmo.py, nms_thr')
    movenet_person: float = constant(
        0.15, 'Score that a person of MoveNet needs.',
        source='on 160 photographs with 166 annotated people, 77 % of the people above 0.15 were real, 86 % above 0.2 '
               'and all above 0.3, 55, 53 and 44 % of the annotated ones; AP falls by 0.02 from 0.15 to 0.2')


DIRECT = DirectConstants()


def decode_direct(outputs: Sequence[np.ndarray], model: Model, params: DirectDecodeParams, net_size: Tuple[int, int],
                  valid_size: Optional[Tuple[int, int]] = None) -> Poses:
    """Turn the outputs for one image into people.

    Args:
        outputs: float32, as `Backend.infer` gives them, without the first axis (the image).
        model: tells the decoder and the joints that are wanted.
        net_size: (width, height) of the network's input [px].
        valid_size: (width, height) of the image within it [px]; what lies beyond is padding, and joints there are
            missing. None: all of it.

    Returns:
        People in pixels of the network's input, the surest first. Everybody has a joint.
    """
    joints, scores = _DECODERS[model.decoder](outputs, params, net_size)
    width, height = valid_size or net_size
    x, y, confidence = np.moveaxis(joints, 2, 0)
    # A pixel reaches half a pixel beyond its centre.
    seen = (np.abs(x + 0.5 - width / 2) <= width / 2) & (np.abs(y + 0.5 - height / 2) <= height / 2)
    seen &= (confidence > 0) & (confidence >= params.direct_joint_score)
    # Before people are compared: where a joint out of sight is put is chance.
    people = keypoints_in(np.where(seen[..., np.newaxis], joints, (np.nan, np.nan, 0)), COCO_17, model.skeleton)
    known = seen.any(axis=1)
    people, scores = people[known], scores[known]
    weights = sigmas(model.skeleton)
    kept = _surest(scores, lambda i, j: similarity(people[i], people[j], weights) > params.direct_same_person)
    return Poses(people[kept].astype(np.float32), scores[kept].astype(np.float32))


def _decode_movenet(outputs: Sequence[np.ndarray], params: DirectDecodeParams,
             net_size: Tuple[int, int]) -> Tuple[np.ndarray, np.ndarray]:
    """Return joints (P, 17, 3) in pixels and scores (P,) of MoveNet MultiPose.

    Its model card: 17 times y, x, score, then ymin, xmin, ymax, xmax, score; positions as shares of the input.
    """
    rows = np.asarray(outputs[0], np.float64)
    rows = rows[rows[:, 55] >= (params.direct_person_score or DIRECT.movenet_person)]
    joints = rows[:, :51].reshape(-1, 17, 3)[..., [1, 0, 2]]
    joints[..., :2] = joints[..., :2] * net_size - 0.5
    return joints, rows[:, 55]


def _decode_single_person(outputs: Sequence[np.ndarray], params: DirectDecodeParams,
                          net_size: Tuple[int, int]) -> Tuple[np.ndarray, np.ndarray]:
    """Return joints (P, 17, 3) in pixels and scores (P,) of MoveNet for one person; P is 0 or 1.

    It gives (1, 17, 3): y, x as shares of the input, and score. The person's score is the mean of those of the joints.
    """
    joints = np.asarray(outputs[0], np.float64)[..., [1, 0, 2]]
    joints[..., :2] = joints[..., :2] * net_size - 0.5
    scores = joints[..., 2].mean(axis=1)
    sure = scores >= (params.direct_person_score or DIRECT.movenet_person)
    return joints[sure], scores[sure]


def _decode_rtmo(outputs: Sequence[np.ndarray], params: DirectDecodeParams,
          net_size: Tuple[int, int]) -> Tuple[np.ndarray, np.ndarray]:
    """Return joints (P, 17, 3) in pixels and scores (P,) of RTMO, of boxes that overlap only the surest.

    It gives boxes (N, 5): x1, y1, x2, y2 [px of its input], score; and keypoints (N, 17, 3): x, y [px], score.
    """
    boxes, joints = (np.asarray(output, np.float64) for output in outputs)
    sure = boxes[:, 4] >= (params.direct_person_score or DIRECT.rtmo_person)
    boxes, joints = boxes[sure], joints[sure]
    kept = _surest(boxes[:, 4], lambda i, j: _overlap(boxes[i], boxes[j]) > DIRECT.rtmo_overlap)
    return joints[kept], boxes[kept, 4]


_DECODERS: Dict[str, Callable[..., Tuple[np.ndarray, np.ndarray]]] = {
    'movenet_multipose': _decode_movenet, 'movenet_singlepose': _decode_single_person, 'rtmo': _decode_rtmo}


def _surest(scores: np.ndarray, same: Callable[[int, int], bool]) -> List[int]:
    """Go through people from the surest on and leave out those who are the same as one before.

    Args:
        scores: (P,).
        same: whether two people, by their indices, are the same.

    Returns:
        Indices of those who are left, the surest first.
    """
    kept: List[int] = []
    for i in np.argsort(-scores, kind='stable'):
        if not any(same(i, j) for j in kept):
            kept.append(int(i))
    return kept


def _overlap(one: np.ndarray, other: np.ndarray) -> float:
    """Return the share of their union that two boxes have in common."""
    sides = np.minimum(one[2:4], other[2:4]) - np.maximum(one[:2], other[:2])
    common = float(np.prod(np.maximum(sides, 0)))
    union = float(np.prod(one[2:4] - one[:2]) + np.prod(other[2:4] - other[:2])) - common
    return common / union if union > 0 else 0.0
