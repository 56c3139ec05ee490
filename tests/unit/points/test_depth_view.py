"""Depth for the detection of people in the image: the same view on a coarser grid."""
import numpy as np
import pytest

from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.depth_view import depth_view


def camera(width, height):
    return CameraModel(width, height, [0.6 * width, 0, width / 2, 0, 0.6 * width, height / 2, 0, 0, 1])


def slope(width, height):
    """Return depths [m] that name their place in the view: 2 + x / 10 + y / 100, x and y from 0 to 1."""
    v, u = np.mgrid[:height, :width] + 0.5
    return 2 + u / width / 10 + v / height / 100


def image(z):
    return DepthImage(z.astype(np.float32), camera(*z.shape[::-1]))


def cloud(z):
    return OrganizedCloud(*(camera(*z.shape[::-1]).ray_grid() * z[..., None]).astype(np.float32).transpose(2, 0, 1))


@pytest.mark.parametrize('kind', [image, cloud])
@pytest.mark.parametrize('size', [(1920, 1080), (960, 540), (512, 424), (641, 479), (97, 31)])
def test_each_cell_has_the_depth_of_its_place_in_the_view(kind, size):
    view = depth_view(kind(slope(*size)))
    height, width = view.depth.shape
    assert max(width, height) <= 480 and view.depth.dtype == np.float32
    pixel = max(0.1 / size[0], 0.01 / size[1])
    np.testing.assert_allclose(view.depth, slope(width, height), atol=pixel)
    assert view.focal == pytest.approx(0.6 * width, rel=1e-3)


@pytest.mark.parametrize('points', [
    OrganizedCloud.without_points(64, 48), image(np.zeros((48, 64))), image(1000 * slope(64, 48)),
    OrganizedCloud(*np.random.default_rng(0).uniform(1, 2, (3, 48, 64)).astype(np.float32))],
    ids=['cloud without points', 'no depth', 'millimetres', 'not of a camera'])
def test_what_is_no_depth_of_a_camera_gives_none(points):
    assert depth_view(points) is None
