"""Light: what networks see of a dark and noisy image."""
from dataclasses import dataclass

import cv2
import numpy as np

from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class LightConstants:
    """How dark inputs are brightened, and noisy ones smoothed."""

    share: float = constant(98.0, 'Percentile of the brightest channel that tells how bright an input is.', unit='%')
    dark: float = constant(
        110.0, 'Inputs below are dark; others stay as they are, as a smaller gain helps nothing.', unit='levels')
    bright: float = constant(230.0, 'Value to which a gain brings it.', unit='levels')
    most_gain: float = constant(4.0, 'Greatest gain.')
    noise: float = constant(4.0, 'Dark inputs with more noise, after the gain, are smoothed.', unit='levels')
    sigma: float = constant(0.8, 'Standard deviation of the Gaussian that smooths them.', unit='px')
    step: int = constant(4, 'One pixel in as many, along an axis, tells of an input.', unit='px')


LIGHT = LightConstants()


def lit(image: np.ndarray, constants: LightConstants = LIGHT) -> np.ndarray:
    """Return the input of a network, (H, W, 3) uint8; a dark one brighter, and smoother if it is noisy then."""
    top = float(np.percentile(image[::constants.step, ::constants.step].max(axis=2), constants.share))
    if top >= constants.dark:
        return image
    image = cv2.convertScaleAbs(image, alpha=min(constants.bright / max(top, 1.0), constants.most_gain))
    return cv2.GaussianBlur(image, (0, 0), constants.sigma) if noise_of(image, constants) > constants.noise else image


def noise_of(image: np.ndarray, constants: LightConstants = LIGHT) -> float:
    """Return the standard deviation of the noise of an image, (H, W, 3) uint8, by second differences [levels]."""
    rows = image[::constants.step, :, 1].astype(np.int16)
    second = (2 * rows[:, 1:-1] - rows[:, :-2] - rows[:, 2:])[:, ::constants.step]
    # the median of absolute values is 0.6745 standard deviations, the second difference of noise has sqrt(6) times more
    return float(np.median(np.abs(second))) / (0.6745 * np.sqrt(6)) if second.size else 0.0
