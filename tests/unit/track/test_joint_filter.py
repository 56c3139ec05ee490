"""Kalman filters of joints: no lag, honest covariances, and no harm from a wild measurement."""
import numpy as np
import pytest

from skeleton_extract_3d.track.joint_filter import JointFilter, along_rays

DT = 1 / 15


def filters(tracks=1, points=1):
    """Return filters whose points, 3 m ahead, have just begun."""
    return JointFilter.at_rest(np.tile([0.0, 0.0, 3.0], (tracks, points, 1)), 0.3, 1.0)


def step(joints, measured, covariance):
    """Predict, then measure all points at (3,) or (T, K, 3) with one (3, 3) covariance."""
    shape = joints.position.shape
    return joints.predicted(DT, np.full(shape[1], 4.0)).corrected(
        np.broadcast_to(measured, shape), np.broadcast_to(covariance, (*shape, 3)), np.ones(shape[:2], bool))


def covariances(joints):
    """Return the full covariances of position and velocity, (T, K, 6, 6)."""
    cross = joints.cross_covariance
    return np.concatenate([np.concatenate([joints.position_covariance, cross], axis=3),
                           np.concatenate([np.swapaxes(cross, 2, 3), joints.velocity_covariance], axis=3)], axis=2)


def test_it_is_the_textbooks_filter():
    rng, joints = np.random.default_rng(1), filters()
    state, covariance = np.array([0, 0, 3.0, 0, 0, 0]), np.diag([0.09] * 3 + [1.0] * 3)
    transition = np.block([[np.eye(3), DT * np.eye(3)], [np.zeros((3, 3)), np.eye(3)]])
    noise = np.block([[DT ** 4 / 4 * np.eye(3), DT ** 3 / 2 * np.eye(3)],
                      [DT ** 3 / 2 * np.eye(3), DT ** 2 * np.eye(3)]]) * 4.0 ** 2
    for i in range(20):
        measured = np.array([0.5 * i * DT, 0, 3]) + rng.normal(0, 0.02, 3)
        of_measurement = along_rays(measured, np.array(0.02), np.array(0.05))
        joints = step(joints, measured, of_measurement)
        state, covariance = transition @ state, transition @ covariance @ transition.T + noise
        gain = covariance[:, :3] @ np.linalg.inv(covariance[:3, :3] + of_measurement)
        state, covariance = state + gain @ (measured - state[:3]), covariance - gain @ covariance[:3]
    np.testing.assert_allclose(joints.position[0, 0], state[:3])
    np.testing.assert_allclose(joints.velocity[0, 0], state[3:])
    np.testing.assert_allclose(covariances(joints)[0, 0], covariance, atol=1e-12)


def test_a_wild_measurement_is_damped_and_a_jump_is_taken_over_in_a_few_frames():
    def settled():
        joints = filters()
        for _ in range(30):
            joints = step(joints, (0, 0, 3.0), 0.02 ** 2 * np.eye(3))
        return joints

    wild, small = settled(), settled()
    wild = step(wild, (0, 0, 5.0), 0.02 ** 2 * np.eye(3))
    small = step(small, (0, 0, 3.02), 0.02 ** 2 * np.eye(3))
    gain = (small.position[0, 0, 2] - 3) / 0.02
    assert 0.3 < gain < 0.9
    # 2 m are more than 50 deviations of 3 cm; those up to 4 count in full
    assert wild.position[0, 0, 2] - 3 < 0.3 * gain * 2
    positions = []
    for _ in range(12):
        wild = step(wild, (0, 0, 5.0), 0.02 ** 2 * np.eye(3))
        positions.append(wild.position[0, 0, 2])
    assert positions[3] > 4.8, 'a third of a second later'
    # the velocity that the jump gave is lost again
    assert max(positions) < 5 + 0.2 * 2 and positions[-1] == pytest.approx(5, abs=0.02)
