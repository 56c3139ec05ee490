"""Candidates for lag and transform between two recordings, before any people are matched: most joints meet."""
import itertools
from dataclasses import dataclass
from typing import List, Optional, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.alignment.clock import Correlations, JointPaths
from skeleton_extract_3d.points.transform import Transform

_LEAST_POINTS = 30  # joints that a track must have in common with a subject, for a transform to be found
_TUNING = 3.0  # a robust weight falls to 1/4 at this multiple of the median distance (Geman and McClure)
_SMALLEST_SCALE = 0.005  # [m] distances are compared with this, where their median is smaller
_LAGS = 12  # lags that are tried
_LAG_DISTANCE = 0.3  # [s] between two of them
_PAIRS = 6  # pairs of track and subject whose transforms are tried, for each lag
_CANDIDATES = 6  # candidates that are returned
_TRACKS = 12  # tracks that are correlated, the longest
_ROWS = 1200  # rows by which candidates are judged
_GATE = 0.25  # [m] joints that meet within this count
_OTHER_LAG = 0.1  # [s] solutions whose lags differ by more are two
_OTHER_ANGLE = 10.0  # [degrees] as are those whose rotations do


@dataclass(frozen=True)
class Observed:
    """The measured joints, in the order of time."""

    times: np.ndarray  # (R,) [s] from the beginning
    ids: np.ndarray  # (R,) of tracks
    positions: np.ndarray  # (R, K, 3) [m], NaN where not measured
    weights: np.ndarray  # (R, K)
    frame_time: float  # usual between two frames [s]

    def some(self, count: int) -> 'Observed':
        """Return at most `count` rows, taken by chance (the same in each run), in their order."""
        if len(self.times) <= count:
            return self
        rows = np.sort(np.random.RandomState(0).permutation(len(self.times))[:count])
        return Observed(self.times[rows], self.ids[rows], self.positions[rows], self.weights[rows], self.frame_time)

    def longest_tracks(self) -> np.ndarray:
        """Return the ids (A,) of the longest tracks."""
        tracks, counts = np.unique(self.ids, return_counts=True)
        return tracks[np.argsort(-counts, kind='stable')][:_TRACKS]

    def track(self, track: int) -> Tuple[np.ndarray, np.ndarray]:
        """Return times and positions of a track; of an id that is in a frame twice, the first."""
        rows = np.flatnonzero(self.ids == track)
        times, first = np.unique(self.times[rows], return_index=True)
        return times, self.positions[rows[first]]


@dataclass(frozen=True)
class Solution:
    """A lag between the two beginnings, and a transform: x_reference = rotation x_camera + translation."""

    lag: float  # [s]
    rotation: np.ndarray
    translation: np.ndarray  # [m]
    merit: float = 0.0  # how many joints meet one of the reference, those that meet exactly counted as 1

    def apply(self, positions: np.ndarray) -> np.ndarray:
        """Return positions (..., 3) of the camera's frame in the reference's [m]."""
        return positions @ self.rotation.T + self.translation

    def differs(self, other: 'Solution') -> bool:
        """Say whether another one is not the same, but for small errors."""
        cosine = (np.trace(self.rotation.T @ other.rotation) - 1) / 2
        return bool(abs(self.lag - other.lag) > _OTHER_LAG
                    or np.degrees(np.arccos(np.clip(cosine, -1, 1))) > _OTHER_ANGLE)


def find_candidates(observed: Observed, paths: JointPaths, lags: List[float],
                    transform: Optional[Transform]) -> List[Solution]:
    """Return the best solutions that pairs of track and subject suggest, for lags [s]; transform: if it is known."""
    some = observed.some(_ROWS)
    found: List[Solution] = []
    for lag in lags:
        truth = paths.at(some.times + lag)
        transforms = _pair_transforms(some, truth) if transform is None else [transform]
        for rotation, translation in transforms:
            distances = np.linalg.norm(truth - some.positions @ rotation.T - translation, axis=3)
            found.append(Solution(lag, rotation, translation, merit(distances, _GATE)))
    best: List[Solution] = []
    for solution in sorted(found, key=lambda solution: -solution.merit):
        if solution.merit > 0 and len(best) < _CANDIDATES and all(solution.differs(other) for other in best):
            best.append(solution)
    return best


def likely_lags(correlations: Correlations, base: float, most: Optional[float], option: str) -> List[float]:
    """Return the lags [s] for which speeds speak most; BadInputError, if there are none.

    Args:
        base: clock offset of lag 0 [s].
        most: largest clock offset, either way [s]; None: any.
        option: by which the user tells the clocks, for the error.
    """
    # each track is the subject that it resembles most
    evidence = correlations.evidence().max(axis=1).sum(axis=0)
    if most is not None:
        evidence = np.where(np.abs(base + correlations.lags) <= most, evidence, 0)
    lags: List[float] = []
    while len(lags) < _LAGS and evidence.max() > 0:
        lags.append(float(correlations.lags[evidence.argmax()]))
        evidence = np.where(np.abs(correlations.lags - lags[-1]) < _LAG_DISTANCE, 0, evidence)
    if not lags:
        within = '' if most is None else f' within the clock offset of {most:g} s'
        raise BadInputError(f'the speeds of the joints of estimate and reference have nothing in common{within}: does '
                            f'a person move? If the clocks are known, say so ({option})')
    return lags


def least_points(free: np.ndarray) -> int:
    """Return how many joints are needed to find what is free of the solution; one, where nothing is."""
    return _LEAST_POINTS if free.any() else 1


def merit(distances: np.ndarray, gate: float) -> float:
    """Return how many joints meet a subject by distances (S, R, K) [m]: 1 where they are 0, 0 from the gate [m] on."""
    return float(np.nansum(np.maximum(0, 1 - (distances / gate) ** 2), axis=2).max(axis=0).sum())


def rigid_transform(points: np.ndarray, truth: np.ndarray, weights: np.ndarray) -> Transform:
    """Return rotation (3, 3) and translation (3,) of points (N, 3) onto the truth by least weighted squares.

    Kabsch, Acta Crystallographica A32, 922 (1976); no mirror image, as in Umeyama, PAMI 13, 376 (1991). SciPy has it
    from 1.4 on.
    """
    share = weights / weights.sum()
    middle, middle_truth = share @ points, share @ truth
    u, _, vt = np.linalg.svd(((truth - middle_truth) * share[:, None]).T @ (points - middle))
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return rotation, middle_truth - rotation @ middle


def robust_weights(distances: np.ndarray) -> np.ndarray:
    """Return weights of Geman and McClure, scaled by the median distance."""
    scale = _TUNING * max(float(np.median(distances)), _SMALLEST_SCALE)
    return 1 / (1 + (distances / scale) ** 2) ** 2


def _pair_transforms(observed: Observed, truth: np.ndarray) -> List[Transform]:
    """Return the transforms of single tracks onto single subjects (S, R, K, 3), of the best fit and most joints."""
    pairs = []
    for track, subject in itertools.product(observed.longest_tracks(), range(len(truth))):
        rows = observed.ids == track
        points, there = observed.positions[rows], truth[subject, rows]
        both = np.isfinite(points).all(axis=2) & np.isfinite(there).all(axis=2)
        if both.sum() >= _LEAST_POINTS:
            rotation, translation, distance = _robust_transform(points[both], there[both])
            pairs.append((distance / np.sqrt(both.sum()), rotation, translation))
    pairs.sort(key=lambda pair: pair[0])
    return [(rotation, translation) for _, rotation, translation in pairs[:_PAIRS]]


def _robust_transform(points: np.ndarray, truth: np.ndarray) -> Tuple[np.ndarray, np.ndarray, float]:
    weights = np.ones(len(points))
    for _ in range(10):
        rotation, translation = rigid_transform(points, truth, weights)
        distances = np.linalg.norm(truth - points @ rotation.T - translation, axis=1)
        weights = robust_weights(distances)
    return rotation, translation, float(np.median(distances))
