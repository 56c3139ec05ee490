"""Image files: all types there and back without a changed bit, depth in other units, what is refused."""
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.images.image_files import (
    decode_depth,
    depth_to_metres,
    depth_to_units,
    encode_image,
)


@pytest.mark.parametrize('units', [1000.0, 5000.0])
def test_all_units_come_back_from_metres(units):
    every = np.arange(65536, dtype=np.uint16).reshape(256, 256)
    metres = depth_to_metres(every, units)
    assert metres.dtype == np.float32
    assert np.isnan(metres[0, 0])
    np.testing.assert_array_equal(depth_to_units(metres, units, 'test'), every)


def test_depth_is_rounded_and_what_is_missing_is_0():
    depth = np.array([[1.0004, np.nan, 0.0, -1.0, np.inf, 2.0]], np.float32)
    assert depth_to_units(depth, 1000.0, 'test').tolist() == [[1000, 0, 0, 0, 0, 2000]]


@pytest.mark.parametrize('read, expected', [
    (lambda: depth_to_units(np.array([[1, 20]], np.float32), 5000.0, 'test'), r'20\.000 m does not fit .* 13.107 m'),
    (lambda: decode_depth(encode_image(np.zeros((2, 2), np.uint8), '.png', 'test'), 'test'), 'uint16 or float32')])
def test_what_can_not_be_is_refused(read, expected):
    with pytest.raises(BadInputError, match=expected):
        read()
