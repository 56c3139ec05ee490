"""When two recordings of the same people were made: interpolation in time, and correlation of the joints' speeds.

The speed of a joint is the same in every frame of reference, so it tells the offset between two clocks before anything
is known of where the camera stood.
"""
from dataclasses import dataclass
from typing import List, Tuple

import numpy as np
from numpy.fft import irfft, rfft
from scipy.fftpack import next_fast_len

from openpose_ros_pkg.errors import BadInputError

# Speeds are means over this time [s]: 15 mm of noise are then 0.1 m/s, and swinging arms are still resolved.
_SPEED_WINDOW = 0.2
# Speeds above are jumps of a detector, not people [m/s].
_FASTEST = 4.0
# Variation of a speed that tells nothing, as a resting joint has by sway and noise [m/s].
_SPEED_FLOOR = 0.05
# Two samples follow each other if they are at most this many times the usual step apart.
_ONE_STEP = 1.5
# Longest gap in a track that is bridged [s], and in a reference.
_BRIDGED, MAX_GAP = 0.25, 0.1
# Grid steps per frame of the camera, and the finest grid [s].
_STEPS_PER_FRAME, _FINEST_STEP = 2, 1 / 60
# Shortest time that two speeds have in common, over all their joints [s].
_LEAST_COMMON = 1.0
# People move most in a stretch of this length [s]: they may stand still in most of a long recording. Of the joints and
# times of a stretch, sampled in steps [s], this share reaches its speed.
_STRETCH, _MOVING_STEP, _MOVING_SHARE = 2.0, 0.05, 0.03
# Times that differ by less are the same [s]: floats of clocks that count from 1970 have steps of 0.2 us.
SAME_TIME = 2e-6


class JointPaths:
    """Where joints are at any time, by straight lines between samples that are not far apart.

    Args:
        times: (T,) float64 [s], increasing.
        positions: (S, T, K, 3) of S people [m], NaN where missing.
        max_gap: between two samples of a joint that may be bridged [s]; more where usual samples are further apart.

    Raises:
        BadInputError: the times do not increase.
    """

    def __init__(self, times: np.ndarray, positions: np.ndarray, max_gap: float) -> None:
        self.times = np.asarray(times, np.float64)
        if np.any(np.diff(self.times) <= 0):
            raise BadInputError('the times of the reference do not increase from sample to sample')
        steps = np.diff(self.times)
        self._max_gap = max(max_gap, _ONE_STEP * float(np.median(steps))) if len(steps) else max_gap
        self._positions = np.array(positions, np.float64)
        for person in self._positions:
            for joint in range(person.shape[1]):
                self._bridge(person[:, joint])

    def _bridge(self, path: np.ndarray) -> None:
        """Fill the short gaps of one joint, (T, 3), in place."""
        known = np.isfinite(path).all(axis=1)
        path[~known] = np.nan
        if known.all() or not known.any():
            return
        at, missing = self.times[known], np.flatnonzero(~known)
        after = np.searchsorted(at, self.times[missing])
        inner = (after > 0) & (after < len(at))
        missing, after = missing[inner], after[inner]
        short = at[after] - at[after - 1] <= self._max_gap
        for axis in range(3):
            path[missing[short], axis] = np.interp(self.times[missing[short]], at, path[known, axis])

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the positions (S, N, K, 3) at N times [s]; NaN before, after, and in long gaps."""
        times = np.asarray(times, np.float64)
        if len(self.times) == 1:
            same = np.abs(times - self.times[0]) < SAME_TIME
            return np.where(same[None, :, None, None], self._positions, np.nan)
        right = np.clip(np.searchsorted(self.times, times), 1, len(self.times) - 1)
        start, end = self.times[right - 1], self.times[right]
        left_only, right_only = np.abs(times - start) < SAME_TIME, np.abs(times - end) < SAME_TIME
        inside = (times > start) & (times < end) & (end - start <= self._max_gap)
        part = ((times - start) / (end - start))[None, :, None, None]
        before, after = self._positions[:, right - 1], self._positions[:, right]
        between = before + part * (after - before)
        between = np.where(left_only[None, :, None, None], before, between)  # a neighbour without a position: no harm
        between = np.where(right_only[None, :, None, None], after, between)
        between[:, ~(inside | left_only | right_only)] = np.nan
        return between

    def velocity(self, times: np.ndarray, half: float) -> np.ndarray:
        """Return mean velocities (S, N, K, 3) [m/s] over `half` seconds to both sides; NaN as in `at`."""
        return (self.at(times + half) - self.at(times - half)) / (2 * half)


@dataclass(frozen=True)
class Correlations:
    """How well the speeds of each of A tracks and S subjects agree, for each lag; sums over joints and common samples.
    """

    lags: np.ndarray  # (L,) [s]: the time of the reference minus that of the estimate, both from their own beginning
    covariance: np.ndarray  # (A, S, L) [m2/s2], as the next two
    track_variance: np.ndarray
    subject_variance: np.ndarray
    common: np.ndarray  # (A, S, L) samples in common
    step: float  # of the grid [s]

    def correlation(self, pairs: List[Tuple[int, int]]) -> np.ndarray:
        """Return the correlation (L,) of some tracks with their subjects together, NaN where too little is common."""
        tracks, subjects = np.array(pairs, int).reshape(-1, 2).T
        covariance, of_tracks, of_subjects, common = (
            values[tracks, subjects].sum(axis=0) for values in
            (self.covariance, self.track_variance, self.subject_variance, self.common))
        return np.where(common * self.step >= _LEAST_COMMON,
                        _correlated(covariance, of_tracks, of_subjects, common), np.nan)

    def evidence(self) -> np.ndarray:
        """Return (A, S, L) how much likelier speeds are that follow each other than independent ones, as a logarithm.

        Unlike a correlation, it does not favour lags with little in common. Samples of one window count as one.
        """
        correlation = _correlated(self.covariance, self.track_variance, self.subject_variance, self.common)
        with np.errstate(invalid='ignore', divide='ignore'):
            evidence = -0.5 * self.common * (self.step / _SPEED_WINDOW) * np.log1p(-np.clip(correlation, 0, 0.999) ** 2)
        return np.where(self.common * self.step >= _LEAST_COMMON, np.nan_to_num(evidence), 0)


def correlate_speeds(tracks: List[Tuple[np.ndarray, np.ndarray]], reference: JointPaths, frame_time: float
                     ) -> Correlations:
    """Correlate the speeds of each track with those of each subject, for all lags at which they have time in common.

    Args:
        tracks: A of (times (N,) [s], positions (N, K, 3) [m], NaN where not measured).
        reference: of S subjects.
        frame_time: between two frames of the tracks [s].
    """
    step = max(frame_time / _STEPS_PER_FRAME, _FINEST_STEP)
    begin = min(times[0] for times, _ in tracks)
    length = int((max(times[-1] for times, _ in tracks) - begin) / step) + 1
    reference_begin = reference.times[0]
    reference_length = int((reference.times[-1] - reference_begin) / step) + 1
    size = next_fast_len(length + reference_length)
    # lag index l: sample i of the estimate beside sample i + l of the reference
    order = np.arange(-(length - 1), reference_length)
    subjects = [_spectra(speeds, size) for speeds in _speeds(
        reference, reference_begin + step * np.arange(reference_length))]
    covariance, of_track, of_subject, common = np.zeros((4, len(tracks), len(subjects), len(order)))
    for a, (times, positions) in enumerate(tracks):
        paths = JointPaths(times, _without_jumps(positions)[None], max(_BRIDGED, 2.5 * frame_time))
        ours = _spectra(_speeds(paths, begin + step * np.arange(length))[0], size)
        for s, theirs in enumerate(subjects):
            sums = [irfft(np.conj(ours[i]) * theirs[j], size, axis=-1)[:, order]
                    for i, j in ((0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 1))]
            count = np.rint(sums[0])
            few = count < 3
            safe = np.where(few, 1, count)
            mine, their, mine2, their2, both = (np.where(few, 0, value) for value in sums[1:])
            covariance[a, s] = (both - mine * their / safe).sum(axis=0)
            of_track[a, s] = np.maximum(mine2 - mine ** 2 / safe, 0).sum(axis=0)
            of_subject[a, s] = np.maximum(their2 - their ** 2 / safe, 0).sum(axis=0)
            common[a, s] = np.where(few, 0, count).sum(axis=0)
    return Correlations(order * step + reference_begin - begin, covariance, of_track, of_subject, common, step)


def moving_speed(paths: JointPaths) -> float:
    """Return the speed that the fastest joints reach while people move most [m/s]; NaN if unknown."""
    speeds = _speeds(paths, np.arange(paths.times[0], paths.times[-1], _MOVING_STEP))
    count = int(_STRETCH / _MOVING_STEP)
    parts = [speeds[..., first:first + count] for first in range(0, speeds.shape[-1], count)]
    fastest = [np.percentile(part[np.isfinite(part)], 100 * (1 - _MOVING_SHARE)) for part in parts
               if np.isfinite(part).mean() > _MOVING_SHARE]
    return float(max(fastest)) if fastest else float('nan')


def _correlated(covariance: np.ndarray, of_track: np.ndarray, of_subject: np.ndarray, common: np.ndarray) -> np.ndarray:
    floor = _SPEED_FLOOR ** 2 * common
    with np.errstate(invalid='ignore', divide='ignore'):
        correlation: np.ndarray = covariance / np.sqrt((of_track + floor) * (of_subject + floor))
    return correlation


def _without_jumps(positions: np.ndarray) -> np.ndarray:
    """Return the medians of three samples in a row of (N, K, 3): a joint mislaid in a single frame is no movement."""
    if len(positions) < 3:
        return positions
    calm = positions.copy()
    calm[1:-1] = np.median(np.stack([positions[:-2], positions[1:-1], positions[2:]]), axis=0)
    return np.where(np.isnan(calm), positions, calm)


def _speeds(paths: JointPaths, times: np.ndarray) -> np.ndarray:
    """Return mean speeds (S, K, N) [m/s], NaN where unknown."""
    speed = np.linalg.norm(paths.velocity(times, _SPEED_WINDOW / 2), axis=3)
    return np.minimum(speed, _FASTEST).transpose(0, 2, 1)


def _spectra(speeds: np.ndarray, size: int) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the spectra of mask, speed and squared speed of (K, N) speeds."""
    known = np.isfinite(speeds)
    # the mean of each joint taken off, so that large sums do not hide small differences
    mean = np.where(known, speeds, 0).sum(axis=1, keepdims=True) / np.maximum(known.sum(axis=1, keepdims=True), 1)
    value = np.where(known, speeds - mean, 0)
    return rfft(known.astype(float), size), rfft(value, size), rfft(value ** 2, size)
