"""Depth cameras on known planes and steps."""
import numpy as np
import pytest

from development.benchmark_data.rendering.depth_sensors import SENSORS, KinectV2, Stereo, StructuredLight
from development.benchmark_data.rendering.renderer import Frame

SIZE = (220, 280)


def frame_of(depth, dark=False, cosine=1.0):
    depth = np.asarray(depth, float)
    return Frame(np.zeros((*depth.shape, 3)), depth, np.zeros(depth.shape, int), np.full(depth.shape, cosine),
                 np.full(depth.shape, dark))


def measure(sensor, depth, raw=0.5, **frame):
    """Return the measured depth [m] of a plane, or of an image, NaN where it is invalid."""
    image = np.full(SIZE, depth) if np.isscalar(depth) else depth
    camera = SENSORS[sensor](540.0, seed=3)
    camera.raw = raw  # of stereo cameras
    measured = camera.measure(frame_of(image, **frame))
    assert measured.dtype == np.uint16 and measured.shape == image.shape
    return np.where(measured > 0, measured / 1000.0, np.nan)


@pytest.mark.parametrize('sensor', SENSORS)
def test_where_nothing_is_hit_nothing_is_measured(sensor):
    assert np.isnan(measure(sensor, 0.0)).all()


@pytest.mark.parametrize('sensor', SENSORS)
@pytest.mark.parametrize('depth', [0.2, 15.0])
def test_out_of_range(sensor, depth):
    assert np.isnan(measure(sensor, depth)).all()


@pytest.mark.parametrize('depth', [1.5, 3.0, 4.5])
@pytest.mark.parametrize('sensor', [KinectV2, StructuredLight, Stereo])
def test_noise_has_the_stated_size_and_no_bias(sensor, depth):
    """Quantisation adds step^2 / 12; waves of the stereo camera leave few independent samples, so its tolerance is
    that of about 200 of them."""
    errors = measure(sensor.name, depth) - depth
    if sensor is KinectV2:
        step = 2.0 ** np.floor(np.log2(max(sensor.STORAGE_STEP * 1e3 * sensor.sigma(depth), 1))) / 1e3
    else:
        step = depth ** 2 * sensor.model.step / (sensor.model.focal * sensor.model.baseline)
    expected = np.sqrt(sensor.sigma(depth) ** 2 + max(step, 1e-3) ** 2 / 12)
    tolerance = 0.2 if sensor is Stereo else 0.08
    assert np.nanstd(errors) == pytest.approx(expected, rel=tolerance)
    assert abs(np.nanmean(errors)) < (0.35 if sensor is Stereo else 0.1) * expected + 0.06 * expected * depth / 4


def test_structured_light_measures_steps_of_an_eighth_of_a_pixel():
    model = StructuredLight.model
    disparity = model.focal * model.baseline / measure('xtion', 4.0)
    off = np.abs(disparity / model.step - np.round(disparity / model.step))
    assert np.nanmax(off) < 0.03  # millimetres are 0.02 of a step there
    values = np.unique(np.round(1000 * measure('xtion', 4.0)))
    step = 1000 * 4.0 ** 2 * model.step / (model.focal * model.baseline)
    assert np.diff(values[np.isfinite(values)]).min() == pytest.approx(step, rel=0.15)


def test_stereo_planes_are_wavy_and_the_waves_stay():
    """Errors of neighbours eight pixels apart, and of one pixel in two frames, go together."""
    sensor = Stereo(540.0, seed=1)
    one, two = (np.where(image > 0, image / 1000 - 3.0, np.nan) for image in (
        sensor.measure(frame_of(np.full(SIZE, 3.0))) for _ in range(2)))

    def correlation(a, b):
        known = np.isfinite(a) & np.isfinite(b)
        return np.corrcoef(a[known], b[known])[0, 1]

    assert correlation(one[:, 8:], one[:, :-8]) > 0.2
    assert 0.2 < correlation(one, two) < 0.8
    kinect = KinectV2(540.0, seed=1).measure(frame_of(np.full(SIZE, 3.0))) / 1000.0
    assert abs(np.corrcoef(kinect[:, 8:].ravel(), kinect[:, :-8].ravel())[0, 1]) < 0.05


def test_holes_of_the_stereo_camera():
    assert 0.25 * Stereo.HOLES < np.isnan(measure('realsense', 2.0, raw=1)).mean() < 4 * Stereo.HOLES
    assert not np.isnan(measure('realsense', 4.0, raw=0)).any()
    assert np.isnan(measure('realsense', 4.0, raw=1)).mean() > 0.4
    assert np.isnan(measure('realsense', 2.0, dark=True)).mean() > 2 * np.isnan(measure('realsense', 2.0)).mean()


@pytest.mark.parametrize('sensor', SENSORS)
def test_dark_and_grazed_surfaces_are_lost(sensor):
    plain = np.isnan(measure(sensor, 2.0)).mean()
    assert np.isnan(measure(sensor, 2.0, dark=True)).mean() > plain + 0.05
    assert np.isnan(measure(sensor, 2.0, cosine=0.05)).mean() > plain + 0.3


@pytest.mark.parametrize(('sensor', 'baseline', 'most'), [
    ('kinect_v2', KinectV2.BASELINE, 8), ('xtion', StructuredLight.model.baseline, 40),
    ('realsense', Stereo.model.baseline, 40)])
def test_holes_at_edges_and_shadow_on_the_left(sensor, baseline, most):
    """A board at 1.2 m before a wall at 2 m: the wall is hidden from the second view on the left of the board, over
    f B (1 / near - 1 / far) pixels."""
    depth = np.full(SIZE, 2.0)
    depth[60:200, 120:220] = 1.2
    holes = np.isnan(measure(sensor, depth))
    width = min(540.0 * baseline * (1 / 1.2 - 1 / 2.0), most)
    assert holes[80:180, round(120 - width + 1):118].mean() > 0.95
    assert holes[80:180, :100].mean() < 0.1 and holes[80:180, 150:190].mean() < 0.1
    right = holes[80:180, 217:223].mean()
    assert 0.15 < right < 0.9


def test_kinect_has_flying_pixels_between_near_and_far():
    depth = np.full(SIZE, 3.0)
    depth[:, 160:] = 1.5
    edge = measure('kinect_v2', depth)[:, 157:163]
    assert ((edge > 1.7) & (edge < 2.8)).mean() > 0.05
