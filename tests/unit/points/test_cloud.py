"""An organized cloud is read in place, whatever its layout; bad layouts are refused with both values."""
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.cloud import CloudLayout, OrganizedCloud, coordinate_views

W, H = 7, 5
FIELDS = {'x': (0, 'float32'), 'y': (4, 'float32'), 'z': (8, 'float32'), 'rgb': (16, 'float32')}


def truth(width=W, height=H):
    """Points that name their own pixel: (u, v, 1 + u + 10 v)."""
    v, u = np.mgrid[:height, :width].astype(np.float64)
    return np.stack([u, v, 1 + u + 10 * v], axis=-1)


def packed(points, offsets=(0, 4, 8), datatype='f4', order='<', point_step=32, padding=0):
    """Write points as the data of a PointCloud2, other bytes filled with 0xff."""
    height, width = points.shape[:2]
    row_step = width * point_step + padding
    data = np.full(height * row_step, 0xff, np.uint8)
    for axis, offset in enumerate(offsets):
        np.ndarray((height, width), order + datatype, data, offset, (row_step, point_step))[:] = points[..., axis]
    name = {'f4': 'float32', 'f8': 'float64'}[datatype]
    return {'data': data.tobytes(), 'width': width, 'height': height, 'point_step': point_step, 'row_step': row_step,
            'fields': {axis: (offset, name) for axis, offset in zip('xyz', offsets)}, 'is_bigendian': order == '>'}


def from_buffer(data, **layout):
    return OrganizedCloud(*coordinate_views(data, CloudLayout(**layout)))


def all_points(cloud):
    v, u = (grid.ravel() for grid in np.mgrid[:cloud.height, :cloud.width])
    return cloud.window(u, v, 1).reshape(cloud.height, cloud.width, 3)


@pytest.mark.parametrize('layout', [
    {},
    {'padding': 24},
    {'offsets': (20, 4, 12)},
    {'offsets': (1, 7, 13), 'point_step': 17},
    {'order': '>'},
    {'datatype': 'f8', 'offsets': (0, 8, 16)},
    {'datatype': 'f8', 'offsets': (16, 0, 8), 'order': '>', 'padding': 3},
    {'point_step': 12},
], ids=['usual', 'padded rows', 'any offsets', 'unaligned', 'big-endian', 'float64', 'all at once', 'x y z only'])
def test_every_layout_gives_the_same_points(layout):
    cloud = from_buffer(**packed(truth(), **layout))
    assert (cloud.width, cloud.height) == (W, H)
    np.testing.assert_array_equal(all_points(cloud), truth())


def test_nothing_is_copied():
    layout = packed(truth())
    layout['data'] = bytearray(layout['data'])
    cloud = from_buffer(**layout)
    layout['data'][8:12] = np.float32(42).tobytes()
    assert cloud.window(np.array([0]), np.array([0]), 1)[0, 0, 2] == 42


@pytest.mark.parametrize('point', [(np.nan, 1, 1), (1, np.nan, 1), (1, 1, np.nan), (np.inf, 1, 1), (1, -np.inf, 1),
                                   (0, 0, 0)], ids=str)
def test_a_point_that_is_not_finite_or_the_origin_is_missing(point):
    points = truth()
    points[2, 3] = point
    found = all_points(from_buffer(**packed(points)))
    assert np.isnan(found[2, 3]).all()
    found[2, 3] = truth()[2, 3]
    np.testing.assert_array_equal(found, truth())


@pytest.mark.parametrize('change, text', [
    ({'width': 0}, '0 x 5'),
    ({'height': 0}, '7 x 0'),
    ({'width': W * H, 'height': 1, 'row_step': W * H * 32}, 'not organized: width 35, height 1'),
    ({'width': 1, 'height': W * H, 'row_step': 32}, 'not organized: width 1, height 35'),
    ({'row_step': W * 32 - 1}, r'row_step of the cloud is 223 bytes, expected at least 224 .*32 bytes'),
    ({'height': H + 1}, 'truncated: 1120 bytes, expected 1344'),
    ({'data': b''}, 'truncated: 0 bytes, expected 1120'),
    ({'fields': {}}, 'no field x, y, z; its fields are: none'),
    ({'fields': {'x': (0, 'float32'), 'z': (8, 'float32'), 'rgb': (16, 'uint32')}}, 'no field y.*x, z, rgb'),
    ({'fields': {**FIELDS, 'z': (30, 'float32')}}, r"'z' .* bytes 30 \.\. 34 .* point_step is 32"),
    ({'fields': {**FIELDS, 'y': (26, 'float64')}}, r"'y' .* bytes 26 \.\. 34"),
    ({'fields': {**FIELDS, 'x': (0, 'int16')}}, "'x' .* is int16, expected float32 or float64"),
], ids=lambda value: value if isinstance(value, str) else ','.join(value))
def test_bad_layouts_are_refused_with_actual_and_expected_value(change, text):
    with pytest.raises(BadInputError, match=text):
        from_buffer(**{**packed(truth()), **change})


def test_coordinates_of_different_shape_are_refused():
    with pytest.raises(BadInputError, match='three equal'):
        OrganizedCloud(np.ones((4, 4)), np.ones((4, 4)), np.ones((4, 5)))
