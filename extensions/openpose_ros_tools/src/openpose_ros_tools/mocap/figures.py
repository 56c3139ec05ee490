"""The figures of a comparison with motion capture: errors, shares, lengths of limbs, calibration of sigma."""
from typing import Any, Dict, Optional

import numpy as np
import pandas as pd

from openpose_ros_pkg.skeletons import BODY_25, COCO_18, MPI_15
from openpose_ros_tools.mocap.evaluation import Comparison
from skeleton_extract_3d.people import INFERRED, MEASURED

# Distances within which a joint counts as right, for the percentage of correct keypoints [m].
PCK_DISTANCES = (0.05, 0.1, 0.15)
PCK_KEYS = tuple(f'pck_{round(1e3 * distance)}' for distance in PCK_DISTANCES)
_KINDS = (('measured', MEASURED), ('inferred', INFERRED))
# Limbs whose lengths are compared: all that are drawn.
_LIMBS = tuple(dict.fromkeys(limb for skeleton in (COCO_18, BODY_25, MPI_15) for limb in skeleton.drawn_limbs))

Figures = Dict[str, Any]


def summarize(comparison: Comparison) -> Figures:
    """Return all figures of a comparison, ready for JSON: lengths in mm, shares 0..1, None where there is no data."""
    table, found = comparison.table(), comparison.found
    people = pd.DataFrame({'subject': comparison.subject, 'track': comparison.track, 'found': found})
    tracks = {number: of_subject.track for number, of_subject in people[found].groupby('subject')}
    subjects = {}
    for number, of_subject in people.groupby('subject'):
        name, count = comparison.subjects[number], int(of_subject.found.sum())
        subjects[name] = dict(_figures(table[table.subject == name]), frames_found=count,
                              frames_missed=len(of_subject) - count,
                              tracks=sorted(set(tracks[number].tolist())) if count else [])
    return {
        'compared': {
            'frames': comparison.frames, 'frames_outside_reference': comparison.frames_outside,
            'frames_without_people_or_dropped': comparison.frames_empty, 'people_found': int(found.sum()),
            'people_missed': int((~found).sum()), 'share_found': number_or_none(found.mean()),
            'people_without_reference': comparison.extra_people,
            'id_switches': sum(int((np.diff(ids) != 0).sum()) for ids in tracks.values()),
            'joint_samples': int(table.error.count()), 'joints': list(comparison.joints),
            'joints_only_in_reference': list(comparison.only_reference),
            'joints_only_in_estimate': list(comparison.only_estimate)},
        'overall': _figures(table),
        'joints': {joint: _figures(table[table.joint == joint]) for joint in comparison.joints},
        'subjects': subjects,
        'bones': _bones(comparison),
        'sigma': _calibration(table)}


def number_or_none(value: float) -> Optional[float]:
    """Return a number that JSON can hold, with no more digits than mean something; None of NaN."""
    return round(float(value), 5) if np.isfinite(value) else None


def _figures(table: pd.DataFrame) -> Figures:
    """Return the figures of a part of `Comparison.table`."""
    answered = table.dropna(subset=['error'])
    figures = {'reference': len(table), 'answered': len(answered), **_spread(answered.error),
               'share_answered': _share(len(answered), len(table))}
    for distance, key in zip(PCK_DISTANCES, PCK_KEYS):
        right = int((answered.error <= distance).sum())
        figures[key] = _share(right, len(table))
        figures[f'{key}_of_answered'] = _share(right, len(answered))
    for name, status in _KINDS:
        part = answered.error[answered.status == status]
        figures[name] = {'answered': len(part), 'share_of_reference': _share(len(part), len(table)), **_spread(part),
                         **{f'{key}_of_answered': _share(int((part <= distance).sum()), len(part))
                            for distance, key in zip(PCK_DISTANCES, PCK_KEYS)}}
    return figures


def _spread(errors: pd.Series) -> Figures:
    """Return mean (the MPJPE), median and 90th percentile [mm] of errors [m]."""
    return {'mean_mm': number_or_none(1e3 * errors.mean()), 'median_mm': number_or_none(1e3 * errors.median()),
            'p90_mm': number_or_none(1e3 * errors.quantile(0.9))}


def _bones(comparison: Comparison) -> Dict[str, Figures]:
    """Return for each limb by how much its length is wrong, and how constant it is, beside the reference's.

    The constancy is the standard deviation of a person's lengths as a share of their mean, over all people.
    """
    bones: Dict[str, Figures] = {}
    for limb in _LIMBS:
        if not set(limb) <= set(comparison.joints):
            continue
        ends = [comparison.joints.index(joint) for joint in limb]
        lengths = pd.DataFrame({'subject': comparison.subject, **{
            name: np.linalg.norm(np.diff(positions[:, ends], axis=1)[:, 0], axis=1)
            for name, positions in (('ours', comparison.estimate), ('theirs', comparison.truth))}}).dropna()
        if len(lengths):
            difference = lengths.ours - lengths.theirs
            bones[' - '.join(limb)] = {
                'samples': len(lengths), 'reference_mm': number_or_none(1e3 * lengths.theirs.mean()),
                'bias_mm': number_or_none(1e3 * difference.mean()),
                'mean_abs_mm': number_or_none(1e3 * difference.abs().mean()),
                'variation': _variation(lengths.groupby('subject').ours),
                'reference_variation': _variation(lengths.groupby('subject').theirs)}
    return bones


def _variation(lengths: Any) -> Optional[float]:
    """Return the standard deviation over the mean of each person's lengths, averaged by their number of samples."""
    people = lengths.agg(['count', 'mean', 'std']).query('count > 1')
    return number_or_none(np.average(people['std'] / people['mean'], weights=people['count'])) if len(people) else None


def _calibration(table: pd.DataFrame) -> Dict[str, Figures]:
    """Return how well sigma, the root mean square error that the estimate claims, agrees with the errors."""
    result = {}
    table = table.dropna(subset=['error', 'sigma'])
    for name, status in _KINDS:
        error, sigma = (table[column][table.status == status] for column in ('error', 'sigma'))
        if len(error):
            result[name] = {
                'samples': len(error), 'within_1_sigma': number_or_none((error <= sigma).mean()),
                'within_2_sigma': number_or_none((error <= 2 * sigma).mean()),
                'rms_sigma_mm': number_or_none(1e3 * np.sqrt((sigma ** 2).mean())),
                'rms_error_mm': number_or_none(1e3 * np.sqrt((error ** 2).mean()))}
    return result


def _share(part: int, whole: int) -> Optional[float]:
    return number_or_none(part / whole) if whole else None
