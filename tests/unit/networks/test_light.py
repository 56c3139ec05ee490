"""Light: what networks see of dark and noisy images."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.detect.views import View
from openpose_ros_pkg.networks.light import LIGHT, lit, noise_of
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN
from openpose_ros_pkg.networks.preprocess import ImageToNet

RAMP = np.broadcast_to(np.linspace(0, 1, 320)[None, :, None], (240, 320, 3))


def image_of(brightest: float, noise: float = 0.0) -> np.ndarray:
    exact = RAMP * brightest + noise * np.random.default_rng(0).standard_normal(RAMP.shape)
    return np.clip(np.rint(exact), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('shape', [(1, 1, 3), (1, 2, 3), (240, 320, 3)])
def test_black_stays_black(shape):
    assert not lit(np.zeros(shape, np.uint8)).any()


@pytest.mark.parametrize('noise', [0.0, 12.0])
def test_an_image_that_is_not_dark_stays_as_it_is(noise):
    bright = image_of(1.1 * LIGHT.dark, noise)
    assert lit(bright) is bright


@pytest.mark.parametrize('brightest, gain', [(105, 2.23), (70, 3.35), (20, LIGHT.most_gain)])
def test_a_dark_image_gets_a_gain(brightest, gain):
    dark = image_of(brightest)
    before = dark.copy()
    np.testing.assert_allclose(lit(dark), dark * gain, atol=1 + 0.01 * gain * brightest)
    np.testing.assert_array_equal(dark, before)


@pytest.mark.parametrize('noise', [2.0, 5.0, 12.0])
def test_noise_is_measured_beside_what_the_image_shows(noise):
    assert noise_of(np.clip(image_of(150, noise) + 50, 0, 255)) == pytest.approx(noise, rel=0.15)


def test_noise_of_a_dark_image_counts_after_the_gain():
    few = 0.6 * LIGHT.noise
    dark = image_of(60, few)
    assert noise_of(lit(dark)) < 0.5 * LIGHT.most_gain * noise_of(dark)


@pytest.mark.parametrize('wanted', [False, True])
def test_networks_that_want_it_see_lit_inputs(wanted):
    dark, size = image_of(60), (160, 120)
    view = View(ImageToNet((320, 240), size, size))
    seen, plain = (view.prepare(dark, replace(MOBILENET_THIN.input, lit=of)).input for of in (wanted, False))
    np.testing.assert_array_equal(seen, lit(plain) if wanted else plain)
    assert (seen.max() > 200) == wanted
