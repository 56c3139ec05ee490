"""One position of each joint out of what several cameras measured, and how far it errs.

**Position.** Robust weighted least squares. A measurement i has a point p_i and an information matrix L_i (inverse
covariance), which for a ray is 0 along it. The joint is where sum_i w_i (x - p_i)' L_i (x - p_i) is least, with weights
w_i = 1 / (1 + d_i^2 / c^2) of its distance d_i = ((x - p_i)' L_i (x - p_i))^0.5 (Cauchy), found by reweighting.

(sum_i w_i L_i)^-1 is greater than its covariance, as d_i^2 is 3 on the mean where errors are as they are said to be.
Weights for that are v_i = min(2 w_i, 1), which are 1 up to the distance c, and fall like w_i.

**Error.** By innovations, see skeleton_extract_3d.track.joint_filter. All cameras make one innovation together: the sum
of v_i L_i (p_i - x) with the prediction x, also of rays.
"""
from typing import NamedTuple, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.constants import EstimateConstants
from skeleton_extract_3d.track.joint_filter import averaged_innovations, error_variances, mean_innovations

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
        weights: (M, K) of the measurements, w_i [0..1].
        trust: (M, K) the same without the usual errors, v_i [0..1].
        leverage: (M, K) by how much a position moves with a measurement, mean over the axes [0..1].
    """

    positions: np.ndarray
    covariance: np.ndarray
    weights: np.ndarray
    trust: np.ndarray
    leverage: np.ndarray


class Prediction(NamedTuple):
    """What is expected of F people before a frame.

    Attributes:
        positions: (F, K, 3) [m].
        variance: (F, K) of each axis, by the motion model [m^2].
        before: (F, K) after the frame before, mean over the axes [m^2].
        known: (F, K) bool, joints of which something is expected.
        innovations: (F,) mean square, as a share of what independent errors make.
        elapsed: (F,) since the frame before [s].
    """

    positions: np.ndarray
    variance: np.ndarray
    before: np.ndarray
    known: np.ndarray
    innovations: np.ndarray
    elapsed: np.ndarray

    @property
    def measurements(self) -> Measurements:
        """The expected joints as measurements, one of each person."""
        information = np.where(self.known, 1 / self.variance, 0.0)[..., np.newaxis, np.newaxis] * np.eye(3)
        return Measurements(np.arange(len(self.positions)), self.positions, information)


class Errors(NamedTuple):
    """How far the joints of F people err.

    Attributes:
        variance: (F, K) mean over the axes [m^2].
        filtered: (F, K) of each axis, for the filter of the tracks [m^2].
        independent: (F, K) the same if errors of frames were independent [m^2].
        innovations: (F,) as in `Prediction`, with this frame.
    """

    variance: np.ndarray
    filtered: np.ndarray
    independent: np.ndarray
    innovations: np.ndarray


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
                  np.where(known[..., np.newaxis, np.newaxis], covariance, np.nan), weights, trust, leverage)


def joint_errors(measured: Measurements, joints: Joints, expected: Prediction, with_depth: np.ndarray,
                 constants: EstimateConstants) -> Errors:
    """Return how far joints err that were estimated from a prediction and what cameras measured, in this order.

    The filter never gets surer than with independent errors. Along the rays of two cameras a position is worse than on
    the mean, and one of them may be alone in the next frame.

    Args:
        with_depth: (F, K) bool, joints that a camera with depth tells.
    """
    people, place = len(expected.positions), expected.variance
    of_person = measured.sums(people)
    trust = joints.trust[people:, :, np.newaxis, np.newaxis]
    information = np.tensordot(of_person, trust * measured.information, 1)
    noise = np.tensordot(of_person, trust ** 2 * measured.information, 1)
    offsets = measured.points - expected.positions[measured.owner]
    surprise = np.tensordot(of_person, np.einsum('mkij,mkj->mki', trust * measured.information, offsets), 1)
    independent = np.trace(noise, axis1=2, axis2=3) + expected.before * (information ** 2).sum(axis=(2, 3))
    used = expected.known & (independent > 0)
    variance = _mean_variances(information, constants)
    innovations = averaged_innovations(
        expected.innovations, mean_innovations((surprise ** 2).sum(axis=2), independent, used),
        np.where(used.any(axis=1), expected.elapsed, 0.0))
    in_space = np.isfinite(variance)
    errors = error_variances(innovations, 1 - joints.leverage[:people], expected.before,
                             np.where(in_space, variance, 0.0), place)
    known = np.isfinite(joints.positions).all(axis=2)
    # where cameras tell a joint along some axes only, or not at all
    errors = np.where(in_space, errors,
                      np.where(known, np.trace(joints.covariance, axis1=2, axis2=3) / 3, place))
    worst = np.linalg.eigvalsh(np.where(known[..., np.newaxis, np.newaxis], joints.covariance, 0.0))[..., -1]
    worst = np.where(known, worst, place)
    least = np.where(with_depth, 1 / (1 / place + 1 / variance), worst)
    return Errors(errors, np.where(with_depth, np.maximum(errors, least), worst), least, innovations)


def _mean_variances(information: np.ndarray, constants: EstimateConstants) -> np.ndarray:
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
