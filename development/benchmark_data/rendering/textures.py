"""Procedural textures: (h, w, 3) float32 RGB 0..1."""
from typing import Sequence, Tuple

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter


def _image(values: np.ndarray) -> np.ndarray:
    return np.clip(values, 0, 255).astype(np.float32) / 255


def plain(rng: np.random.Generator, color: Sequence[float], amplitude: float = 5, size: int = 256, blur: float = 6
          ) -> np.ndarray:
    cloud = gaussian_filter(rng.normal(0, 1, (size, size)), blur, mode='wrap')
    return _image(np.array(color, float) + amplitude * (cloud / cloud.std())[..., None]
                  + rng.normal(0, 2, (size, size, 1)))


def wood(rng: np.random.Generator, color: Sequence[float], size: int = 256) -> np.ndarray:
    grain = gaussian_filter(rng.normal(0, 1, (size, size)), (1.2, 30), mode='wrap')
    return _image(np.array(color, float) * (1 + 0.10 * (grain / grain.std())[..., None]))


def floor(rng: np.random.Generator, size: int = 512) -> Tuple[str, np.ndarray]:
    """Return a kind of floor and its texture."""
    kind = str(rng.choice(['planks', 'tiles', 'carpet']))
    image = np.zeros((size, size, 3))
    if kind == 'carpet':
        clouds = cv2.GaussianBlur(rng.normal(0, 120, (size, size)), (0, 0), 9)[..., None]
        image = rng.uniform(70, 150, 3) + rng.normal(0, 12, (size, size, 1)) + clouds
    elif kind == 'tiles':
        color = rng.uniform(130, 205, 3) * 0.3 + rng.uniform(110, 200) * 0.7
        for i in range(0, size, 128):
            for j in range(0, size, 128):
                image[i:i + 128, j:j + 128] = color + rng.normal(0, 7)
        image[::128] = image[1::128] = image[:, ::128] = image[:, 1::128] = color * 0.65
    else:
        color = np.array([rng.uniform(120, 185), rng.uniform(90, 140), rng.uniform(60, 100)])
        for i in range(0, size, 32):
            start = rng.integers(0, size)
            for j in range(3):
                image[i:i + 32, (np.arange(j * 171, (j + 1) * 171) + start) % size] = color * rng.uniform(0.82, 1.08)
            image[i] *= 0.6
        image += 6 * cv2.GaussianBlur(rng.normal(0, 5, (size, size)), (0, 0), sigmaX=20, sigmaY=1)[..., None]
    return kind, _image(image)


def poster(rng: np.random.Generator, size: int = 192) -> np.ndarray:
    image = np.zeros((size, size, 3)) + rng.uniform(40, 235, 3)
    for _ in range(rng.integers(4, 14)):
        color = tuple(float(value) for value in rng.uniform(20, 240, 3))
        kind, (x1, y1, x2, y2) = rng.integers(0, 4), (int(value) for value in rng.integers(0, size, 4))
        if kind == 0:
            cv2.rectangle(image, (x1, y1), (x2, y2), color, -1)
        elif kind == 1:
            cv2.circle(image, (x1, y1), int(rng.integers(5, 45)), color, -1)
        elif kind == 2:
            cv2.line(image, (x1, y1), (x2, y2), color, int(rng.integers(1, 9)))
        else:
            for line in range(int(rng.integers(3, 8))):
                cv2.line(image, (x1, y1 + 9 * line), (x1 + int(rng.integers(20, 70)), y1 + 9 * line), color, 3)
    image[:5] = image[-5:] = image[:, :5] = image[:, -5:] = rng.choice([25, 240])
    return _image(image)
