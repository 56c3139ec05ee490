"""One position of each joint out of what several cameras measured.

Robust weighted least squares. A measurement i has a point p_i and an information matrix L_i (inverse
covariance), which for a ray is 0 along it. The joint is where sum_i w_i (x - p_i)' L_i (x - p_i) is least, with weights
w_i = 1 / (1 + d_i^2 / c^2) of its distance d_i = ((x - p_i)' L_i (x - p_i))^0.5 (Cauchy), found by reweighting.

(sum_i w_i L_i)^-1 is greater than its covariance, as d_i^2 is 3 on the mean where errors are as they are said to be.
Weights for that are v_i = min(2 w_i, 1), which are 1 up to the distance c, and fall like w_i.
"""
from typing import NamedTuple, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.constants import EstimateConstants

# Which of the elements xx, xy, xz, yy, yz, zz is where in a symmetric matrix. Matrices are kept as arrays (3, 3, ...),
# and inverted by their adjugates: for many 3x3 matrices this takes a tenth of the time of numpy.linalg.
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

    @classmethod
    def joined(cls, parts: Sequence['Measurements']) -> 'Measurements':
        """Return one or more sets of measurements as one."""
        return cls(*map(np.concatenate, zip(*parts)))

    def sums(self, people: int) -> np.ndarray:
        """Return the matrix (F, M) whose product with values (M, ...) sums those of each person."""
        return (self.owner == np.arange(people)[:, np.newaxis]).astype(np.float64)


class Joints(NamedTuple):
    """Joints of F people.

    Attributes:
        positions: (F, K, 3) [m]; NaN where no measurement tells them.
        covariance: (F, K, 3, 3) of weighted least squares [m^2]; too great where all measurements agree.
        trust: (M, K) of the measurements, v_i [0..1].
        leverage: (M, K) by how much a position moves with a measurement, mean over the axes [0..1].
    """

    positions: np.ndarray
    covariance: np.ndarray
    trust: np.ndarray
    leverage: np.ndarray


def estimate_joints(people: int, measured: Measurements, constants: EstimateConstants) -> Joints:
    """Return the joints of a number of people; see the module's equations."""
    owner = measured.owner
    known = np.zeros((people, measured.points.shape[1]), bool)
    of_person = measured.sums(people)
    points = np.moveaxis(measured.points, 2, 0)
    information = np.ascontiguousarray(np.moveaxis(measured.information, (2, 3), (0, 1)))
    right = _times(information, points)
    weights = np.ones(points.shape[1:])
    for number in range(constants.rounds):
        inverse, determinant, minors = _adjugate(of_person @ (weights * information))
        if number == 0:
            # weights are positive: where there is a position once, there is one in each round
            known = determinant > constants.least_information * minors
        inverse = inverse / np.where(known, determinant, 1.0)
        positions = _times(inverse, of_person @ (weights * right))
        offsets = positions[:, owner] - points
        used, squares = weights, np.einsum('imk,ijmk,jmk->mk', offsets, information, offsets)
        weights = 1.0 / (1.0 + squares / constants.outlier ** 2)
    leverage = used * np.einsum('ijmk,ijmk->mk', inverse[:, :, owner], information) / 3
    trust = np.minimum(2 * weights, 1.0)
    covariance = np.moveaxis(inverse, (0, 1), (2, 3))
    return Joints(np.where(known[..., np.newaxis], np.moveaxis(positions, 0, 2), np.nan),
                  np.where(known[..., np.newaxis, np.newaxis], covariance, np.nan), trust, leverage)


def mean_variances(information: np.ndarray, constants: EstimateConstants) -> np.ndarray:
    """Return the mean variances over the axes (...) [m^2] of information matrices (..., 3, 3); inf: not of all axes."""
    _, determinant, minors = _adjugate(np.moveaxis(information, (-2, -1), (0, 1)))
    known = determinant > constants.least_information * minors
    return np.where(known, minors / np.where(known, 3 * determinant, 1.0), np.inf)


def _times(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return the products (3, M, K) of matrices (3, 3, M, K) with vectors (3, M, K)."""
    return np.einsum('ijmk,jmk->imk', matrices, vectors)


def _adjugate(matrices: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the adjugates of symmetric matrices (3, 3, ...), their determinants, and sums of 2x2 minors.

    Minors over determinant is the trace of the inverse.
    """
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = matrices
    adjugate = np.stack([yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy, xx * zz - xz * xz,
                         xy * xz - xx * yz, xx * yy - xy * xy])
    determinant = xx * adjugate[0] + xy * adjugate[1] + xz * adjugate[2]
    return adjugate[_ELEMENT], determinant, adjugate[0] + adjugate[3] + adjugate[5]
