"""Compare people of a camera with motion capture, once both are aligned: who is who, errors, and their figures."""
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterable, List, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_mocap.alignment import Alignment
from openpose_ros_mocap.clock import SAME_TIME, JointPaths, bridged_gap
from openpose_ros_mocap.joints import JointRecording
from openpose_ros_mocap.people import pair_people
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, MESSAGE_JOINTS, MPI_15
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING

# Distances within which a joint counts as right, for the percentage of correct keypoints [m].
PCK_DISTANCES = (0.05, 0.1, 0.15)
# Limbs whose lengths are compared: all that are drawn.
_LIMBS = tuple(dict.fromkeys(limb for skeleton in (COCO_18, BODY_25, MPI_15) for limb in skeleton.drawn_limbs))

Figures = Dict[str, Any]


@dataclass(frozen=True)
class EvaluationParams:
    """What is compared.

    Attributes:
        gate: who is farther than this from a subject, by the median of the joints, is not that subject [m].
        max_gap: between two samples of the reference that may be bridged [s], see `bridged_gap`.
        joints: names to compare; none: all that both have. Who is who is told by all joints in any case.
        start, end: part of the estimate, since its first frame [s]; None: to the ends.
    """

    gate: float = 0.5
    max_gap: float = 0.1
    joints: Tuple[str, ...] = ()
    start: Optional[float] = None
    end: Optional[float] = None


@dataclass(frozen=True)
class Comparison:
    """People who were found, beside the subjects that they are; N rows, one per person and frame.

    All positions are in the frame of the reference [m], NaN where missing.

    Attributes:
        joints: names of the K joints.
        subjects: names of the S subjects.
        times: (N,) [s] since the first frame of the estimate.
        subject, track: (N,) number of the subject, and track id.
        estimate, truth: (N, K, 3).
        status: (N, K) uint8 of the estimate.
        sigma: (N, K) [m].
        missed_times, missed_subject: (M,) of subjects whom the estimate has not, in frames in which it has somebody.
        missed_truth: (M, K, 3), where they were.
        frames: frames compared: those within the reference's time.
        frames_outside: frames of the estimate outside it, which do not count.
        frames_empty: times of a frame between them in which the estimate has nobody, which do not count: a table of
            people does not tell frames without people from frames that were dropped.
        extra_people: rows of the estimate that are near no subject.
        id_switches: how often a subject's track id changed.
        only_reference, only_estimate: joints that one of both has.
    """

    joints: Tuple[str, ...]
    subjects: Tuple[str, ...]
    times: np.ndarray
    subject: np.ndarray
    track: np.ndarray
    estimate: np.ndarray
    truth: np.ndarray
    status: np.ndarray
    sigma: np.ndarray
    missed_times: np.ndarray
    missed_subject: np.ndarray
    missed_truth: np.ndarray
    frames: int
    frames_outside: int
    frames_empty: int
    extra_people: int
    id_switches: int
    only_reference: Tuple[str, ...]
    only_estimate: Tuple[str, ...]

    @property
    def errors(self) -> np.ndarray:
        """Distances (N, K) of the estimate from the reference [m], NaN where one of both is missing."""
        return np.linalg.norm(self.estimate - self.truth, axis=2)


def compare(estimate: KeypointTable, reference: JointRecording, alignment: Alignment,
            params: Optional[EvaluationParams] = None, progress: Callable[[Iterable], Iterable] = iter) -> Comparison:
    """Find out who is who in each frame, and put the joints of both side by side.

    In each frame people and subjects are paired so that the sum of their distances is least, see `pair_people`.

    Args:
        progress: wraps the frames.

    Raises:
        ParameterError: a joint is unknown, or one that not both have.
        BadInputError: the recordings have no time in common, or no person is near a subject.
    """
    params = params or EvaluationParams()
    # who is who is told by all joints, also where only some are compared
    joints, only_reference, only_estimate = _common_joints(estimate, reference, params.joints)
    kept = np.array([not params.joints or MESSAGE_JOINTS[joint] in params.joints for joint in joints])
    begin = estimate.stamps.min()
    # from the first frame on, so that no precision is lost on stamps of decades
    lag = alignment.clock_offset - (reference.times[0] - begin * 1e-9)
    paths = JointPaths(reference.times - reference.times[0], reference.positions[:, :, joints],
                       bridged_gap(reference.times, params.max_gap))
    since = (estimate.stamps - begin) * 1e-9
    stamps, frame_of = np.unique(since, return_inverse=True)
    wanted = ((stamps >= (params.start or 0) - SAME_TIME)
              & (stamps <= (np.inf if params.end is None else params.end) + SAME_TIME))
    truth = paths.at(stamps + lag)
    inside = (stamps + lag > -SAME_TIME) & (stamps + lag < paths.times[-1] + SAME_TIME)
    positions = alignment.apply(estimate.positions[:, joints])
    order = np.argsort(frame_of, kind='stable')
    bounds = np.searchsorted(frame_of[order], np.arange(len(stamps) + 1))

    rows: List[Tuple[int, int, int]] = []  # row of the table, frame, subject
    missed: List[Tuple[int, int]] = []
    extra = 0
    for frame in progress(np.flatnonzero(wanted & inside)):
        here = order[bounds[frame]:bounds[frame + 1]]
        there = np.flatnonzero(np.isfinite(truth[:, frame]).all(axis=2).any(axis=1))
        pairs = pair_people(positions[here], truth[there, frame], params.gate)
        rows += [(here[person], frame, there[subject]) for person, subject in pairs]
        found = {subject for _, subject in pairs}
        missed += [(frame, subject) for number, subject in enumerate(there) if number not in found]
        extra += len(here) - len(pairs)
    if not (wanted & inside).any():
        raise BadInputError('estimate and reference have no time in common' + (
            ' between --start and --end' if wanted.sum() < len(wanted) else ' with this clock offset'))
    if not rows:
        raise BadInputError(f'no person of the estimate is within {params.gate:g} m of a subject of the reference')
    row, frame, subject = np.array(rows).T
    missed_frame, missed_subject = np.array(missed, int).reshape(-1, 2).T
    joints, positions, truth = joints[kept], positions[:, kept], truth[:, :, kept]
    status = np.where(np.isfinite(positions[row]).all(axis=2), estimate.status[row][:, joints], MISSING)
    return Comparison(
        joints=tuple(MESSAGE_JOINTS[joint] for joint in joints), subjects=tuple(reference.subjects),
        times=stamps[frame], subject=subject, track=estimate.ids[row], estimate=positions[row],
        truth=truth[subject, frame], status=status.astype(np.uint8),
        sigma=estimate.sigma[row][:, joints].astype(np.float64), missed_times=stamps[missed_frame],
        missed_subject=missed_subject, missed_truth=truth[missed_subject, missed_frame],
        frames=int((wanted & inside).sum()), frames_outside=int((wanted & ~inside).sum()),
        frames_empty=_empty_frames(stamps[wanted & inside]), extra_people=extra,
        id_switches=_switches(subject, estimate.ids[row]), only_reference=only_reference, only_estimate=only_estimate)


def _common_joints(estimate: KeypointTable, reference: JointRecording, names: Sequence[str]
                   ) -> Tuple[np.ndarray, Tuple[str, ...], Tuple[str, ...]]:
    """Return the numbers of the joints that both have, and the names that only the reference, or the estimate, has.

    Args:
        names: of joints that both must have; the others are not told. None: all are told.
    """
    unknown = [name for name in names if name not in MESSAGE_JOINTS]
    if unknown:
        raise ParameterError(f"joints {', '.join(unknown)} are unknown; allowed: {', '.join(MESSAGE_JOINTS)}")
    theirs = np.isfinite(reference.positions).all(axis=3).any(axis=(0, 1))
    ours = np.isfinite(estimate.positions).all(axis=2).any(axis=0)
    lacking = [name for name in names if not (ours & theirs)[MESSAGE_JOINTS.index(name)]]
    if lacking or not (ours & theirs).any():
        both = [name for name, common in zip(MESSAGE_JOINTS, ours & theirs) if common]
        raise ParameterError(f"estimate and reference do not both have the joints {', '.join(lacking) or 'of a person'}"
                             f"; both have: {', '.join(both) or 'none'}")
    chosen = np.array([not names or name in names for name in MESSAGE_JOINTS])

    def those(mask: np.ndarray) -> Tuple[str, ...]:
        return tuple(name for name, one in zip(MESSAGE_JOINTS, mask & chosen) if one)

    return np.flatnonzero(ours & theirs), those(theirs & ~ours), those(ours & ~theirs)


def _empty_frames(stamps: np.ndarray) -> int:
    steps = np.diff(stamps)
    return int(np.maximum(np.rint(steps / np.median(steps)) - 1, 0).sum()) if len(steps) else 0


def _switches(subject: np.ndarray, track: np.ndarray) -> int:
    return int(sum((np.diff(track[subject == one]) != 0).sum() for one in np.unique(subject)))


# ------------------------------------------------------------------------------------------------ figures

def summarize(comparison: Comparison) -> Figures:
    """Return all figures of a comparison, ready for JSON: lengths in mm, shares 0..1, None where there is no data."""
    errors, everything = comparison.errors, np.ones(len(comparison.joints), bool)
    known = np.isfinite(comparison.truth).all(axis=2)
    subjects = {}
    for number, name in enumerate(comparison.subjects):
        rows, missed = comparison.subject == number, comparison.missed_subject == number
        if rows.any() or missed.any():
            subjects[name] = dict(_figures(comparison, errors, rows, missed, everything),
                                  frames_found=int(rows.sum()), frames_missed=int(missed.sum()),
                                  tracks=sorted(set(comparison.track[rows].tolist())))
    all_rows, all_missed = np.ones(len(errors), bool), np.ones(len(comparison.missed_subject), bool)
    found, missed_people = len(errors), len(comparison.missed_subject)
    return {
        'compared': {
            'frames': comparison.frames, 'frames_outside_reference': comparison.frames_outside,
            'frames_without_people_or_dropped': comparison.frames_empty, 'people_found': found,
            'people_missed': missed_people, 'share_found': _number(found / (found + missed_people)),
            'people_without_reference': comparison.extra_people, 'id_switches': comparison.id_switches,
            'joint_samples': int((known & np.isfinite(errors)).sum()), 'joints': list(comparison.joints),
            'joints_only_in_reference': list(comparison.only_reference),
            'joints_only_in_estimate': list(comparison.only_estimate)},
        'overall': _figures(comparison, errors, all_rows, all_missed, everything),
        'joints': {joint: _figures(comparison, errors, all_rows, all_missed, np.arange(len(everything)) == number)
                   for number, joint in enumerate(comparison.joints)},
        'subjects': subjects,
        'bones': _bones(comparison),
        'sigma': _calibration(comparison, errors)}


def _figures(comparison: Comparison, errors: np.ndarray, rows: np.ndarray, missed: np.ndarray, joints: np.ndarray
             ) -> Figures:
    """Return the figures of some rows, missed people and joints, all chosen by (..,) bool."""
    errors, status = errors[rows][:, joints], comparison.status[rows][:, joints]
    known = np.isfinite(comparison.truth[rows][:, joints]).all(axis=2)
    of_missed = int(np.isfinite(comparison.missed_truth[missed][:, joints]).all(axis=2).sum())
    answered = errors[np.isfinite(errors)]
    reference = int(known.sum()) + of_missed
    figures = {'reference': reference, 'answered': len(answered), **_spread(answered)}
    figures['share_answered'] = _share(len(answered), reference)
    for distance in PCK_DISTANCES:
        right, key = int((answered <= distance).sum()), f'pck_{round(1e3 * distance)}'
        figures[key] = _share(right, reference)
        figures[f'{key}_of_found_people'] = _share(right, reference - of_missed)
        figures[f'{key}_of_answered'] = _share(right, len(answered))
    for name, value in (('measured', MEASURED), ('inferred', INFERRED)):
        part = errors[(status == value) & np.isfinite(errors)]
        figures[name] = {'answered': len(part), 'share_of_reference': _share(len(part), reference), **_spread(part),
                         **{f'pck_{round(1e3 * distance)}_of_answered': _share(int((part <= distance).sum()), len(part))
                            for distance in PCK_DISTANCES}}
    return figures


def _spread(errors: np.ndarray) -> Figures:
    """Return mean (the MPJPE), median and 90th percentile [mm] of (N,) errors [m]."""
    if not len(errors):
        return {'mean_mm': None, 'median_mm': None, 'p90_mm': None}
    return {'mean_mm': _number(1e3 * errors.mean()), 'median_mm': _number(1e3 * np.median(errors)),
            'p90_mm': _number(1e3 * np.percentile(errors, 90))}


def _bones(comparison: Comparison) -> Dict[str, Figures]:
    """Return for each limb by how much its length is wrong, and how constant it is, beside the reference's.

    The constancy is the standard deviation of a person's lengths as a share of their mean, over all people.
    """
    bones: Dict[str, Figures] = {}
    for start, end in _LIMBS:
        if start not in comparison.joints or end not in comparison.joints:
            continue
        first, second = comparison.joints.index(start), comparison.joints.index(end)
        ours = np.linalg.norm(comparison.estimate[:, first] - comparison.estimate[:, second], axis=1)
        theirs = np.linalg.norm(comparison.truth[:, first] - comparison.truth[:, second], axis=1)
        both = np.isfinite(ours) & np.isfinite(theirs)
        if both.any():
            difference, subject = (ours - theirs)[both], comparison.subject[both]
            bones[f'{start} - {end}'] = {
                'samples': int(both.sum()), 'reference_mm': _number(1e3 * theirs[both].mean()),
                'bias_mm': _number(1e3 * difference.mean()), 'mean_abs_mm': _number(1e3 * np.abs(difference).mean()),
                'variation': _variation(ours[both], subject), 'reference_variation': _variation(theirs[both], subject)}
    return bones


def _variation(lengths: np.ndarray, subject: np.ndarray) -> Optional[float]:
    """Return the standard deviation over the mean of each person's lengths, averaged by their number of samples."""
    parts = [lengths[subject == one] for one in np.unique(subject)]
    parts = [part for part in parts if len(part) > 1]
    if not parts:
        return None
    return _number(np.average([part.std(ddof=1) / part.mean() for part in parts], weights=list(map(len, parts))))


def _calibration(comparison: Comparison, errors: np.ndarray) -> Dict[str, Figures]:
    """Return how well sigma, the root mean square error that the estimate claims, agrees with the errors."""
    result = {}
    for name, value in (('measured', MEASURED), ('inferred', INFERRED)):
        used = (comparison.status == value) & np.isfinite(errors) & np.isfinite(comparison.sigma)
        error, sigma = errors[used], comparison.sigma[used]
        if len(error):
            result[name] = {
                'samples': len(error), 'within_1_sigma': _number((error <= sigma).mean()),
                'within_2_sigma': _number((error <= 2 * sigma).mean()),
                'rms_sigma_mm': _number(1e3 * np.sqrt((sigma ** 2).mean())),
                'rms_error_mm': _number(1e3 * np.sqrt((error ** 2).mean()))}
    return result


def _share(part: int, whole: int) -> Optional[float]:
    return _number(part / whole) if whole else None


def _number(value: float) -> Optional[float]:
    """Return a number that JSON can hold, with no more digits than mean something."""
    return round(float(value), 5) if np.isfinite(value) else None
