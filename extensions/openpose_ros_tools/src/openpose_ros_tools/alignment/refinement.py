"""Lag and transform refined together: robust least squares on the measured joints of all people."""
from dataclasses import dataclass, field
from typing import Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from openpose_ros_tools.alignment.candidates import Observed, Solution, least_points, merit, robust_weights
from openpose_ros_tools.alignment.clock import JointPaths

_PERSON_GATE = 0.5  # [m] a person nearer to a subject, by the median of the joints, is that subject
_MERIT_GATE = 0.12  # [m] joints that meet within this count for the merit
_SETTLED = 1e-5  # [s, rad, m] steps end where nothing changes by more
_LONGEST_STEP = 0.1  # [s] change of the lag in one step
_SHORTEST_HALF = 0.02  # [s] velocities are means over this, or half a frame, to both sides


@dataclass(frozen=True)
class Refined(Solution):
    """A solution with its uncertainty."""

    subjects: np.ndarray = field(default_factory=lambda: np.zeros(0, int))  # (R,) of each row, -1 none
    # of lag [s], rotation [degrees], and translation at the middle of the people [m]
    std: Tuple[float, float, float] = (np.nan, np.nan, np.nan)
    residual: float = np.nan  # median distance of the joints used [m]
    scale: float = np.nan  # by which the camera's people would have to be stretched to fit; not applied
    samples: int = 0  # joints in single frames that were used


def refine(observed: Observed, paths: JointPaths, solution: Solution, free: np.ndarray, steps: int) -> Refined:
    """Improve lag and transform together until nothing changes; what is not free stays.

    Gauss-Newton steps with robust weights; in each, people and subjects are matched anew.

    Args:
        free: (7,) bool, which of rotation vector, translation and lag are to be found.
    """
    half, rows = max(observed.frame_time / 2, _SHORTEST_HALF), np.arange(len(observed.times))
    for step in range(steps):
        truth, moved = paths.at(observed.times + solution.lag), solution.apply(observed.positions)
        subjects = _matched(np.linalg.norm(truth - moved, axis=3))
        residual, velocity = truth[subjects, rows] - moved, np.zeros_like(moved)
        if free[6]:
            velocity = paths.velocity(observed.times + solution.lag, half)[subjects, rows]
        used = np.isfinite(residual + velocity).all(axis=2) & (subjects >= 0)[:, None]
        if used.sum() < least_points(free):
            return Refined(solution.lag, solution.rotation, solution.translation, samples=int(used.sum()))
        points, residual = moved[used], residual[used]
        distances = np.linalg.norm(residual, axis=1)
        weights = robust_weights(distances) * observed.weights[used]
        middle = weights @ points / weights.sum()
        derivatives = _derivatives(points - middle, velocity[used]) * free
        normal = derivatives.reshape(-1, 7).T @ (weights[:, None, None] * derivatives).reshape(-1, 7)
        inverse = np.linalg.pinv(normal, rcond=1e-9)  # where nothing moves the lag stays
        pulls = weights[:, None] * np.einsum('nij,ni->nj', derivatives, residual)
        change = inverse @ pulls.sum(axis=0)
        change *= min(1.0, _LONGEST_STEP / max(abs(change[6]), _LONGEST_STEP))
        turn = Rotation.from_rotvec(change[:3])
        solution = Solution(solution.lag + change[6], turn.apply(solution.rotation.T).T,
                            turn.apply(solution.translation - middle) + middle + change[3:6])
        if step > 2 and np.abs(change).max() < _SETTLED:
            break
    # a joint of a person is a group: what it errs by always counts once and not once per frame
    row, joint = np.nonzero(used)
    variance = (weights * (residual ** 2).mean(axis=1)).sum() / weights.sum()
    std = np.where(free, _deviations(pulls, subjects[row] * used.shape[1] + joint, inverse, variance), np.nan)
    arms, weights = points - middle, weights[:, None]
    stretched = (weights * arms * (residual - (weights * residual).sum(axis=0) / weights.sum())).sum()
    distances = np.linalg.norm(paths.at(observed.times + solution.lag) - solution.apply(observed.positions), axis=3)
    return Refined(
        solution.lag, solution.rotation, solution.translation, merit(distances, _MERIT_GATE), subjects,
        (std[6], float(np.degrees(np.linalg.norm(std[:3]))), float(np.linalg.norm(std[3:6]))),
        float(np.median(np.linalg.norm(residual, axis=1))), 1 + stretched / (weights * arms ** 2).sum(), len(points))


def _matched(distances: np.ndarray) -> np.ndarray:
    """Return the subject of each row (R,), -1 none, by distances (S, R, K)."""
    known = np.isfinite(distances).any(axis=2)
    near = np.nanmedian(np.where(known[..., None], distances, np.inf), axis=2)
    return np.where(near.min(axis=0) < _PERSON_GATE, near.argmin(axis=0), -1)


def _derivatives(points: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return the derivatives (N, 3, 7) of rotation x points + translation - velocity lag."""
    rows = np.zeros((len(points), 3, 7))
    rows[:, :, :3] = np.cross(np.eye(3), points[:, np.newaxis]).transpose(0, 2, 1)
    rows[:, :, 3:6] = np.eye(3)
    rows[:, :, 6] = -velocity
    return rows


def _deviations(pulls: np.ndarray, groups: np.ndarray, inverse: np.ndarray, variance: float) -> np.ndarray:
    """Return standard deviations (7,) with samples of one group depending on each other.

    The "sandwich" of Liang and Zeger, Biometrika 73, 13 (1986), of weighted derivatives times residuals (N, 7). Where
    few groups give too small a value, that of independent samples is taken, by the variance of a coordinate [m2].
    """
    sums = np.zeros((groups.max() + 1, 7))
    np.add.at(sums, groups, pulls)
    count = len(np.unique(groups))
    grouped = np.diag(inverse @ (sums.T @ sums) @ inverse) * count / max(count - 1, 1)
    return np.sqrt(np.maximum(np.maximum(grouped, variance * np.diag(inverse)), 0))
