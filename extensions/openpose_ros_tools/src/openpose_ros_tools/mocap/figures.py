"""The figures of a comparison with motion capture: errors, shares, lengths of limbs, calibration of sigma."""
from typing import Any, Dict, Optional

import numpy as np
import pandas as pd

from openpose_ros_pkg.skeletons import BODY_25, COCO_18, MPI_15
from openpose_ros_tools.mocap.evaluation import Comparison
from skeleton_extract_3d.people import INFERRED, MEASURED

# Distances within which a joint counts as right, for the percentage of correct keypoints [m].
PCK_DISTANCES = {'pck_50': 0.05, 'pck_100': 0.1, 'pck_150': 0.15}
_KINDS = (('measured', MEASURED), ('inferred', INFERRED))
# Limbs whose lengths are compared: all that are drawn.
_LIMBS = tuple(dict.fromkeys(limb for skeleton in (COCO_18, BODY_25, MPI_15) for limb in skeleton.drawn_limbs))

Figures = Dict[str, Any]


def summarize(comparison: Comparison) -> Figures:
    """Return all figures of a comparison, ready for JSON: lengths in mm, shares 0..1, None where there is no data."""
    table = comparison.table()
    people = pd.DataFrame({'subject': comparison.subject, 'track': comparison.track, 'found': comparison.found})
    subjects = {}
    for number, of_subject in people.groupby('subject'):
        name, tracks = comparison.subjects[number], of_subject.track[of_subject.found]
        subjects[name] = dict(_figures(table[table.subject == name]), frames_found=len(tracks),
                              frames_missed=len(of_subject) - len(tracks), tracks=sorted(set(tracks.tolist())))
    return {
        'compared': comparison.compared,
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
    figures = {'reference': len(table), 'share_answered': _share(len(answered), len(table)),
               **{key: _share(int((answered.error <= distance).sum()), len(table))
                  for key, distance in PCK_DISTANCES.items()}, **_errors(answered.error)}
    for name, status in _KINDS:
        part = answered.error[answered.status == status]
        figures[name] = {'share_of_reference': _share(len(part), len(table)), **_errors(part)}
    return figures


def _errors(errors: pd.Series) -> Figures:
    """Return mean (the MPJPE), median and 90th percentile [mm] of errors [m], and shares of correct ones."""
    return {'answered': len(errors), 'mean_mm': number_or_none(1e3 * errors.mean()),
            'median_mm': number_or_none(1e3 * errors.median()), 'p90_mm': number_or_none(1e3 * errors.quantile(0.9)),
            **{f'{key}_of_answered': _share(int((errors <= distance).sum()), len(errors))
               for key, distance in PCK_DISTANCES.items()}}


def _bones(comparison: Comparison) -> Dict[str, Figures]:
    """Return the errors of the length of each limb, and its variation: standard deviation by mean, over a person."""
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
    for name, status in _KINDS:
        part = table[table.status == status].dropna(subset=['error', 'sigma'])
        if len(part):
            result[name] = {
                'samples': len(part), 'within_1_sigma': number_or_none((part.error <= part.sigma).mean()),
                'within_2_sigma': number_or_none((part.error <= 2 * part.sigma).mean()),
                'rms_sigma_mm': number_or_none(1e3 * np.sqrt((part.sigma ** 2).mean())),
                'rms_error_mm': number_or_none(1e3 * np.sqrt((part.error ** 2).mean()))}
    return result


def _share(part: int, whole: int) -> Optional[float]:
    return number_or_none(part / whole) if whole else None
