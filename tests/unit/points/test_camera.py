"""The camera of a cloud, found from its points; pixels, rays and lenses are in test_depth.py."""
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.camera import CameraModel, fitted_camera

# A Kinect v2 at a quarter of its width, its centre off the middle.
K = np.array([[135.2, 0, 116.3], [0, 134.6, 70.9], [0, 0, 1]])
CAMERA = CameraModel(240, 135, K)


def points(camera=CAMERA, seed=0):
    """Return x, y, z of a cloud, (3, H, W) float64 [m]: surfaces at all depths between 0.8 and 6 m."""
    z = np.random.default_rng(seed).uniform(0.8, 6.0, (camera.height, camera.width))
    return (camera.ray_grid() * z[..., None]).transpose(2, 0, 1)


def test_no_point_tells_nothing():
    assert fitted_camera(*np.full((3, 54, 96), np.nan)) is None
    assert fitted_camera(*np.zeros((3, 54, 96))) is None


@pytest.mark.parametrize('dtype, tolerance', [(np.float64, 1e-9), (np.float32, 1e-5)])
def test_the_camera_is_found(dtype, tolerance):
    found = fitted_camera(*points().astype(dtype))
    assert (found.width, found.height) == (240, 135)
    # float32 has 7 digits
    np.testing.assert_allclose(found.matrix, K, rtol=tolerance)
    assert not found.distortion.size


@pytest.mark.parametrize('turn', [
    pytest.param([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], id='x forward, z up (a camera_link)'),
    pytest.param([[1, 0, 0], [0, 0, 1], [0, -1, 0]], id='y forward, z up'),
    pytest.param([[-1, 0, 0], [0, 1, 0], [0, 0, 1]], id='mirrored'),
    pytest.param([[-1, 0, 0], [0, -1, 0], [0, 0, 1]], id='upside down'),
    pytest.param([[1, 0, 0], [0, -1, 0], [0, 0, -1]], id='z backwards')])
def test_points_in_another_frame_are_refused(turn):
    x, y, z = np.tensordot(np.array(turn, float), points(), 1)
    with pytest.raises(BadInputError, match='optical frame'):
        fitted_camera(x, y, z)


def test_points_that_are_not_registered_are_refused():
    # rows and columns of another picture
    mixed = points().reshape(3, -1)[:, np.random.default_rng(3).permutation(240 * 135)].reshape(3, 135, 240)
    with pytest.raises(BadInputError, match='registered'):
        fitted_camera(*mixed)
