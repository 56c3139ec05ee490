"""Joints out of what several cameras measured: robust weighted least squares."""
import numpy as np
import pytest

from openpose_ros_fusion.constants import EstimateConstants
from openpose_ros_fusion.estimate import Measurements, estimate_joints

CONSTANTS = EstimateConstants()
NOT_ROBUST = EstimateConstants(outlier=1e6)
ALONG_Z = np.diag([0.0, 0.0, 1.0])


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


@pytest.mark.parametrize('information', [np.eye(3) - ALONG_Z, np.zeros((3, 3))], ids=['one ray', 'nothing'])
def test_too_little_information_makes_no_position(information):
    found = estimate_joints(1, Measurements(np.zeros(1, int), np.zeros((1, 1, 3)), information[np.newaxis, np.newaxis]),
                            CONSTANTS)
    assert np.isnan(found.positions).all() and np.isnan(found.covariance).all()
