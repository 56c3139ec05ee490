"""Sigma of fused joints is honest, whatever the rate of the cameras and however long their errors last.

With equal errors along all axes, 0.61 of the joints are within 1 sigma and 0.993 within 2.
"""
import numpy as np
import pytest

from openpose_ros_fusion.estimate import Measurements
from openpose_ros_fusion.innovations import Innovations
from simulated_errors import cameras, fusion_shares, standing, striding


@pytest.mark.parametrize('correlation', [0.0, 0.5])
@pytest.mark.parametrize('rate', [5.0, 15.0, 60.0])
@pytest.mark.parametrize('count', [1, 2, 3])
def test_people_who_walk(count, rate, correlation):
    shares = fusion_shares(striding(5.0, 4), cameras(count, 0.06, correlation), rate, 4.0)
    assert 0.53 < shares.within_1 < 0.74
    assert shares.within_2 > 0.97


@pytest.mark.parametrize('rate, correlation', [(60.0, 0.0), (60.0, 0.5), (30.0, 0.1)])
def test_people_who_stand_before_three_good_cameras(rate, correlation):
    shares = fusion_shares(standing(5.0, 4), cameras(3, 0.02, correlation), rate, 4.0)
    assert 0.53 < shares.within_1 < 0.74
    assert shares.within_2 > 0.97


@pytest.mark.parametrize('correlation', [0.0, 0.5])
def test_rays_of_three_cameras(correlation):
    shares = fusion_shares(striding(5.0, 4), cameras(3, 0.06, correlation, angle=0.006), 30.0, 4.0)
    assert 0.55 < shares.within_1 < 0.78
    assert shares.within_2 > 0.96


def test_without_people_there_are_no_innovations():
    nothing = Measurements(np.zeros(0, int), np.zeros((0, 18, 3)), np.zeros((0, 18, 3, 3)))
    found = Innovations(0, nothing, np.zeros((0, 18)), np.zeros((0, 18, 3)), np.zeros((0, 18)), np.zeros((0, 18), bool))
    assert found.averaged(np.zeros(0), np.zeros(0)).shape == (0,)


def innovations(apart, variance=0.01, noise=0.01, people=800):
    """Return what is known of people whose joints are measured at offsets of a standard deviation apart [m]."""
    random = np.random.RandomState(0)
    measured = Measurements(np.arange(people), random.normal(0, apart, (people, 18, 3)),
                            np.broadcast_to(np.eye(3) / noise, (people, 18, 3, 3)))
    shape = (people, 18)
    found = Innovations(people, measured, np.ones(shape), np.zeros((*shape, 3)), np.full(shape, variance),
                        np.ones(shape, bool))
    shares = found.averaged(np.ones(people), np.full(people, 1e9))
    halves = np.full(shape, 0.5)
    return shares.mean(), found.variances(np.full(people, shares.mean()), halves, halves, np.zeros(shape)).mean()


@pytest.mark.parametrize('apart, share, variance', [
    (np.sqrt(0.02), 1.0, 0.005),  # independent errors: the mean of two equal ones
    (0.001, 0.0, 0.01),  # what is measured errs as what is expected does: nothing is learnt
    (np.sqrt(0.04), 2.0, 0.25 * 0.03 + 0.25 * 0.01)])  # the joint has moved
def test_innovations_tell_the_variance(apart, share, variance):
    found = innovations(apart)
    assert found[0] == pytest.approx(share, rel=0.03, abs=0.01)
    assert found[1] == pytest.approx(variance, rel=0.06)
