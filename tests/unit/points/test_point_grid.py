"""What clouds and depth images answer alike: depths at pixels, the camera, the range."""
import numpy as np
import pytest

from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import DepthImage

W, H = 96, 54
CAMERA = CameraModel(W, H, [54.0, 0, 45.5, 0, 53.0, 27.5, 0, 0, 1])


def metres():
    """Return depths [m] that name their pixel: 1 + u / 100 + v / 10."""
    v, u = np.mgrid[:H, :W]
    return 1 + u / 100 + v / 10


def millimetre_image(z):
    return DepthImage(np.round(np.where(np.isfinite(z) & (z > 0), z, 0) * 1000).astype(np.uint16), CAMERA)


def metre_image(z):
    return DepthImage(z.astype(np.float32), CAMERA)


def cloud(z):
    return OrganizedCloud(*(CAMERA.ray_grid() * z[..., None]).astype(np.float32).transpose(2, 0, 1))


KINDS = pytest.mark.parametrize('kind', [millimetre_image, metre_image, cloud])


@KINDS
def test_depths_are_those_of_the_pixels_in_any_shape(kind):
    u, v = np.array([[[0, 95, 0], [95, 17, 17]]]), np.array([[[0, 0, 53], [53, 31, 30]]])
    depths = kind(metres()).depths(u, v)
    assert depths.dtype == np.float64
    np.testing.assert_allclose(depths, 1 + u / 100 + v / 10, atol=1e-6)


def test_the_camera_of_a_depth_image_is_scaled_to_it_and_needs_no_depth():
    image = DepthImage(np.zeros((H, W), np.uint16), CAMERA.scaled(2 * W, 2 * H))
    np.testing.assert_allclose(image.camera_model().matrix, CAMERA.matrix)
