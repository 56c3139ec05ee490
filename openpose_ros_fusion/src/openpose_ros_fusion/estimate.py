"""One position of each joint out of what several cameras measured: robust weighted least squares.

A measurement i has a point p_i and an information matrix L_i (inverse covariance), which for a ray is 0 along it. The
joint is where sum_i w_i (x - p_i)' L_i (x - p_i) is least, with weights w_i = 1 / (1 + d_i^2 / c^2) of its distance
d_i = ((x - p_i)' L_i (x - p_i))^0.5 (Cauchy), found by reweighting.
"""
from typing import NamedTuple, Tuple

import numpy as np

from openpose_ros_fusion.constants import EstimateConstants

# Information without which a joint has no position [1/m^2]: its error in space is 1 m.
_LEAST_INFORMATION = 1.0
# Symmetric matrices are kept by the six elements xx, xy, xz, yy, yz, zz, each an array of its own: for thousands of 3x3
# matrices this takes a tenth of the time of numpy.linalg.
_ROWS, _COLUMNS = np.array([0, 0, 0, 1, 1, 2]), np.array([0, 1, 2, 1, 2, 2])
_ELEMENT = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


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
    known = np.zeros((people, points.shape[1]), bool)
    # sums over the measurements of each person are a product with this
    of_person = (owner == np.arange(people)[:, np.newaxis]).astype(np.float64)
    elements = np.moveaxis(information[..., _ROWS, _COLUMNS], 2, 0)
    right = _times(elements, np.moveaxis(points, 2, 0))
    weights = np.ones(points.shape[:2])
    for number in range(constants.rounds):
        inverse, determinant, minors = _adjugate(of_person @ (weights * elements))
        if number == 0:
            # weights are positive: where there is a position once, there is one in each round
            known = determinant > _LEAST_INFORMATION * minors
        inverse = inverse / np.where(known, determinant, 1.0)
        positions = _times(inverse, of_person @ (weights * right))
        offsets = positions[:, owner] - np.moveaxis(points, 2, 0)
        weights = 1.0 / (1.0 + (offsets * _times(elements, offsets)).sum(axis=0) / constants.outlier ** 2)
    covariance = np.moveaxis(inverse[_ELEMENT], (0, 1), (2, 3))
    return Joints(np.where(known[..., np.newaxis], np.moveaxis(positions, 0, 2), np.nan),
                  np.where(known[..., np.newaxis, np.newaxis], covariance, np.nan), weights)


def _times(elements: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return the products (3, ...) of symmetric matrices, by their elements (6, ...), with vectors (3, ...)."""
    xx, xy, xz, yy, yz, zz = elements
    x, y, z = vectors
    return np.stack([xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z])


def _adjugate(elements: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the adjugates (6, ...) of symmetric matrices (6, ...), their determinants, and sums of 2x2 minors.

    Minors over determinant is the trace of the inverse.
    """
    xx, xy, xz, yy, yz, zz = elements
    adjugate = np.stack([yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy, xx * zz - xz * xz,
                         xy * xz - xx * yz, xx * yy - xy * xy])
    determinant = xx * adjugate[0] + xy * adjugate[1] + xz * adjugate[2]
    return adjugate, determinant, adjugate[0] + adjugate[3] + adjugate[5]
