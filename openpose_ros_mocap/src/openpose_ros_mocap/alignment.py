"""Find the clock offset and the rigid transform between a camera's people and motion capture, without a prior.

1. The speeds of joints, which no rotation changes, are correlated for all lags (`mocap_clock`): candidates for the lag.
2. For each, a few pairs of track and subject give a transform each (Kabsch, robust); the one by which most joints of
   all people meet wins, so nobody needs to say who is who.
3. Lag and transform are refined together, by Gauss-Newton steps on the joints that were measured, with weights that
   let wrong persons and mislaid joints count for nothing.

A joint that is always found beside the marker's joint, as a detector's hip is, can not be told from a shift of the
camera as long as people do not turn; with many joints and people that turn it cancels. A constant delay of the
estimate is a part of the clock offset.
"""
import itertools
from dataclasses import dataclass, replace
from typing import Callable, Dict, Iterable, List, Optional, Tuple

import cv2
import numpy as np

from openpose_ros_mocap.clock import Correlations, JointPaths, bridged_gap, correlate_speeds, moving_speed
from openpose_ros_mocap.joints import JointRecording
from openpose_ros_mocap.people import steady_ids
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from skeleton_extract_3d.people import MEASURED

# Candidates: so many lags, at least so far apart [s]; of each so many pairs of track and subject.
_LAGS, _LAG_DISTANCE, _PAIRS = 12, 0.3, 6
# So many candidates are refined; so many tracks, the longest, are correlated; so many rows tell a candidate's merit.
_REFINED, _TRACKS, _ROWS = 6, 12, 1200
# Rows by which candidates are refined, and then the best one.
_REFINING_ROWS, _FINAL_ROWS = 3000, 20000
# Joints that meet within this count for a candidate, before and after it is refined [m].
_COARSE_GATE, _FINE_GATE = 0.25, 0.12
# Who is nearer to a subject than this, by the median of the measured joints, is that subject [m].
_PERSON_GATE = 0.5
# Refinement: steps for a candidate and for the best one, the largest change of the lag in one [s], and the change at
# which it ends [s, rad, m].
_FEW_STEPS, _MANY_STEPS, _LONGEST_STEP, _SETTLED = 8, 40, 0.1, 1e-5
# Residuals are compared with this, where they are smaller [m].
_SMALLEST_SCALE = 0.005
# A robust weight falls to 1/4 at this multiple of the scale (Geman and McClure).
_TUNING = 3.0
# Joints that a track must have in common with a subject, and joints in all, for a transform or a clock to be found.
_LEAST_POINTS = 30
# The fastest joints must reach this, or the clock can not be found [m/s]: standing people sway by less.
_LEAST_SPEED = 0.1
# Recordings are not longer [s]; a stamp of 0 among those that count from 1970 is a mistake.
_LONGEST = 86400.0
# Below this correlation of speeds the clock is not taken as found; with large residuals it must be higher.
_LEAST_CORRELATION, _SAFE_CORRELATION = 0.2, 0.5
# Another solution of this share of the merit makes the result doubtful; it differs by so much [s, degrees].
_RIVAL, _RIVAL_LAG, _RIVAL_ANGLE = 0.9, 0.1, 10.0
# Residuals above make the result doubtful [m], as an uncertain clock does, in frames.
_LARGE_RESIDUAL, _UNCERTAIN_FRAMES = 0.1, 0.25


@dataclass(frozen=True)
class AlignmentParams:
    """What is given, and how far is searched.

    Attributes:
        clock_offset: time of the reference minus time of the estimate [s]; None: to be found.
        transform: (4, 4), from the camera's frame to the reference's [m]; None: to be found.
        max_clock_offset: offsets up to this are searched, either way [s]; None: wherever the recordings overlap.
        max_gap: between two samples of the reference that may be bridged [s], see `bridged_gap`.
        use_sigma: weigh joints by 1 / sigma^2, as far as the estimate tells sigma.
    """

    clock_offset: Optional[float] = None
    transform: Optional[np.ndarray] = None
    max_clock_offset: Optional[float] = None
    max_gap: float = 0.1
    use_sigma: bool = False


@dataclass(frozen=True)
class ClockCurve:
    """Correlation of speeds over the clock offset.

    Attributes:
        offsets: (L,) [s].
        correlation: (L,), NaN where too little is common.
        peak: the correlation at the offset that was taken.
    """

    offsets: np.ndarray
    correlation: np.ndarray
    peak: float


@dataclass(frozen=True)
class Alignment:
    """How the recordings lie to each other.

    Attributes:
        clock_offset: time of the reference minus time of the estimate at the same instant [s].
        rotation, translation: (3, 3) and (3,) [m]: x_reference = rotation x_camera + translation.
        clock_given, transform_given: it was not found but given.
        clock_std, rotation_std, translation_std: standard deviations [s, degrees, m], the last at the middle of the
            people; NaN where given. Noise and what single joints err by always are in them, not what all joints of
            all people err by alike.
        residual: median distance of the joints used [m].
        scale: by which the camera's people would have to be stretched to fit; not applied.
        samples: joints in single frames that were used.
        rival: merit of the best other solution, as a share of this one's.
        curve: correlation of speeds, None where the clock was given.
        warnings: what makes the result doubtful.
    """

    clock_offset: float
    rotation: np.ndarray
    translation: np.ndarray
    clock_given: bool
    transform_given: bool
    clock_std: float
    rotation_std: float
    translation_std: float
    residual: float
    scale: float
    samples: int
    rival: float
    curve: Optional[ClockCurve]
    warnings: Tuple[str, ...]

    def apply(self, positions: np.ndarray) -> np.ndarray:
        """Return positions (..., 3) of the camera's frame in the reference's [m]."""
        return np.asarray(positions, np.float64) @ self.rotation.T + self.translation


@dataclass(frozen=True)
class _Solution:
    """A lag [s] between the two beginnings, a transform, and who is who: (R,) subject of each row, -1 nobody."""

    lag: float
    rotation: np.ndarray
    translation: np.ndarray
    merit: float = 0.0
    subjects: Optional[np.ndarray] = None
    std: Tuple[float, float, float] = (np.nan, np.nan, np.nan)
    residual: float = np.nan
    scale: float = np.nan
    samples: int = 0


@dataclass(frozen=True)
class _Observed:
    """The measured joints: times (R,) [s] from the beginning, ids (R,), positions (R, K, 3) [m] with NaN, weights.

    Ids are those that stay with people, see `steady_ids`.
    """

    times: np.ndarray
    ids: np.ndarray
    positions: np.ndarray
    weights: np.ndarray

    def some(self, count: int) -> '_Observed':
        """Return at most `count` rows, taken by chance (the same in each run), in their order."""
        if len(self.times) <= count:
            return self
        return self.rows(np.sort(np.random.RandomState(0).permutation(len(self.times))[:count]))

    def rows(self, rows: np.ndarray) -> '_Observed':
        """Return a part."""
        return _Observed(self.times[rows], self.ids[rows], self.positions[rows], self.weights[rows])


def align(estimate: KeypointTable, reference: JointRecording, params: Optional[AlignmentParams] = None,
          progress: Callable[[Iterable], Iterable] = iter) -> Alignment:
    """Find what is not given of clock offset and transform.

    Args:
        estimate: in space; its MEASURED joints are used.
        reference: at any rate, in any frame.
        progress: wraps the candidates, to show how far the search is.

    Raises:
        BadInputError: the recordings have nothing in common, or nothing by which the clocks could be compared.
    """
    params = params or AlignmentParams()
    observed, joints = _observed(estimate, reference, params.use_sigma)
    begin, begin_reference = estimate.stamps.min() * 1e-9, reference.times[0]
    for name, length in (('poses', observed.times[-1]), ('reference', reference.times[-1] - begin_reference)):
        if length > _LONGEST:
            raise BadInputError(f'the times of the {name} span {length:g} s, expected {_LONGEST:g} s or less; are some '
                                'of them 0?')
    paths = JointPaths(reference.times - begin_reference, reference.positions[:, :, joints],
                       bridged_gap(reference.times, params.max_gap))
    frame_time = _frame_time(observed.times)
    base = begin_reference - begin  # clock offset of lag 0
    tracks = _longest_tracks(observed.ids)
    correlations = None
    if params.clock_offset is None:
        fastest = moving_speed(paths)
        if not fastest >= _LEAST_SPEED:
            raise BadInputError(f'the clock offset can not be found, as people hardly move in the reference: the '
                                f'fastest joints reach {fastest:.2f} m/s, expected {_LEAST_SPEED} or more; give the '
                                'offset (--clock-offset)')
        correlations = correlate_speeds([_track(observed, track) for track in tracks], paths, frame_time)
    if params.clock_offset is not None and params.transform is not None:
        best, rival = _Solution(params.clock_offset - base, params.transform[:3, :3], params.transform[:3, 3]), 0.0
    else:
        solutions = _candidates(observed, paths, params, base, correlations, progress)
        some = observed.some(_REFINING_ROWS)
        solutions = [_refine(some, paths, solution, params, frame_time, _FEW_STEPS) for solution in progress(solutions)]
        best = max(solutions, key=lambda solution: solution.merit)
        rival = max((other.merit for other in solutions if _differs(other, best)), default=0.0) / max(best.merit, 1e-9)
    observed = observed.some(_FINAL_ROWS)
    best = _refine(observed, paths, best, params, frame_time, _MANY_STEPS)
    least = _least_points(params)
    if best.samples < least:
        raise BadInputError(f'estimate and reference share {best.samples} measured joints at the best fit, expected at '
                            f'least {least}; are they of the same scene?')
    curve = None if correlations is None else _curve(correlations, best, observed.ids, tracks, base)
    return Alignment(
        clock_offset=base + best.lag if params.clock_offset is None else params.clock_offset,
        rotation=best.rotation, translation=best.translation, clock_given=params.clock_offset is not None,
        transform_given=params.transform is not None, clock_std=best.std[0], rotation_std=best.std[1],
        translation_std=best.std[2], residual=best.residual, scale=best.scale, samples=best.samples, rival=rival,
        curve=curve, warnings=tuple(_doubts(best, rival, curve, frame_time)))


def _observed(estimate: KeypointTable, reference: JointRecording, use_sigma: bool
              ) -> Tuple[_Observed, np.ndarray]:
    """Return the measured joints that the reference has, and the numbers (K',) of those joints."""
    if not len(estimate) or estimate.dimensions != 3:
        raise BadInputError('the estimate has no people in space' if len(estimate) else 'the estimate has no rows')
    if not len(reference.times) or not len(reference.subjects):
        raise BadInputError('the reference has no people')
    measured = (estimate.status == MEASURED) & np.isfinite(estimate.positions).all(axis=2)
    joints = np.flatnonzero(measured.any(axis=0) & np.isfinite(reference.positions).all(axis=3).any(axis=(0, 1)))
    if len(joints) < 3:
        raise BadInputError(f'estimate and reference have {len(joints)} measured joints in common, expected 3 or more')
    measured = measured[:, joints]
    positions = np.where(measured[..., None], estimate.positions[:, joints].astype(np.float64), np.nan)
    weights = np.ones(measured.shape)
    sigma = estimate.sigma[:, joints].astype(np.float64)
    if use_sigma and (np.isfinite(sigma) & measured).any():
        usual = np.median(sigma[np.isfinite(sigma) & measured])
        sigma = np.where(np.isfinite(sigma), sigma, usual)
        weights = usual ** 2 / np.maximum(sigma, 0.3 * usual) ** 2
    times = (estimate.stamps - estimate.stamps.min()) * 1e-9
    order = np.argsort(times, kind='stable')
    order = order[measured[order].any(axis=1)]
    ids = steady_ids(times[order], estimate.ids[order], positions[order])
    return _Observed(times[order], ids, positions[order], weights[order]), joints


def _least_points(params: AlignmentParams) -> int:
    """Return how many joints are needed; one, where nothing is to be found."""
    return _LEAST_POINTS if params.clock_offset is None or params.transform is None else 1


def _frame_time(times: np.ndarray) -> float:
    steps = np.diff(np.unique(times))
    return float(np.median(steps)) if len(steps) else 1 / 30


def _longest_tracks(ids: np.ndarray) -> np.ndarray:
    """Return the ids (A,) of the longest tracks, by the ids (R,) of all rows."""
    tracks, counts = np.unique(ids, return_counts=True)
    return tracks[np.argsort(-counts, kind='stable')][:_TRACKS]


def _track(observed: _Observed, track: int) -> Tuple[np.ndarray, np.ndarray]:
    """Return times and positions of a track; of an id that is in a frame twice, the first."""
    rows = np.flatnonzero(observed.ids == track)
    times, first = np.unique(observed.times[rows], return_index=True)
    return times, observed.positions[rows[first]]


# ------------------------------------------------------------------------------------------------ candidates

def _candidates(observed: _Observed, paths: JointPaths, params: AlignmentParams, base: float,
                correlations: Optional[Correlations], progress: Callable[[Iterable], Iterable]) -> List[_Solution]:
    """Return the best solutions that single pairs of track and subject suggest, refined in nothing yet."""
    if correlations is None:
        lags = [params.clock_offset - base]
    else:
        lags = _likely_lags(correlations, base, params.max_clock_offset)
    some, found = observed.some(_ROWS), []
    for lag in progress(lags):
        truth = paths.at(some.times + lag)
        if params.transform is not None:
            transforms = [(params.transform[:3, :3], params.transform[:3, 3])]
        else:
            transforms = _pair_transforms(some, truth)
        for rotation, translation in transforms:
            merit = _merit(some, truth, rotation, translation, _COARSE_GATE)
            found.append(_Solution(lag, rotation, translation, merit))
    if not any(solution.merit > 0 for solution in found):
        raise BadInputError('no joints of estimate and reference are seen at the same time'
                            + (' with the clock offset that was given' if correlations is None else ''))
    found.sort(key=lambda solution: -solution.merit)
    best: List[_Solution] = []
    for solution in found:
        if len(best) < _REFINED and all(_differs(solution, other) for other in best):
            best.append(solution)
    return best


def _likely_lags(correlations: Correlations, base: float, most: Optional[float]) -> List[float]:
    """Return the lags [s] for which speeds speak most.

    Raises:
        BadInputError: there are none.
    """
    # each track is whom it resembles most
    evidence = correlations.evidence().max(axis=1).sum(axis=0)
    if most is not None:
        evidence = np.where(np.abs(base + correlations.lags) <= most, evidence, 0)
    lags: List[float] = []
    evidence = evidence.copy()
    while len(lags) < _LAGS and evidence.max() > 0:
        lags.append(float(correlations.lags[evidence.argmax()]))
        evidence[np.abs(correlations.lags - lags[-1]) < _LAG_DISTANCE] = 0
    if not lags:
        within = '' if most is None else f' within the clock offset of {most:g} s'
        raise BadInputError(f'the speeds of the joints of estimate and reference have nothing in common{within}: does '
                            'anybody move? If the clocks are known, give their offset (--clock-offset)')
    return lags


def _pair_transforms(observed: _Observed, truth: np.ndarray) -> List[Tuple[np.ndarray, np.ndarray]]:
    """Return the transforms by which single tracks lie on single subjects, those that fit best and most joints first.

    Args:
        truth: (S, R, K, 3) at the times of the rows.
    """
    pairs = []
    for track, subject in itertools.product(_longest_tracks(observed.ids), range(len(truth))):
        rows = observed.ids == track
        both = np.isfinite(observed.positions[rows]).all(axis=2) & np.isfinite(truth[subject, rows]).all(axis=2)
        if both.sum() >= _LEAST_POINTS:
            rotation, translation, distance = _robust_transform(
                observed.positions[rows][both], truth[subject, rows][both])
            pairs.append((distance / np.sqrt(both.sum()), rotation, translation))
    pairs.sort(key=lambda pair: pair[0])
    return [(rotation, translation) for _, rotation, translation in pairs[:_PAIRS]]


def _robust_transform(points: np.ndarray, truth: np.ndarray) -> Tuple[np.ndarray, np.ndarray, float]:
    """Return rotation and translation of (N, 3) points onto the truth, and the median distance that is left [m]."""
    weights = np.ones(len(points))
    for _ in range(10):
        rotation, translation = rigid_transform(points, truth, weights)
        distances = np.linalg.norm(truth - points @ rotation.T - translation, axis=1)
        weights = _robust_weights(distances)
    return rotation, translation, float(np.median(distances))


def rigid_transform(points: np.ndarray, truth: np.ndarray, weights: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the rotation (3, 3) and translation (3,) that move points onto the truth with least squared distances.

    Kabsch, Acta Crystallographica A32, 922 (1976); no mirror image, as in Umeyama, PAMI 13, 376 (1991).

    Args:
        points, truth: (N, 3) [m].
        weights: (N,) not negative.
    """
    share = weights / weights.sum()
    middle, middle_truth = share @ points, share @ truth
    u, _, vt = np.linalg.svd(((truth - middle_truth) * share[:, None]).T @ (points - middle))
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return rotation, middle_truth - rotation @ middle


def _robust_weights(distances: np.ndarray) -> np.ndarray:
    """Return weights of Geman and McClure, scaled by the median distance."""
    scale = _TUNING * max(float(np.median(distances)), _SMALLEST_SCALE)
    return 1 / (1 + (distances / scale) ** 2) ** 2


def _merit(observed: _Observed, truth: np.ndarray, rotation: np.ndarray, translation: np.ndarray, gate: float) -> float:
    """Return how many joints meet somebody, those that meet exactly counted as 1, those `gate` apart as 0."""
    distances = _distances(observed.positions @ rotation.T + translation, truth)
    return float(np.nansum(np.maximum(0, 1 - (distances / gate) ** 2), axis=2).max(axis=0).sum())


def _distances(positions: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return distances (S, R, K) of (R, K, 3) from (S, R, K, 3), NaN where one is missing."""
    return np.linalg.norm(truth - positions, axis=3)


def _differs(one: _Solution, other: _Solution) -> bool:
    angle = np.degrees(np.arccos(np.clip((np.trace(one.rotation.T @ other.rotation) - 1) / 2, -1, 1)))
    return abs(one.lag - other.lag) > _RIVAL_LAG or angle > _RIVAL_ANGLE


# ------------------------------------------------------------------------------------------------ refinement

def _refine(observed: _Observed, paths: JointPaths, start: _Solution, params: AlignmentParams, frame_time: float,
            steps: int) -> _Solution:
    """Improve lag and transform together until nothing changes; what is given stays."""
    free = np.r_[np.full(6, params.transform is None), params.clock_offset is None]
    lag, rotation, translation = start.lag, start.rotation, start.translation
    half = max(frame_time / 2, 0.02)
    subjects = np.full(len(observed.times), -1)
    for step in range(steps):
        truth = paths.at(observed.times + lag)
        moved = observed.positions @ rotation.T + translation
        subjects = _who(_distances(moved, truth))
        rows = np.flatnonzero(subjects >= 0)
        residual = truth[subjects[rows], rows] - moved[rows]
        velocity = np.zeros_like(residual)
        if params.clock_offset is None:
            velocity = paths.velocity(observed.times[rows] + lag, half)[subjects[rows], np.arange(len(rows))]
        used = np.isfinite(residual).all(axis=2) & np.isfinite(velocity).all(axis=2)
        if used.sum() < _least_points(params):
            return replace(start, merit=0.0, samples=int(used.sum()))
        residual, velocity, points = residual[used], velocity[used], moved[rows][used]
        distances = np.linalg.norm(residual, axis=1)
        weights = _robust_weights(distances) * observed.weights[rows][used]
        middle = weights @ points / weights.sum()
        derivatives = _derivatives(points - middle, velocity)
        inverse = _inverse(derivatives, weights, free)
        change = inverse @ (derivatives.reshape(-1, 7).T @ (weights[:, None] * residual).ravel())
        if abs(change[6]) > _LONGEST_STEP:
            change *= _LONGEST_STEP / abs(change[6])
        turn = cv2.Rodrigues(change[:3])[0]
        rotation, translation = turn @ rotation, turn @ (translation - middle) + middle + change[3:6]
        lag += change[6]
        if step > 2 and np.abs(change).max() < _SETTLED:
            break
    distances = _distances(observed.positions @ rotation.T + translation, paths.at(observed.times + lag))
    groups = (subjects[rows][:, None] * observed.positions.shape[1] + np.arange(observed.positions.shape[1]))[used]
    std = np.where(free, _deviations(derivatives, residual, weights, inverse, groups), np.nan)
    stretched = (weights[:, None] * (points - middle) * (residual - weights @ residual / weights.sum())).sum()
    return _Solution(
        lag, rotation, translation, float(np.nansum(np.maximum(0, 1 - (distances / _FINE_GATE) ** 2), axis=2)
                                          .max(axis=0).sum()),
        subjects, (std[6], float(np.degrees(np.linalg.norm(std[:3]))), float(np.linalg.norm(std[3:6]))),
        float(np.median(np.linalg.norm(residual, axis=1))),
        1 + stretched / (weights[:, None] * (points - middle) ** 2).sum(), len(points))


def _who(distances: np.ndarray) -> np.ndarray:
    """Return whom each row (R,) is, -1 nobody, by distances (S, R, K)."""
    known = np.isfinite(distances)
    with np.errstate(invalid='ignore'):
        near = np.where(known.any(axis=2), np.nanmedian(np.where(known.any(axis=2)[..., None], distances, np.inf),
                                                        axis=2), np.inf)
    who = near.argmin(axis=0)
    return np.where(near.min(axis=0) < _PERSON_GATE, who, -1)


def _derivatives(points: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return the matrices (N, 3, 7) by which rotation vector, translation and lag take away the residual.

    residual = rotation x points + translation - velocity lag.

    Args:
        points, velocity: (N, 3), points from the middle of the rotation [m, m/s].
    """
    rows = np.zeros((len(points), 3, 7))
    x, y, z = points.T
    rows[:, 0, 1], rows[:, 0, 2] = z, -y
    rows[:, 1, 0], rows[:, 1, 2] = -z, x
    rows[:, 2, 0], rows[:, 2, 1] = y, -x
    rows[:, :, 3:6] = np.eye(3)
    rows[:, :, 6] = -velocity
    return rows


def _inverse(rows: np.ndarray, weights: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the inverse (7, 7) of the normal equations; what is not free is zero."""
    inverse = np.zeros((7, 7))
    flat = rows[:, :, free].reshape(3 * len(rows), free.sum())
    normal = flat.T @ (np.repeat(weights, 3)[:, None] * flat)
    # where nothing moves the lag stays: a pseudo-inverse takes the smallest change
    inverse[np.ix_(free, free)] = np.linalg.pinv(normal, rcond=1e-9)
    return inverse


def _deviations(rows: np.ndarray, residual: np.ndarray, weights: np.ndarray, inverse: np.ndarray, groups: np.ndarray
                ) -> np.ndarray:
    """Return standard deviations (7,) with samples of one group depending on each other.

    The "sandwich" of Liang and Zeger, Biometrika 73, 13 (1986): a group is a joint of a person, so that what the joint
    errs by always counts once and not once per frame. Where few groups give too small a value, that of independent
    samples is taken.
    """
    variance = (weights * (residual ** 2).mean(axis=1)).sum() / weights.sum()
    pulls = np.zeros((groups.max() + 1, 7))
    np.add.at(pulls, groups, weights[:, None] * np.einsum('nij,ni->nj', rows, residual))
    count = len(np.unique(groups))
    grouped = np.diag(inverse @ (pulls.T @ pulls) @ inverse) * count / max(count - 1, 1)
    return np.sqrt(np.maximum(np.maximum(grouped, variance * np.diag(inverse)), 0))


# ------------------------------------------------------------------------------------------------ trust

def _curve(correlations: Correlations, best: _Solution, ids: np.ndarray, tracks: np.ndarray, base: float
           ) -> ClockCurve:
    """Return the correlation over the offset for the tracks and the subjects that they turned out to be.

    Args:
        ids: (R,) of the rows of the solution.
        tracks: (A,) ids of the tracks that were correlated.
    """
    pairs: Dict[int, int] = {}
    for number, track in enumerate(tracks):
        subjects = best.subjects[(ids == track) & (best.subjects >= 0)]
        if len(subjects):
            pairs[number] = int(np.bincount(subjects).argmax())
    correlation = correlations.correlation(list(pairs.items()))
    near = np.abs(correlations.lags - best.lag) <= correlations.step
    peak = np.nanmax(np.append(correlation[near], -1))
    return ClockCurve(base + correlations.lags, correlation, float(peak))


def _doubts(best: _Solution, rival: float, curve: Optional[ClockCurve], frame_time: float) -> List[str]:
    """Return what makes the result doubtful.

    Raises:
        BadInputError: it is not even doubtful.
    """
    doubts = []
    if curve is not None and best.residual > _LARGE_RESIDUAL and curve.peak < _SAFE_CORRELATION:
        raise BadInputError(
            f'no clock offset and transform make poses and reference agree: at the best ones half of the joints are '
            f'more than {1e3 * best.residual:.0f} mm off, and their speeds correlate by {curve.peak:.2f}; are they of '
            'the same scene, and are markers mapped to the right joints?')
    if curve is not None and (curve.peak < _LEAST_CORRELATION or not best.std[0] < frame_time):
        raise BadInputError(
            f'the clock offset can not be found: the speeds of the joints correlate by {curve.peak:.2f} '
            f'(expected {_LEAST_CORRELATION} or more), and the offset is uncertain by {1e3 * best.std[0]:.0f} ms (a '
            f'frame takes {1e3 * frame_time:.0f} ms); people must move. If the clocks are known, give their offset '
            '(--clock-offset)')
    if curve is not None and best.std[0] > _UNCERTAIN_FRAMES * frame_time:
        doubts.append(f'the clock offset is uncertain by {1e3 * best.std[0]:.0f} ms, as people move little (a frame '
                      f'takes {1e3 * frame_time:.0f} ms)')
    if rival > _RIVAL:
        doubts.append(f'another offset or transform fits {100 * rival:.0f} % as well; check the pictures, or give '
                      '--clock-offset or --transform')
    if best.residual > _LARGE_RESIDUAL:
        doubts.append(f'half of the joints are more than {1e3 * best.residual:.0f} mm off after the alignment; is it '
                      'the same scene, and are markers mapped to the right joints?')
    return doubts
