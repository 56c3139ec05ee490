"""Joints out of what several cameras measured: robust weighted least squares."""
import numpy as np
import pytest

from openpose_ros_fusion.constants import EstimateConstants
from openpose_ros_fusion.estimate import Measurements, estimate_joints

CONSTANTS = EstimateConstants()
NOT_ROBUST = EstimateConstants(outlier=1e6)


def estimated(points, information):
    """Return one joint of one person out of measurements."""
    points = np.array(points, float)[:, np.newaxis]
    measured = Measurements(np.zeros(len(points), int), points, np.array(information, float)[:, np.newaxis])
    return estimate_joints(1, measured, CONSTANTS)


def ray(direction, sigma=0.02):
    """Return the information of a ray: none along it."""
    unit = np.array(direction, float) / np.linalg.norm(direction)
    return (np.eye(3) - np.outer(unit, unit)) / sigma ** 2


def test_no_person():
    nothing = Measurements(np.zeros(0, int), np.zeros((0, 18, 3)), np.zeros((0, 18, 3, 3)))
    assert estimate_joints(0, nothing, CONSTANTS).positions.shape == (0, 18, 3)


def test_it_is_the_mean_weighted_by_inverse_covariances():
    random = np.random.RandomState(0)
    owner, points = np.array([0, 1, 0, 1, 1]), random.normal(size=(5, 18, 3))
    roots = random.normal(size=(5, 18, 3, 3))
    information = np.matmul(roots, np.swapaxes(roots, 2, 3)) + 2 * np.eye(3)
    joints = estimate_joints(2, Measurements(owner, points, information), NOT_ROBUST)
    for person in range(2):
        mine = owner == person
        total = information[mine].sum(axis=0)
        right = np.matmul(information[mine], points[mine][..., np.newaxis]).sum(axis=0)
        np.testing.assert_allclose(joints.positions[person], np.linalg.solve(total, right)[..., 0], atol=1e-9)
        np.testing.assert_allclose(joints.covariance[person], np.linalg.inv(total), atol=1e-9)


def test_of_three_measurements_the_one_elsewhere_counts_little():
    found = estimated([(0, 0, 0), (0.01, 0, 0), (0.5, 0, 0)], [np.eye(3) / 0.02 ** 2] * 3)
    assert found.positions[0, 0, 0] < 0.02
    assert found.weights[2, 0] < 0.01


def test_two_rays_make_a_position():
    joint = np.array([1.0, 2.0, 0.5])
    origins = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 1.0]])
    np.testing.assert_allclose(estimated(origins, [ray(joint - origin) for origin in origins]).positions[0, 0], joint,
                               atol=1e-9)


@pytest.mark.parametrize('information', [ray((0, 0, 1)), np.zeros((3, 3))], ids=['one ray', 'nothing'])
def test_too_little_information_makes_no_position(information):
    found = estimated([(0, 0, 0)], [information])
    assert np.isnan(found.positions).all() and np.isnan(found.covariance).all()


def test_a_ray_helps_across_its_direction_alone():
    position, vague = np.array([0.0, 0.0, 3.0]), np.eye(3) / 0.1 ** 2
    variances = np.diag(estimated([position, (0, 0, 0)], [vague, ray(position)]).covariance[0, 0])
    np.testing.assert_allclose(variances[2], 0.1 ** 2, rtol=1e-9)
    assert (variances[:2] < 0.02 ** 2).all()
