"""From the outputs of networks that give people, not confidence maps of the image, to people.

All give COCO's 17 joints, SimCC also more. Those of other joint sets that are not among them are missing, but for the
neck, which is the middle between the shoulders and as sure as the less sure of them.
"""
from dataclasses import dataclass
from typing import Callable, Dict, NamedTuple, Sequence

import numpy as np

from openpose_ros_pkg.decode.one_stage import decode_movenet, decode_rtmo, decode_single_person, decode_yolo
from openpose_ros_pkg.decode.points import Decoded, only_seen
from openpose_ros_pkg.decode.queries import decode_detr_pose, decode_rf_detr
from openpose_ros_pkg.decode.simcc import decode_simcc
from openpose_ros_pkg.ensemble import sigmas as joint_sigmas
from openpose_ros_pkg.ensemble import similarity, surest
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import WHOLE_BODY_POINTS, Poses, keypoints_in
from openpose_ros_pkg.skeletons import POINT_SETS


@dataclass(frozen=True)
class DirectDecodeParams(Parameters):
    """Thresholds for networks that find people themselves, without confidence maps of the image."""

    direct_joint_score: float = parameter(
        0.05, 'Confidence that a joint needs. MoveNet also places occluded joints, with 0.1 and below. Raise it (0.3) '
              'to keep only joints that are clearly visible.', minimum=0.0, maximum=1.0)
    direct_person_score: float = parameter(
        0.0, 'Score that a person needs; 0: the one for the network, 0.15 for MoveNet, 0.7 for RTMO, 0.25 for '
             'YOLO-pose, 0.3 for SimCC (RTMPose) and YOLOX, 0.5 for DETRPose and RF-DETR.',
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

    simcc_person: float = constant(
        0.3, "Mean score of COCO's joints that a person of a SimCC network needs.",
        source='mmpose 1.3.2, demo/topdown_demo_with_mmdet.py, kpt-thr')
    detr_pose_person: float = constant(
        0.5, 'Score that a person of DETRPose needs.', source='DETRPose, tools/inference/onnx_inf.py, thrh')
    rf_detr_person: float = constant(
        0.5, 'Score that a person of RF-DETR Keypoint needs.', source='rfdetr 1.11.2, detr.py, predict, threshold')
    yolo_person: float = constant(
        0.25, 'Score that a person of YOLO-pose needs.', source="docs.ultralytics.com, Predict, conf")
    yolo_overlap: float = constant(
        0.7, 'Of two boxes of YOLO-pose that share more of their union the less sure one goes.',
        source='docs.ultralytics.com, Predict, iou')


DIRECT = DirectConstants()


class _Kind(NamedTuple):
    """A decoder, the names of its constants, and what its places are."""

    decode: Callable[..., Decoded]
    person: str  # least score
    overlap: str = ''  # greatest overlap of boxes, of decoders that compare them
    # whether places are shares of the image's size in its pixels, not of the input's
    of_image: bool = False


_KINDS: Dict[str, _Kind] = {
    Decoder.MOVENET_MULTIPOSE: _Kind(decode_movenet, 'movenet_person'),
    Decoder.MOVENET_SINGLEPOSE: _Kind(decode_single_person, 'movenet_person'),
    Decoder.RTMO: _Kind(decode_rtmo, 'rtmo_person', 'rtmo_overlap'),
    Decoder.YOLO_POSE: _Kind(decode_yolo, 'yolo_person', 'yolo_overlap'),
    Decoder.SIMCC: _Kind(decode_simcc, 'simcc_person'),
    Decoder.DETR_POSE: _Kind(decode_detr_pose, 'detr_pose_person', of_image=True),
    Decoder.RF_DETR: _Kind(decode_rf_detr, 'rf_detr_person', of_image=True)}


def decode_direct(outputs: Sequence[np.ndarray], model: Model, params: DirectDecodeParams, seen: ImageToNet,
                  constants: DirectConstants = DIRECT) -> Poses:
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
    overlap = (getattr(constants, kind.overlap),) if kind.overlap else ()
    decoded = kind.decode(outputs, params.direct_person_score or getattr(constants, kind.person), seen.net_size,
                          *overlap)
    source, target = POINT_SETS[model.points], model.skeleton
    # Pixel i of the image is (i + 0.5) scale - 0.5 in the input; its share of the image is i scale there.
    moved = np.array([*((seen.scale - 1) / 2 if kind.of_image else (0, 0)), 0])
    points = only_seen(decoded.points + moved, (*seen.offset, *seen.scaled_size), params.direct_joint_score)
    # before people are compared: the place of a joint out of sight is chance
    people = keypoints_in(points, source, target)
    sigmas = None
    if decoded.sigmas is not None:
        scored = np.concatenate([decoded.sigmas, points[..., 2:]], axis=2)
        sigmas = np.where(people[..., 2:] > 0, keypoints_in(scored, source, target)[..., :2], np.nan)
    kept = np.flatnonzero((people[..., 2] > 0).any(axis=1) & np.isfinite(decoded.scores))
    if len(kept) > 1:
        alike = similarity(people[kept][:, None], people[kept], joint_sigmas(target)) > constants.same_person
        kept = kept[surest(decoded.scores[kept], alike)]
    return Poses(people[kept].astype(np.float32), decoded.scores[kept].astype(np.float32),
                 points[kept].astype(np.float32) if model.points == WHOLE_BODY_POINTS else None,
                 None if sigmas is None else sigmas[kept].astype(np.float32))
