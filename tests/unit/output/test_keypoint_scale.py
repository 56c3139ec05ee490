"""keypoint_scale means what it means in OpenPose."""
import numpy as np
import pytest

from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams, scale_keypoints

SIZE = (960, 540)
CORNERS = np.array([[[0, 0, 0.9], [959, 539, 0.8], [np.nan, np.nan, 0]]], np.float32)


def scaled(**params):
    return scale_keypoints(CORNERS, SIZE, KeypointScaleParams(**params))


@pytest.mark.parametrize('scale, first, last', [
    (0, (0, 0), (959, 539)),
    # 960 x 540 is fitted into 656 x 368 by its height: 368 / 540
    (1, (0, 0), (959 * 368 / 540, 539 * 368 / 540)),
    # and into 1024 x 1024 by its width
    (2, (0, 0), (959 * 1024 / 960, 539 * 1024 / 960)),
    (3, (0, 0), (1, 1)),
    (4, (-1, -1), (1, 1)),
])
def test_corners_of_the_image(scale, first, last):
    result = scaled(keypoint_scale=scale)
    np.testing.assert_allclose(result[0, 0, :2], first, atol=1e-4)
    np.testing.assert_allclose(result[0, 1, :2], last, rtol=1e-6)
    assert np.isnan(result[0, 2, :2]).all()
    np.testing.assert_array_equal(result[..., 2], CORNERS[..., 2])
