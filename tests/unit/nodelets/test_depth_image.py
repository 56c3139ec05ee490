"""Depth images of clouds: each valid depth, to half a millimetre; what is no depth is missing or refused."""
import numpy as np
import pytest

from openpose_ros_nodelets.depth_image import depth_pixels
from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.cloud import OrganizedCloud

# Depths of the first pixels [m], and what they become in millimetres.
DEPTHS = {np.nan: 0, np.inf: 0, -np.inf: 0, 0.0: 0, -1.0: 0, 0.0004: 0, 0.001: 1, 1.2344: 1234, 65.535: 65535, 65.6: 0}


def cloud(depths):
    z = np.full((6, 8), 2.0, np.float32)
    z.flat[:len(depths)] = depths
    return OrganizedCloud(z * 0.1, z * 0.2, z)


def test_millimetres_and_metres():
    pixels = depth_pixels(cloud(list(DEPTHS)), '16UC1')
    assert pixels.dtype == np.uint16 and pixels.flat[:len(DEPTHS)].tolist() == list(DEPTHS.values())
    assert set(pixels.flat[len(DEPTHS):]) == {2000}
    metres = depth_pixels(cloud(list(DEPTHS)), '32FC1')
    assert metres.dtype == np.float32
    np.testing.assert_array_equal(metres.flat[:len(DEPTHS)], np.float32(
        [depth if 0 < depth < np.inf else np.nan for depth in DEPTHS]))


@pytest.mark.parametrize('depth, text', [(np.nan, 'no depth'), (0.0, 'no depth'), (3000.0, 'is it in millimetres')])
def test_what_is_no_depth_in_metres_is_refused(depth, text):
    with pytest.raises(BadInputError, match=text):
        depth_pixels(cloud(48 * [depth]), '16UC1')
