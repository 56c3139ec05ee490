"""Regions of interest against transforms that are known."""
import numpy as np
import pytest

from openpose_ros_pkg.landmarks.face_points import face_points
from openpose_ros_pkg.landmarks.regions import Region, face_regions, face_width

# A flat open right hand, fingers up, in units of its own: wrist, then thumb to little finger.
HAND = np.array([
    (0, 0), (-2, -1), (-3, -3), (-4, -4), (-5, -5), (-2, -6), (-2, -8), (-2, -9), (-2, -10), (0, -6), (0, -9), (0, -10),
    (0, -11), (1, -6), (1, -8), (1, -9), (1, -10), (2, -5), (2, -7), (2, -8), (2, -9)], float)


def turned(points, angle, scale=1.0, shift=(0, 0)):
    """Turn points clockwise in the image, whose y points down."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return scale * points @ np.array([(cosine, sine), (-sine, cosine)]) + shift


@pytest.mark.parametrize('angle', [0, 0.3, -1.2, 3.0])
def test_crop_lies_turned_in_the_image(angle):
    region = Region(100.0, 50.0, 30.0, angle)
    points = np.array([(0, 0), (223, 0), (111.5, 111.5), (50, 200)])
    there = region.to_image(points, 224)
    np.testing.assert_allclose(there[2], (100, 50), atol=1e-9)
    right = np.array([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(there[1] - there[0], 223 / 224 * 30 * right, atol=1e-9)
    down = np.array([-right[1], right[0]])
    np.testing.assert_allclose(there[3] - there[0], 30 / 224 * (50 * right + 200 * down), atol=1e-9)


def test_face_is_round_the_nose_along_the_eyes():
    joints = {'nose': np.array((50.0, 60.0)), 'right_eye': np.array((40.0, 50.0)), 'left_eye': np.array((60.0, 70.0))}
    assert face_width(joints) == pytest.approx(2.2 * np.hypot(20, 20))
    along, upright = face_regions(joints, 40.0)
    assert (along.x, along.y, along.side, along.angle) == pytest.approx((50, 60, 64, np.pi / 4))
    assert upright == Region(50, 60, 64)
    assert face_regions({'nose': joints['nose']}, 40.0) == (upright,)
    assert np.isnan(face_width({'nose': joints['nose']}))


def test_points_of_a_face_are_where_their_places_on_the_mesh_are():
    mesh = np.arange(468.0)[:, np.newaxis] * (1, 10, 100)
    points = face_points(mesh)
    assert points.shape == (70, 3)
    assert points[0].tolist() == [162, 1620, 16200] and points[8, 0] == 152 and points[30, 0] == 4  # jaw, chin, nose
    assert points[17, 0] == (70 + 46) / 2  # a brow: between its edges
    np.testing.assert_allclose(points[68], points[36:42].mean(axis=0))
    np.testing.assert_allclose(points[69], points[42:48].mean(axis=0))
    assert face_points(np.zeros((0, 468, 3))).shape == (0, 70, 3)
