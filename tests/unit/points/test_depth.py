"""Camera geometry and depth images: what is projected comes back, through every distortion model."""
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import XYZRGB, DepthImage, ImageLayout, cloud_from_depth

MATRIX = [540.0, 0, 479.5, 0, 530.0, 269.5, 0, 0, 1]
# A webcam's, a Kinect v2's (as iai_kinect2 publishes it: rational with few terms in use) and a wide fisheye's order of
# magnitude.
DISTORTIONS = {
    'none': ('none', []),
    'plumb_bob 4': ('plumb_bob', [-0.28, 0.08, 0.001, -0.0005]),
    'plumb_bob 5': ('plumb_bob', [0.09, -0.27, 0.0, 0.001, 0.09]),
    'rational': ('rational_polynomial', [0.5, 0.1, 0.0002, -0.0001, 0.01, 0.8, 0.2, 0.03]),
    'equidistant': ('equidistant', [-0.02, 0.003, -0.002, 0.0004]),
}


def camera(name='none', width=960, height=540):
    return CameraModel(width, height, MATRIX, *DISTORTIONS[name])


def window(image, u, v, size=1):
    return image.window(np.array([u]), np.array([v]), size)[0]


@pytest.mark.parametrize('name', DISTORTIONS)
def test_rays_lead_back_to_their_pixels(name):
    u, v = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 959, 9), np.linspace(0, 539, 7)))
    uv = np.stack([u, v], axis=-1)
    rays = camera(name).rays(uv)
    # 0.01 px at 540 px focal length is 0.1 mm at 5 m
    np.testing.assert_allclose(camera(name).project(rays * 3.7), uv, atol=0.01)
    np.testing.assert_array_equal(rays[:, 2], 1)


def test_a_pixel_that_no_ray_reaches_is_nan():
    # with k1 = -0.28 alone the image radius has its greatest value, 0.727, at r = sqrt(1 / (3 * 0.28)) = 1.09
    barrel = CameraModel(960, 540, MATRIX, 'plumb_bob', [-0.28, 0, 0, 0])
    rays = barrel.rays([[479.5 + 540 * 0.70, 269.5], [479.5 + 540 * 0.75, 269.5]])
    assert np.isfinite(rays[0]).all()
    assert np.isnan(rays[1]).all()


@pytest.mark.parametrize('name', DISTORTIONS)
def test_what_is_not_in_front_has_no_pixel(name):
    uv = camera(name).project([[0.1, 0.1, 2], [0, 0, 0], [0.1, 0.1, -2], [np.nan, 0, 1]])
    np.testing.assert_array_equal(np.isfinite(uv).all(axis=1), [True, False, False, False])


def test_a_scaled_camera_sees_the_same_with_corners_kept():
    # a 960 x 540 picture reaches from -0.5 to 959.5; its centre 479.5 is at 239.5 in a picture of half the size
    half = camera('plumb_bob 5').scaled(480, 270)
    point = np.array([[0.4, -0.2, 2.0]])
    expected = (camera('plumb_bob 5').project(point) + 0.5) / 2 - 0.5
    np.testing.assert_allclose(half.project(point), expected, atol=1e-9)
    np.testing.assert_allclose(half.matrix[:2, 2], [239.5, 134.5])
    assert camera().scaled(960, 540).matrix is not None


@pytest.mark.parametrize('change, text', [
    ({'matrix': np.zeros(9)}, 'not calibrated: focal lengths in K are 0 and 0'),
    ({'matrix': [1e-300, *MATRIX[1:]]}, 'fx is 1e-300 px, expected 96 to 96000 px'),
    ({'matrix': [*MATRIX[:5], 1e300, 0, 0, 1]}, 'cy is 1e[+]300 px, far outside'),
    ({'matrix': [-540, *MATRIX[1:]]}, 'not calibrated'),
    ({'matrix': MATRIX[:8]}, 'expected 9'),
    ({'matrix': [np.nan, *MATRIX[1:]]}, 'expected 9 finite'),
    ({'matrix': [540, 3, 480, 0, 540, 270, 0, 0, 1]}, r'expected \[fx 0 cx'),
    ({'distortion_model': 'magic', 'distortion': [0.1] * 5}, "'magic' is unknown; expected one of none, plumb_bob"),
    ({'distortion_model': 'plumb_bob', 'distortion': [0.1] * 3}, '4 or 5 or 8 or 12 or 14 finite values'),
    ({'distortion_model': 'equidistant', 'distortion': [0.1] * 5}, '4 finite values'),
    ({'distortion_model': 'rational_polynomial', 'distortion': [0.1] * 6}, '8 or 12 or 14'),
    ({'distortion_model': '', 'distortion': [0.1] * 5}, 'no finite values'),
    ({'distortion_model': 'plumb_bob', 'distortion': [np.nan] * 5}, '4 or 5 or 8'),
    ({'width': 0}, '0 x 540'),
], ids=lambda value: value if isinstance(value, str) else ','.join(value))
def test_bad_cameras_are_refused(change, text):
    values = {'width': 960, 'height': 540, 'matrix': MATRIX, 'distortion_model': '', 'distortion': []}
    with pytest.raises(BadInputError, match=text):
        CameraModel(**{**values, **change})


@pytest.mark.parametrize('model, distortion, plain, same', [
    ('plumb_bob', [0.1, -0.05, 0.001, 0.002, 0.01, 0, 0, 0], 'plumb_bob', 5),
    ('Plumb Bob', [0.1, -0.05, 0.001, 0.002, 0.01, 0], 'plumb_bob', 5),
    ('plumb_bob', [0.1, -0.05, 0, 0, 0.01, 0.12, -0.04, 0.01], 'rational_polynomial', 8),
    ('RATIONAL_POLYNOMIAL', [0.1, -0.05, 0.001, 0.002, 0.01], 'plumb_bob', 5),
    ('rational-polynomial', [0.1, -0.05, 0, 0, 0.01, 0.12, -0.04, 0.01, 0, 0], 'rational_polynomial', 8),
    ('fisheye', [0.1, -0.02, 0.001, 0, 0], 'equidistant', 4),
    ('KANNALA_BRANDT4', [0.1, -0.02, 0, 0], 'equidistant', 4), ('Inverse Brown Conrady', [0.0] * 5, 'none', 5)])
def test_spellings_and_lengths_of_one_lens(model, distortion, plain, same):
    lenses = (model, distortion), (plain, distortion[:same])
    camera, other = (CameraModel(960, 540, MATRIX, *lens) for lens in lenses)
    points = np.array([[0.4, -0.3, 1.5], [-0.5, 0.2, 1.2]])
    np.testing.assert_allclose(camera.project(points), other.project(points), atol=1e-9)
    np.testing.assert_allclose(camera.rays(camera.project(points)), points / points[:, 2:], atol=1e-4)
    assert camera.distortion_model in ('', 'plumb_bob', 'rational_polynomial', 'equidistant')


@pytest.mark.parametrize('value', [0, -1.5, np.nan, np.inf, -np.inf])
def test_depth_that_is_no_depth_is_missing(value):
    depth = np.full((540, 960), 2, np.float32)
    depth[100, 200] = value
    points = window(DepthImage(depth, camera()), 200, 100, 3)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(points).all(axis=1)), [4])


def as_buffer(depth, padding=0, order='<'):
    height, width = depth.shape
    step = width * depth.itemsize + padding
    data = np.full(height * step, 0xff, np.uint8)
    dtype = depth.dtype.newbyteorder(order)
    np.ndarray((height, width), dtype, data, 0, (step, depth.itemsize))[:] = depth
    return {'data': data.tobytes(), 'width': width, 'height': height, 'step': step, 'is_bigendian': order == '>',
            'encoding': '16UC1' if depth.itemsize == 2 else '32FC1'}


def from_buffer(data, **layout):
    return DepthImage.from_buffer(data, ImageLayout(**layout), camera())


@pytest.mark.parametrize('dtype, unit', [(np.uint16, 0.001), (np.float32, 1.0)], ids=['16UC1', '32FC1'])
@pytest.mark.parametrize('padding', [0, 14])
@pytest.mark.parametrize('order', ['<', '>'])
def test_buffers_of_every_layout_are_read(dtype, unit, padding, order):
    depth = (1 + np.arange(9 * 16).reshape(9, 16)).astype(dtype)
    image = from_buffer(**as_buffer(depth, padding, order))
    v, u = (grid.ravel() for grid in np.mgrid[:9, :16])
    np.testing.assert_allclose(image.window(u, v, 1)[:, 0, 2], depth.ravel() * unit)


@pytest.mark.parametrize('change, text', [
    ({'encoding': 'rgb8'}, "encoding 'rgb8', expected one of 16UC1, mono16, 32FC1"),
    ({'width': 0}, '0 x 9'),
    ({'step': 31}, 'row_step of the depth image is 31 bytes, expected at least 32'),
    ({'data': b'12'}, 'truncated: 2 bytes, expected 288'),
    ({'height': 8, 'width': 10}, '10 x 8'),
    ({'height': 1, 'width': 1}, 'depth image is 1 x 1, expected at least 2 x 2'),
    ({'height': 1}, 'depth image is 16 x 1, expected'),
], ids=lambda value: value if isinstance(value, str) else ','.join(value))
def test_bad_buffers_are_refused(change, text):
    with pytest.raises(BadInputError, match=text):
        from_buffer(**{**as_buffer(np.ones((9, 16), np.uint16)), **change})


@pytest.mark.parametrize('rays', [False, True])
@pytest.mark.parametrize('name', ['none', 'plumb_bob 5'])
def test_a_cloud_from_depth_has_the_layout_of_a_kinect_driver(name, rays):
    small = camera(name).scaled(96, 54)
    depth, bgr = np.full((54, 96), 2.0), np.zeros((54, 96, 3), np.uint8)
    depth[0, 0], depth[0, 1], bgr[5, 7] = 0, np.inf, (1, 2, 3)
    cloud = cloud_from_depth(depth, small, bgr, small.ray_grid() if rays else None)
    assert (cloud.shape, cloud.dtype.itemsize) == ((54, 96), 32)
    assert [XYZRGB.fields[name][1] for name in ('x', 'y', 'z', 'rgb')] == [0, 4, 8, 16]
    assert cloud['rgb'][5, 7] == 0x030201
    assert np.isnan(cloud['x'][0, :2]).all()
    assert np.isnan(cloud['z']).sum() == 2
    point = [[cloud[axis][5, 7] for axis in 'xyz']]
    np.testing.assert_allclose(small.project(point), [[7, 5]], atol=0.01)
