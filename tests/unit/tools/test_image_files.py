"""Image files: all types there and back without a changed bit, depth in other units, what is refused."""
import cv2
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.images.image_files import (
    decode_depth,
    decode_image,
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


def test_depth_that_does_not_fit_16_bits_is_refused():
    with pytest.raises(BadInputError, match=r'20\.000 m does not fit .* reach 13.107 m'):
        depth_to_units(np.array([[1, 20]], np.float32), 5000.0, 'test')


def test_depth_of_another_type_is_refused():
    for wrong in (np.zeros((2, 2), np.uint8), np.zeros((2, 2, 3), np.uint16)):
        with pytest.raises(BadInputError, match='one channel of uint16 or float32'):
            decode_depth(encode_image(wrong, '.png', 'test'), 'test')


def test_a_float_image_is_no_colour():
    with pytest.raises(BadInputError, match='float32'):
        decode_image(cv2.imencode('.tiff', np.zeros((2, 2), np.float32))[1].tobytes(), 'test')
