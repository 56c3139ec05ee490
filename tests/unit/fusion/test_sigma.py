"""Sigma of fused joints is honest, whatever the rate of the cameras and however long their errors last.

With equal errors along all axes, 0.61 of the joints are within 1 sigma and 0.993 within 2.
"""
import numpy as np
import pytest

from openpose_ros_fusion.constants import FUSION
from openpose_ros_fusion.estimate import Joints, Measurements, Prediction, joint_errors
from simulated_errors import cameras, fusion_shares, standing, striding


@pytest.mark.parametrize('count, rate, correlation', [
    (1, 5.0, 0.5), (1, 60.0, 0.0), (2, 15.0, 0.0), (2, 5.0, 0.0), (3, 60.0, 0.5), (3, 15.0, 0.5)])
def test_people_who_walk(count, rate, correlation):
    shares = fusion_shares(striding(5.0, 4), cameras(count, 0.06, correlation), rate, 4.0)
    assert 0.53 < shares.within_1 < 0.74
    assert shares.within_2 > 0.97


@pytest.mark.parametrize('rate, correlation', [(60.0, 0.0), (30.0, 0.1)])
def test_people_who_stand_before_three_good_cameras(rate, correlation):
    shares = fusion_shares(standing(5.0, 4), cameras(3, 0.02, correlation), rate, 4.0)
    assert 0.53 < shares.within_1 < 0.74
    assert shares.within_2 > 0.97


@pytest.mark.parametrize('correlation', [0.0, 0.5])
def test_rays_of_three_cameras(correlation):
    shares = fusion_shares(striding(5.0, 4), cameras(3, 0.06, correlation, angle=0.006), 30.0, 4.0)
    assert 0.55 < shares.within_1 < 0.78
    assert shares.within_2 > 0.96


@pytest.mark.parametrize('people, apart, share, variance', [
    (9, np.sqrt(0.02), 1.0, 0.005),  # independent errors: the mean of two equal ones
    (9, 0.001, 0.0, 0.01),  # what is measured errs as what is expected does: nothing is learnt
    (9, np.sqrt(0.04), 2.0, 0.25 * 0.03 + 0.25 * 0.01),  # the joint has moved
    (0, 0.0, None, None)])
def test_innovations_tell_the_variance(people, apart, share, variance):
    """Joints are measured at offsets of a standard deviation apart [m]; both variances are 0.01 m^2."""
    random, shape = np.random.RandomState(0), (people, 2000)
    measured = Measurements(np.arange(people), random.normal(0, apart, (*shape, 3)),
                            np.broadcast_to(np.eye(3) / 0.01, (*shape, 3, 3)))
    halves, variances = np.full((2 * people, 2000), 0.5), np.full(shape, 0.01)
    joints = Joints(np.zeros((*shape, 3)), np.zeros((*shape, 3, 3)), halves, np.ones((2 * people, 2000)), halves)
    # one frame ends the memory, so that the share is that of the frame
    expected = Prediction(np.zeros((*shape, 3)), np.full(shape, 0.5), variances, np.ones(shape, bool), np.ones(people),
                          np.full(people, 1e9))
    found = joint_errors(measured, joints, expected, np.ones(shape, bool), FUSION.estimate)
    assert found.variance.shape == shape
    if people:
        assert found.innovations.mean() == pytest.approx(share, rel=0.03, abs=0.01)
        assert found.variance.mean() == pytest.approx(variance, rel=0.06)
