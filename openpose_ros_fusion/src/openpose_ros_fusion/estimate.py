"""One position of each joint out of what several cameras measured: robust weighted least squares.

A measurement i has a point p_i and an information matrix L_i (inverse covariance), which for a ray is 0 along it. The
joint is where sum_i w_i (x - p_i)' L_i (x - p_i) is least, with weights w_i = 1 / (1 + d_i^2 / c^2) of its distance
d_i = ((x - p_i)' L_i (x - p_i))^0.5 (Cauchy), found by reweighting.
"""
from typing import NamedTuple

import numpy as np

from openpose_ros_fusion.constants import EstimateConstants

# Information without which a joint has no position [1/m^2]: 1 m.
_LEAST_INFORMATION = 1.0


class Measurements(NamedTuple):
    """M measurements of people, each of all K joints.

    Attributes:
        owner: (M,) int, which of the F people each is of.
        points: (M, K, 3) [m].
        information: (M, K, 3, 3) [1/m^2]; zero where a joint was not measured.
    """

    owner: np.ndarray
    points: np.ndarray
    information: np.ndarray


class Joints(NamedTuple):
    """Joints of F people.

    Attributes:
        positions: (F, K, 3) [m]; NaN where nothing tells them.
        covariance: (F, K, 3, 3) [m^2].
        weights: (M, K) of the measurements [0..1].
    """

    positions: np.ndarray
    covariance: np.ndarray
    weights: np.ndarray


def estimate_joints(people: int, measured: Measurements, constants: EstimateConstants) -> Joints:
    """Return the joints of a number of people; see the module's equations."""
    owner, points, information = measured
    weights = np.ones(points.shape[:2])
    weighted_points = np.einsum('mkij,mkj->mki', information, points)
    for _ in range(constants.rounds):
        total = _sum(people, owner, weights[..., np.newaxis, np.newaxis] * information)
        solvable = np.linalg.eigvalsh(total)[..., 0] > _LEAST_INFORMATION
        safe = np.where(solvable[..., np.newaxis, np.newaxis], total, np.eye(3))
        right = _sum(people, owner, weights[..., np.newaxis] * weighted_points)
        positions = np.linalg.solve(safe, right[..., np.newaxis])[..., 0]
        offsets = positions[owner] - points
        squares = np.einsum('mki,mkij,mkj->mk', offsets, information, offsets)
        weights = 1.0 / (1.0 + squares / constants.outlier ** 2)
    positions = np.where(solvable[..., np.newaxis], positions, np.nan)
    covariance = np.where(solvable[..., np.newaxis, np.newaxis], np.linalg.inv(safe), np.nan)
    return Joints(positions, covariance, weights)


def _sum(people: int, owner: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the sums over the measurements of each person."""
    result = np.zeros((people, *values.shape[1:]))
    np.add.at(result, owner, values)
    return result
