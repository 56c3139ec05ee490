"""Which way heads look: heads of known pose are projected and found again."""
import numpy as np
import pytest

from skeleton_extract_3d.body.body import BODY, HEAD
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.head_pose import HeadPose

DEPTH = 2.5
NOSE = 0


def depths_of(yaw, scale=1.0):
    """Return by how much the joints of a head lie behind the middle of the ears, (5,) [m]."""
    left, _, ahead = BODY.head_points.T * scale
    return left * np.sin(yaw) - ahead * np.cos(yaw)


def rays_of(yaw, scale=1.0, middle=(0.2, -0.3)):
    """Return the rays of a head that is turned to the right of the picture by an angle, (1, 18, 3)."""
    left, down, ahead = BODY.head_points.T * scale
    rays = np.full((1, 18, 3), np.nan)
    # from afar: all of it counts as at one depth
    rays[0, HEAD, 0] = middle[0] + (left * np.cos(yaw) + ahead * np.sin(yaw)) / DEPTH
    rays[0, HEAD, 1] = middle[1] + down / DEPTH
    rays[0, HEAD, 2] = 1
    return rays


def pose_of(rays, cosine=1.0, scale=1.0):
    scores = np.where(np.isfinite(rays[..., 0]), 1.0, 0.0)
    return HeadPose(*METHOD.compiled.estimate_head_pose(rays, scores, np.array([DEPTH]), np.array([scale]),
                                                        np.array([cosine])))


def test_without_a_joint_of_the_head_nothing_is_known_and_all_is_finite():
    head = pose_of(np.full((1, 18, 3), np.nan))
    assert not head.known.any()
    assert all(np.isfinite(values).all() for values in (head.ray, head.depths, head.surface))


@pytest.mark.parametrize('scale', [0.6, 1.0])
@pytest.mark.parametrize('degrees', [-150, -90, -45, -10, 0, 10, 45, 90, 150, 180])
def test_a_turned_head_is_found(degrees, scale):
    yaw = np.radians(degrees)
    head = pose_of(rays_of(yaw, scale), np.cos(yaw), scale)
    assert head.known.all()
    np.testing.assert_allclose(head.ray[0], (0.2, -0.3, 1), atol=0.002)
    # what the shoulders say pulls a little
    np.testing.assert_allclose(head.depths[0], depths_of(yaw, scale), atol=0.01)


@pytest.mark.parametrize('cosine', [1.0, -1.0])
def test_of_a_nose_alone_the_shoulders_tell_the_direction(cosine):
    rays = rays_of(0.0)
    rays[0, HEAD[1:]] = np.nan
    head = pose_of(rays, cosine)
    assert head.known.all()
    assert np.sign(head.depths[0, NOSE]) == -cosine
    # the nose itself is where it was seen
    np.testing.assert_allclose(head.ray[0, :2] * DEPTH + [0, BODY.head_points[NOSE, 1]],
                               rays[0, HEAD[NOSE], :2] * DEPTH, atol=0.02)
