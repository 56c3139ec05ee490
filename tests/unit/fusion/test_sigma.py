"""Sigma of fused joints is honest, whatever the rate of the cameras and however long their errors last.

With equal errors along all axes, 0.61 of the joints are within 1 sigma and 0.993 within 2.
"""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_fusion.constants import FUSION
from openpose_ros_fusion.correction import joint_errors
from openpose_ros_fusion.estimate import Joints, Measurements
from openpose_ros_fusion.tracks import Tracks
from simulated_errors import cameras, fusion_shares, standing, striding

# Bounds of the shares within 1 and 2 sigma.
WITH_DEPTH, RAYS = (0.53, 0.74, 0.97), (0.55, 0.78, 0.96)


@pytest.mark.parametrize('people, rig, rate, bounds', [
    (striding, (1, 0.06, 0.5), 5.0, WITH_DEPTH), (striding, (1, 0.06, 0.0), 60.0, WITH_DEPTH),
    (striding, (2, 0.06, 0.0), 5.0, WITH_DEPTH), (striding, (3, 0.06, 0.5), 60.0, WITH_DEPTH),
    (standing, (3, 0.02, 0.1), 30.0, WITH_DEPTH),
    (striding, (3, 0.06, 0.0, 0.006), 30.0, RAYS), (striding, (3, 0.06, 0.5, 0.006), 30.0, RAYS)])
def test_shares_within_sigma(people, rig, rate, bounds):
    """Cameras by number, noise [m], correlation time [s] and, without depth, the error of their rays [rad]."""
    shares = fusion_shares(people(5.0, 4), cameras(*rig), rate, 4.0)
    assert bounds[0] < shares.within_1 < bounds[1]
    assert shares.within_2 > bounds[2]


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
    joints = Joints(np.zeros((*shape, 3)), np.zeros((*shape, 3, 3)), np.ones((2 * people, 2000)), halves)
    # one frame ends the memory, so that the share is that of the frame
    tracks = Tracks.begun(0.0, iter(range(people)), np.zeros((*shape, 3)))
    covariance = np.broadcast_to([0.5, 0.0, 0.0], (*shape, 3))
    tracks = replace(tracks, stamp=1e9, covariance=covariance, variance=variances, innovations=np.ones(people))
    found = joint_errors(tracks, measured, joints, np.ones(shape, bool), FUSION.estimate)
    assert found.variance.shape == shape
    if people:
        assert found.innovations.mean() == pytest.approx(share, rel=0.03, abs=0.01)
        assert found.variance.mean() == pytest.approx(variance, rel=0.06)
