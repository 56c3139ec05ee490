"""Find the clock offset and the rigid transform between two recordings of the same people, without a prior.

The estimate is of a camera; the reference is of motion capture, or of another camera.

1. The speeds of joints, which no rotation changes, are correlated for all lags (`clock`): candidates for the lag.
2. For each, a few pairs of track and subject give a transform each (Kabsch, robust); the one by which most joints of
   all people meet wins, so that no people need to be matched by hand (`candidates`).
3. Lag and transform are refined together, by robust least squares on the joints that were measured (`refinement`).

A constant offset of a joint from that of the reference, as of a detector's hip, can not be told from a shift of the
camera unless people turn; with many joints and people that turn it cancels. A constant delay of the
estimate is a part of the clock offset.
"""
from dataclasses import dataclass
from typing import Any, List, Optional, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.alignment.candidates import Observed, Solution, find_candidates, least_points, likely_lags
from openpose_ros_tools.alignment.clock import MAX_GAP, Correlations, JointPaths, correlate_speeds, moving_speed
from openpose_ros_tools.alignment.refinement import Refined, refine
from skeleton_extract_3d.points.transform import Transform

# Rows by which candidates are refined, and then the best one; steps of each.
_REFINING_ROWS, _FINAL_ROWS, _REFINING_STEPS, _FINAL_STEPS = 3000, 20000, 8, 40
# The fastest joints must reach this, or the clock can not be found [m/s]: standing people sway by less.
_LEAST_SPEED = 0.1
# Recordings are not longer [s]; a stamp of 0 among those that count from 1970 is a mistake.
_LONGEST = 86400.0
# Below this correlation of speeds the clock is not taken as found; with large residuals it must be higher.
_LEAST_CORRELATION, _SAFE_CORRELATION = 0.2, 0.5
# Another solution of this share of the merit makes the result doubtful.
_RIVAL = 0.9
# Residuals above make the result doubtful [m], as an uncertain clock does, in frames.
_LARGE_RESIDUAL, _UNCERTAIN_FRAMES = 0.1, 0.25


@dataclass(frozen=True)
class AlignmentParams:
    """What is given, and how far is searched."""

    clock_offset: Optional[float] = None  # time of the reference minus that of the estimate [s]; None: to be found
    transform: Optional[Transform] = None  # from the camera's frame to the reference's; None: to be found
    max_clock_offset: Optional[float] = None  # that is searched, either way [s]; None: any
    use_sigma: bool = False  # weigh joints by 1 / sigma^2, as far as the estimate tells sigma
    clock_option: str = '--clock-offset'  # of the program, by which the user tells the clocks: for errors


@dataclass(frozen=True)
class Alignment(Refined):
    """How the recordings lie to each other; standard deviations are NaN where a value was given.

    Standard deviations hold noise and what single joints err by always, not what all joints of all people err by alike.
    """

    clock_offset: float = np.nan  # time of the reference minus time of the estimate at the same instant [s]
    clock_given: bool = False  # not found
    transform_given: bool = False
    rival: float = 0.0  # merit of the best other solution, as a share of this one's
    speed_correlation: Optional[float] = None  # of the joints' speeds at the clock offset, None where that was given
    warnings: Tuple[str, ...] = ()  # what makes the result doubtful


def align(estimate: Any, reference: Any, params: AlignmentParams = AlignmentParams()) -> Alignment:
    """Find what is not given of clock offset and transform.

    Args:
        estimate: what a camera measured, in any order: `stamps`, `ids`, `positions` and `sigma` as of `KeypointTable`.
        reference: at any rate, in any frame: `times`, (T,) [s], increasing, and `positions`, (S, T, K, 3) [m] of the
            joints of the estimate; NaN where missing.

    Raises:
        BadInputError: the recordings have nothing in common, or nothing by which the clocks could be compared.
    """
    observed, joints = _observed(estimate, reference, params.use_sigma)
    paths = JointPaths(reference.times - reference.times[0], reference.positions[:, :, joints], MAX_GAP)
    base = reference.times[0] - estimate.stamps.min() * 1e-9  # clock offset of lag 0
    free = np.r_[np.full(6, params.transform is None), params.clock_offset is None]
    tracks = observed.longest_tracks()
    if params.clock_offset is None:
        fastest = moving_speed(paths)
        if not fastest >= _LEAST_SPEED:
            raise BadInputError(
                f'the clock offset can not be found, as people hardly move in the reference: the fastest joints reach '
                f'{fastest:.2f} m/s, expected {_LEAST_SPEED} or more; if the clocks are known, say so '
                f'({params.clock_option})')
        correlations = correlate_speeds([observed.track(track) for track in tracks], paths, observed.frame_time)
        lags = likely_lags(correlations, base, params.max_clock_offset, params.clock_option)
    else:
        correlations, lags = None, [params.clock_offset - base]
    if params.clock_offset is None or params.transform is None:
        candidates = find_candidates(observed, paths, lags, params.transform)
    else:
        candidates = [Solution(lags[0], *params.transform)]
    if not candidates:
        raise BadInputError('no joints of estimate and reference are seen at the same time'
                            + ' with the clock offset that was given' * (correlations is None))
    some = observed.some(_REFINING_ROWS)
    solutions = [refine(some, paths, one, free, _REFINING_STEPS) for one in candidates]
    best = max(solutions, key=lambda solution: solution.merit)
    rival = max((one.merit for one in solutions if one.differs(best)), default=0.0) / max(best.merit, 1e-9)
    observed = observed.some(_FINAL_ROWS)
    best = refine(observed, paths, best, free, _FINAL_STEPS)
    if best.samples < least_points(free):
        raise BadInputError(f'estimate and reference share {best.samples} measured joints at the best fit, expected at '
                            f'least {least_points(free)}; are they of the same scene?')
    correlation = None if correlations is None else _speed_correlation(correlations, best, observed.ids, tracks)
    return Alignment(
        **vars(best), clock_offset=base + best.lag if params.clock_offset is None else params.clock_offset,
        clock_given=not free[6], transform_given=not free[0], rival=rival, speed_correlation=correlation,
        warnings=tuple(_doubts(best, rival, correlation, observed.frame_time, params.clock_option)))


def _observed(estimate: Any, reference: Any, use_sigma: bool) -> Tuple[Observed, np.ndarray]:
    """Return the measured joints that the reference has, and the numbers (K',) of those joints."""
    if not len(estimate.stamps):
        raise BadInputError('the estimate has no rows')
    if not len(reference.times) or not len(reference.positions):
        raise BadInputError('the reference has no people')
    measured = np.isfinite(estimate.positions).all(axis=2)
    joints = np.flatnonzero(measured.any(axis=0) & np.isfinite(reference.positions).all(axis=3).any(axis=(0, 1)))
    if len(joints) < 3:
        raise BadInputError(f'estimate and reference have {len(joints)} measured joints in common, expected 3 or more')
    measured = measured[:, joints]
    positions = np.where(measured[..., None], estimate.positions[:, joints].astype(np.float64), np.nan)
    weights = np.ones(measured.shape)
    sigma = estimate.sigma[:, joints].astype(np.float64)
    if use_sigma and (np.isfinite(sigma) & measured).any():
        usual = np.median(sigma[np.isfinite(sigma) & measured])
        weights = usual ** 2 / np.maximum(np.where(np.isfinite(sigma), sigma, usual), 0.3 * usual) ** 2
    times = (estimate.stamps - estimate.stamps.min()) * 1e-9
    order = np.argsort(times, kind='stable')
    order = order[measured[order].any(axis=1)]
    for name, length in (('poses', times[order[-1]]), ('reference', reference.times[-1] - reference.times[0])):
        if length > _LONGEST:
            raise BadInputError(f'the times of the {name} span {length:g} s, expected {_LONGEST:g} s or less; are some '
                                'of them 0?')
    steps = np.diff(np.unique(times[order]))
    return Observed(times[order], estimate.ids[order], positions[order], weights[order],
                    float(np.median(steps)) if len(steps) else 1 / 30), joints


def _speed_correlation(correlations: Correlations, best: Refined, ids: np.ndarray, tracks: np.ndarray) -> float:
    """Return the correlation at the best lag of the tracks with the subjects that they turned out to be."""
    pairs: List[Tuple[int, int]] = []
    for number, track in enumerate(tracks):
        subjects = best.subjects[(ids == track) & (best.subjects >= 0)]
        if len(subjects):
            pairs.append((number, int(np.bincount(subjects).argmax())))
    correlation = correlations.correlation(pairs)
    near = np.abs(correlations.lags - best.lag) <= correlations.step
    return float(np.nanmax(np.append(correlation[near], -1)))


def _doubts(best: Refined, rival: float, correlation: Optional[float], frame_time: float, option: str) -> List[str]:
    """Return what makes the result doubtful; BadInputError: it is not even that."""
    doubts = []
    if correlation is not None and best.residual > _LARGE_RESIDUAL and correlation < _SAFE_CORRELATION:
        raise BadInputError(
            f'no clock offset and transform make poses and reference agree: at the best ones half of the joints are '
            f'more than {1e3 * best.residual:.0f} mm off, and their speeds correlate by {correlation:.2f}; are they of '
            'the same scene, and are markers mapped to the right joints?')
    if correlation is not None and (correlation < _LEAST_CORRELATION or not best.std[0] < frame_time):
        raise BadInputError(
            f'the clock offset can not be found: the speeds of the joints correlate by {correlation:.2f} '
            f'(expected {_LEAST_CORRELATION} or more), and the offset is uncertain by {1e3 * best.std[0]:.0f} ms (a '
            f'frame takes {1e3 * frame_time:.0f} ms); people must move. If the clocks are known, say so '
            f'({option})')
    if correlation is not None and best.std[0] > _UNCERTAIN_FRAMES * frame_time:
        doubts.append(f'the clock offset is uncertain by {1e3 * best.std[0]:.0f} ms, as people move little (a frame '
                      f'takes {1e3 * frame_time:.0f} ms)')
    if rival > _RIVAL:
        doubts.append(f'another offset or transform fits {100 * rival:.0f} % as well; check the plots, or give '
                      f'{option} or --transform')
    if best.residual > _LARGE_RESIDUAL:
        doubts.append(f'half of the joints are more than {1e3 * best.residual:.0f} mm off after the alignment; is it '
                      'the same scene, and are markers mapped to the right joints?')
    return doubts
