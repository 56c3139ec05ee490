"""Cameras that are mounted upside down or on their side, turned at the input."""
import numpy as np
import pytest

from openpose_ros_pkg.calibration import Calibration, turned
from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.camera import calibrated_camera
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.transform import quarter_turns

DISTORTIONS = {'plumb_bob': (0.1, -0.05, 0.01, -0.02, 0.003), 'Kannala-Brandt': (0.1, -0.01, 0.002, 0.001),
               'rational_polynomial': (0.1, -0.05, 0.01, -0.02, 0.003, 0.02, 0.001, 0, 0.01, -0.004, 0.006, 0.002)}
WHOLE, PART = (0, 0, 0, 0, False), (20, 10, 60, 80, False)
K, P = (150, 0, 70, 0, 140, 65, 0, 0, 1), (151, 0, 71, -15, 0, 141, 66, 3, 0, 0, 1, 0)
UNTURNED = (1, 0, 0, 0, 1, 0, 0, 0, 1)


@pytest.mark.parametrize('degrees', [90, 180, 270])
@pytest.mark.parametrize('rectified', [False, True])
@pytest.mark.parametrize('region, binning', [(WHOLE, (1, 1)), (PART, (1, 1)), (PART, (2, 1))], ids=str)
@pytest.mark.parametrize('model', [*DISTORTIONS, 'none'])
def test_a_turned_pixel_has_the_turned_ray(degrees, rectified, region, binning, model):
    calibration = Calibration(160, 120, model, DISTORTIONS.get(model, ()), K, UNTURNED, P, '', binning, region)
    level = turned(calibration, degrees)
    width, height = calibration.image_size
    assert level.image_size == ((height, width) if degrees % 180 else (width, height))
    v, u = np.mgrid[:height:13, :width:17]
    pixels = np.stack([u.ravel(), v.ravel()], axis=-1)
    number = np.rot90(np.arange(height * width).reshape(height, width), -degrees // 90)  # of each pixel before
    places = np.argsort(number.ravel())[pixels @ (1, width)]
    before = calibrated_camera(calibration, rectified).rays(pixels)
    places = np.stack([places % number.shape[1], places // number.shape[1]], axis=-1)
    after = calibrated_camera(level, rectified).rays(places)
    np.testing.assert_allclose(after, before @ quarter_turns(degrees).T, atol=1e-6)


def test_what_can_not_be_turned():
    calibration = Calibration(160, 120, 'plumb_bob', (), (0,) * 9, (0,) * 9, (0,) * 12)
    assert turned(calibration, 180) == calibration, 'not calibrated'
    tilted = Calibration(160, 120, 'rational_polynomial', (0,) * 12 + (0.1, 0), K, UNTURNED, P)
    with pytest.raises(BadInputError, match='tilted'):
        turned(tilted, 180)


@pytest.mark.parametrize('degrees', [90, 180, 270])
def test_a_turned_cloud_is_that_of_the_turned_camera(degrees):
    v, u = np.mgrid[:48, :64].astype(np.float32)
    z = 2 + 0.01 * u + 0.02 * v
    cloud = OrganizedCloud((u - 30) / 50 * z, (v - 20) / 55 * z, z)
    level = cloud.turned(degrees)
    camera = level.camera_model()
    assert (camera.width, camera.height) == ((48, 64) if degrees % 180 else (64, 48))
    assert np.diag(camera.matrix)[:2] == pytest.approx((55, 50) if degrees % 180 else (50, 55), rel=1e-4)
    corner = cloud.window(np.array([0]), np.array([0]), 1)[0, 0]
    place = {90: (47, 0), 180: (63, 47), 270: (0, 63)}[degrees]
    found = level.window(*np.array(place)[:, None], 1)[0, 0]
    np.testing.assert_allclose(found, quarter_turns(degrees) @ corner, atol=1e-6)
