"""The colour camera: exposure, vignetting, blur, shot and read noise."""
from typing import NamedTuple

import cv2
import numpy as np


class Exposure(NamedTuple):
    """Brightness factor, and factor of the noise (a camera's gain in dim light)."""

    brightness: float = 1.0
    gain: float = 1.0


class ColorCamera:
    """Turns exact colours into images."""

    MARGIN = 64  # [px] a noise field is larger by that; each frame takes another part of it

    def __init__(self, height: int, width: int, exposure: Exposure, seed: int) -> None:
        self.rng, self.exposure = np.random.default_rng(seed), exposure
        u, v = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
        self.vignette = ((1 - 0.10 * (u * u + 0.5 * v * v)) * exposure.brightness).astype(np.float32)[..., None]
        size = (height + self.MARGIN, width + self.MARGIN)
        self.gray = self.rng.standard_normal((*size, 1), np.float32)
        self.colored = self.rng.standard_normal((*size, 3), np.float32)

    def _part(self, field: np.ndarray) -> np.ndarray:
        top, left = self.rng.integers(0, self.MARGIN, 2)
        return field[top:top + self.vignette.shape[0], left:left + self.vignette.shape[1]]

    def take(self, color: np.ndarray) -> np.ndarray:
        """Return the (H, W, 3) uint8 BGR image of (H, W, 3) float RGB 0..1."""
        image = cv2.GaussianBlur(color.astype(np.float32) * self.vignette, (0, 0), 0.55)
        image = cv2.pow(np.clip(image, 0, 1), 1 / 1.12) * 255
        noise = self._part(self.gray) * (1.0 + 0.06 * np.sqrt(image)) + 0.7 * self._part(self.colored)
        return np.clip(image + self.exposure.gain * noise, 0, 255).astype(np.uint8)[..., ::-1]
