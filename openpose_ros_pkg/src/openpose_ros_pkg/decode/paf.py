"""From confidence maps and part affinity fields (PAF) to people.

Z. Cao et al., "OpenPose: Realtime Multi-Person 2D Pose Estimation using Part Affinity Fields", TPAMI 2019. Three steps:

1. Peaks: local maxima of the enlarged confidence maps, with sub-pixel positions, are possible joints.
2. Limbs: each pair of peaks that a limb may connect gets the mean of the field's component along the line between them,
   sampled at even steps, as OpenPose rates it (bodyPartConnectorBase.cpp, getScoreAB). Enough samples must support it.
   Two peaks almost in one place are kept with score 0: seen along its own axis a limb has no direction that a field
   could show, like a shoulder of a person in profile.
3. Assembly: limbs are matched greedily, the best first, and those that share a joint are merged into people. Limbs of
   score 0 come last and only add to people that others have started. The score of a person is the mean of the scores
   of its joints and limbs.
"""
from dataclasses import dataclass
from typing import Dict, List, Optional, Set, Tuple, cast

import cv2
import numpy as np

from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import Poses
from openpose_ros_pkg.skeletons import SkeletonModel

PEAK = np.dtype([('joint', np.int32), ('x', np.float32), ('y', np.float32), ('score', np.float32)])
"""A possible joint: its number, x and y [px of the network's input], score [0..1]."""
LIMB_CANDIDATE = np.dtype([('limb', np.int32), ('start', np.int32), ('end', np.int32), ('score', np.float32)])
"""A possible limb: its number in the skeleton, numbers of two peaks, score; 0: only their nearness speaks for it."""

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
# A limb of the skeleton by its number, numbers of two peaks, and score.
_Limb = Tuple[int, int, int, float]
# Of a limb, so that nothing is divided by zero [cells].
_LEAST_LENGTH = np.float32(1e-3)


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
    candidates = score_limbs(fields[model.heatmaps:], peaks, model, constants)
    return assemble(candidates, peaks, skeleton, params, constants)


def find_peaks(heatmaps: np.ndarray, model: Model, params: DecodeParams,
               valid_size: Optional[Tuple[int, int]] = None, constants: DecodeConstants = DECODE) -> np.ndarray:
    """Find the local maxima above the thresholds of the user and of the network.

    Args:
        heatmaps: (K, h, w) float32, one per joint.
        valid_size: see `decode_fields`.

    Returns:
        (N,) records `PEAK`, sorted by joint, the strongest of each joint first.
    """
    maps = _framed_maps(heatmaps, constants.heatmap_upsample)
    width = maps.shape[2]
    cells, values = np.flatnonzero(maps > np.float32(max(model.peak_threshold, params.peak_threshold))), maps.ravel()
    # strict on one side only, so that two equal neighbours are one peak
    for step in (-1, -width, -width - 1, -width + 1):
        cells = cells[values[cells] > values[cells + step]]
    for step in (1, width, width - 1, width + 1):
        cells = cells[values[cells] >= values[cells + step]]
    joint, v, u = np.unravel_index(cells, maps.shape)
    scale = model.stride / constants.heatmap_upsample
    peaks = np.empty(len(cells), PEAK)
    peaks['joint'], peaks['score'] = joint, np.minimum(values[cells], 1)
    peaks['x'] = (u - 0.5 + _parabola_offsets(values, cells, 1)) * scale - 0.5
    peaks['y'] = (v - 0.5 + _parabola_offsets(values, cells, width)) * scale - 0.5
    if valid_size is not None:
        peaks = peaks[(peaks['x'] <= valid_size[0] - 0.5) & (peaks['y'] <= valid_size[1] - 0.5)]
    peaks = peaks[np.lexsort((-peaks['score'], peaks['joint']))]
    rank = np.arange(len(peaks)) - np.searchsorted(peaks['joint'], peaks['joint'])
    peaks = peaks[rank < constants.peaks_per_joint]
    strongest = np.argsort(-peaks['score'], kind='stable')[:constants.peaks]
    return peaks[strongest][np.argsort(peaks['joint'][strongest], kind='stable')]


def score_limbs(pafs: np.ndarray, peaks: np.ndarray, model: Model, constants: DecodeConstants = DECODE) -> np.ndarray:
    """Rate every pair of peaks that a limb may connect, and keep those with support.

    Args:
        pafs: (2 L, h, w) float32.
        peaks: of `find_peaks`.

    Returns:
        (M,) records `LIMB_CANDIDATE`.

    Raises:
        ValueError: a limb names a channel that is not there.
    """
    channels = np.array([limb.paf for limb in model.skeleton.limbs]).reshape(-1, 2)
    if (channels >= len(pafs)).any():
        raise ValueError(f'the limbs of {model.skeleton.name} name channels that are not there: {len(pafs)} channels')
    limb, start, end = _pairs(peaks, model.skeleton)
    # in cells of the fields, all in float32
    x, y = ((peaks[axis] + np.float32(0.5)) / np.float32(model.stride) - np.float32(0.5) for axis in ('x', 'y'))
    dx, dy = x[end] - x[start], y[end] - y[start]
    _, height, width = pafs.shape
    length = np.maximum(np.sqrt(dx * dx + dy * dy), _LEAST_LENGTH)
    steps = np.linspace(0, 1, constants.limb_samples).astype(np.float32)[:, None]
    column = np.clip(np.rint(x[start] + steps * dx), 0, width - 1).astype(int)
    row = np.clip(np.rint(y[start] + steps * dy), 0, height - 1).astype(int)
    along_x, along_y = (pafs[channels[limb, axis], row, column] for axis in (0, 1))
    with np.errstate(invalid='ignore'):
        along = along_x * (dx / length) + along_y * (dy / length)
    support = (along > np.float32(constants.sample_threshold)).sum(axis=0)
    supported = support >= constants.limb_support * constants.limb_samples - 1e-6
    mean = np.where(supported, along.mean(axis=0), np.float32(0))
    score = mean + np.minimum(np.float32(constants.long_limb * height) / length - np.float32(1), np.float32(0))
    near = constants.foreshortened_limb * np.sqrt(height * width)  # [cells]
    kept = (score > 0) | (length < near)
    candidates = np.empty(int(kept.sum()), LIMB_CANDIDATE)
    for name, values in (('limb', limb), ('start', start), ('end', end), ('score', np.where(score > 0, score, 0))):
        candidates[name] = values[kept]
    return candidates


def assemble(candidates: np.ndarray, peaks: np.ndarray, skeleton: SkeletonModel, params: DecodeParams,
             constants: DecodeConstants = DECODE) -> Poses:
    """Match limbs of `score_limbs` between peaks of `find_peaks`, and merge them into people, the surest first."""
    peak_scores = peaks['score'].tolist()
    found: List[Tuple[float, _Person]] = []
    for person in _merged(_matched(candidates, peaks, constants), peaks, skeleton):
        joints = sorted(person.peaks)
        total = person.limb_scores + sum(peak_scores[person.peaks[joint]] for joint in joints)
        score = min(total / (len(joints) + person.limbs), 1.0)
        if len(joints) >= constants.person_joints and score >= params.person_min_score:
            found.append((score, person))
    found.sort(key=lambda one: -one[0])
    keypoints = np.full((len(found), len(skeleton.joints), 3), (np.nan, np.nan, 0), np.float32)
    for pose, (_, person) in zip(keypoints, found):
        of_person = peaks[list(person.peaks.values())]
        pose[of_person['joint']] = np.stack([of_person[name] for name in ('x', 'y', 'score')], axis=1)
    return Poses(keypoints, np.array([score for score, _ in found], np.float32))


def _framed_maps(heatmaps: np.ndarray, upsample: int) -> np.ndarray:
    """Enlarge maps, (K, h, w), and frame them with -inf, so that each cell has eight neighbours that it can beat."""
    count, height, width = heatmaps.shape
    height, width = height * upsample, width * upsample
    framed = np.full((count, height + 2, width + 2), -np.inf, np.float32)
    for source, target in zip(heatmaps, framed[:, 1:-1, 1:-1]):
        target[:] = source if upsample == 1 else cv2.resize(source, (width, height), interpolation=cv2.INTER_CUBIC)
    return framed


def _parabola_offsets(values: np.ndarray, cells: np.ndarray, step: int) -> np.ndarray:
    """Return where the parabola through a peak and its two neighbours has its top [cells, within +-0.5]."""
    before, after = values[cells - step], values[cells + step]
    with np.errstate(invalid='ignore', divide='ignore'):
        curvature = 2 * values[cells] - before - after
        offsets = np.clip((after - before) / (2 * curvature), -0.5, 0.5)
    return np.where(np.isfinite(before) & np.isfinite(after) & (curvature > 0), offsets, 0).astype(np.float64)


def _pairs(peaks: np.ndarray, skeleton: SkeletonModel) -> np.ndarray:
    """Return all pairs of peaks that limbs may connect, (3, N): limb, start and end."""
    bounds, index = np.searchsorted(peaks['joint'], np.arange(len(skeleton.joints) + 1)), skeleton.index
    parts = [np.zeros((3, 0), int)]
    for number, limb in enumerate(skeleton.limbs):
        starts, ends = (np.arange(bounds[index[end]], bounds[index[end] + 1]) for end in (limb.start, limb.end))
        start, end = np.repeat(starts, len(ends)), np.tile(ends, len(starts))
        parts.append(np.stack([np.full(len(start), number), start, end]))
    return np.concatenate(parts, axis=1)


def _matched(candidates: np.ndarray, peaks: np.ndarray, constants: DecodeConstants) -> List[_Limb]:
    """Return the limbs that win: each peak is used once per kind of limb."""
    of_peaks = peaks['score'][candidates['start']] + peaks['score'][candidates['end']]
    priority = candidates['score'] + np.float32(constants.peak_weight) * of_peaks
    order = np.lexsort((-priority, candidates['limb'], candidates['score'] <= 0))
    used: Set[Tuple[int, int]] = set()
    matched: List[_Limb] = []
    for limb, start, end, score in candidates[order].tolist():
        if (limb, start) not in used and (limb, end) not in used:
            used |= {(limb, start), (limb, end)}
            matched.append((limb, start, end, score))
    return matched


@dataclass
class _Person:
    """A person while limbs are merged."""

    peaks: Dict[int, int]  # numbers of the peaks, by joint
    limb_scores: float = 0.0
    limbs: int = 0  # with a score


def _merged(matched: List[_Limb], peaks: np.ndarray, skeleton: SkeletonModel) -> List[_Person]:
    """Merge limbs into people; each peak belongs to one person at most."""
    people: List[_Person] = []
    owner: Dict[int, _Person] = {}
    joint_of = peaks['joint'].tolist()
    for limb, start, end, score in matched:
        first, second = owner.get(start), owner.get(end)
        if first is None and second is None:
            if not skeleton.limbs[limb].starts_person or score <= 0:
                continue
            first = _Person({})
            people.append(first)
        elif first is not None and second is not None and first is not second:
            if first.peaks.keys() & second.peaks.keys():
                continue  # two people who touch: they stay apart
            first.peaks.update(second.peaks)
            first.limb_scores, first.limbs = first.limb_scores + second.limb_scores, first.limbs + second.limbs
            owner.update(dict.fromkeys(second.peaks.values(), first))
            people = [person for person in people if person is not second]
        person = cast(_Person, first or second)
        ends = {joint_of[start]: start, joint_of[end]: end}
        if any(person.peaks.get(joint, peak) != peak for joint, peak in ends.items()):
            continue  # the person has this joint elsewhere already
        person.peaks.update(ends)
        owner.update(dict.fromkeys(ends.values(), person))
        person.limb_scores += score
        person.limbs += score > 0
    return people
