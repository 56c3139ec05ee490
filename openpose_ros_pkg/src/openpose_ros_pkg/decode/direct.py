"""From the outputs of networks that give people, not confidence maps of the image, to people.

All give COCO's 17 joints, SimCC also more. Those of other joint sets that are not among them are missing, but for the
neck, which is the middle between the shoulders and as sure as the less sure of them.
"""
from dataclasses import dataclass
from typing import Callable, Dict, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.one_person import decode_heat_maps, decode_simcc, decode_single_person
from openpose_ros_pkg.decode.one_stage import decode_movenet, decode_rtmo, decode_yolo
from openpose_ros_pkg.ensemble import sigmas as joint_sigmas
from openpose_ros_pkg.ensemble import similarity, surest
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import WHOLE_BODY_POINTS, Poses, keypoints_in
from openpose_ros_pkg.skeletons import POINT_SETS


@dataclass(frozen=True)
class DirectThresholds:
    """Thresholds for networks that find people themselves, without confidence maps of the image."""

    joint_score: float = constant(
        0.05, 'Confidence that a joint needs. MoveNet also places occluded joints, with 0.1 and below.')
    person_score: float = constant(0.0, 'Score that a person needs; 0: the one for the network.')


# Of two detections with a greater similarity (OKS, of the joints that both have) the less sure one goes. Unlike the
# overlap of boxes it separates people who cross.
_SAME_PERSON = 0.6


class _Kind(NamedTuple):
    """A decoder and its thresholds."""

    decode: Callable[..., Poses]  # gives as many points as `Model.points`, in their order, float64
    person: float  # score that a person needs
    overlap: Optional[float] = None  # of boxes: of two that share more of their union the less sure goes


# Thresholds of the makers. RTMO: rtmlib, rtmo.py, score_thr and nms_thr. YOLO-pose: docs.ultralytics.com, Predict, conf
# and iou. SimCC, the mean score of COCO's joints: mmpose 1.3.2, demo/topdown_demo_with_mmdet.py, kpt-thr.
# PP-TinyPose, the mean square of the maps: 86 % of PicoDet's boxes without a person are below, 19 % of those with one.
# MoveNet: on 160 photographs with 166 annotated people, 77 % of the people above 0.15 were real, 86 % above 0.2 and all
# above 0.3, 55, 53 and 44 % of the annotated ones; AP falls by 0.02 from 0.15 to 0.2.
_KINDS: Dict[str, _Kind] = {
    Decoder.MOVENET_MULTIPOSE: _Kind(decode_movenet, 0.15),
    Decoder.MOVENET_SINGLEPOSE: _Kind(decode_single_person, 0.15),
    Decoder.RTMO: _Kind(decode_rtmo, 0.7, 0.45),
    Decoder.YOLO_POSE: _Kind(decode_yolo, 0.25, 0.7),
    Decoder.SIMCC: _Kind(decode_simcc, 0.3),
    Decoder.HEAT_MAPS: _Kind(decode_heat_maps, 0.06)}


def decode_direct(outputs: Sequence[np.ndarray], model: Model, thresholds: DirectThresholds, seen: ImageToNet) -> Poses:
    """Turn the outputs for one image into people.

    Args:
        outputs: float32, as `Backend.infer` gives them, without the first axis (the image).
        model: tells the decoder and the joints that are wanted.
        seen: how the image lies in the network's input; joints in the padding beyond are missing.

    Returns:
        People in pixels of the network's input, the surest first. Each has a joint. With all points that the network
        gives where those are COCO-WholeBody's.
    """
    kind = _KINDS[model.decoder]
    if model.output_scale != 1:
        outputs = [output * np.float32(model.output_scale) for output in outputs]
    overlap = () if kind.overlap is None else (kind.overlap,)
    decoded = kind.decode(outputs, thresholds.person_score or kind.person, seen.net_size, *overlap)
    source, target = POINT_SETS[model.points], model.skeleton
    points = _only_seen(decoded.keypoints, (*seen.offset, *seen.scaled_size), thresholds.joint_score)
    # before people are compared: the place of a joint out of sight is chance
    people = keypoints_in(points, source, target)
    kept = np.flatnonzero((people[..., 2] > 0).any(axis=1) & np.isfinite(decoded.scores))
    if len(kept) > 1:
        alike = similarity(people[kept][:, None], people[kept], joint_sigmas(target)) > _SAME_PERSON
        kept = kept[surest(decoded.scores[kept], alike)]
    return Poses(people[kept].astype(np.float32), decoded.scores[kept].astype(np.float32),
                 points[kept].astype(np.float32) if model.points == WHOLE_BODY_POINTS else None)


def _only_seen(points: np.ndarray, valid: Tuple[int, int, int, int], least: float) -> np.ndarray:
    """Return points (P, K, 3), x, y [px of the network's input], score; (NaN, NaN, 0) where they are missing.

    Args:
        valid: left, top, width and height of the image within the input [px]; points beyond are missing.
        least: score that a point needs, besides one above 0.
    """
    left, top, width, height = valid
    x, y, confidence = np.moveaxis(points, 2, 0)
    with np.errstate(invalid='ignore'):
        # A pixel reaches half a pixel beyond its centre.
        seen = (np.abs(x - left + 0.5 - width / 2) <= width / 2) & (np.abs(y - top + 0.5 - height / 2) <= height / 2)
        seen &= (confidence > 0) & (confidence >= least) & (confidence < np.inf)
    return np.where(seen[..., np.newaxis], points, (np.nan, np.nan, 0))
