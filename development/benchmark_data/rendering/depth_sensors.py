"""Depth cameras: what each makes of exact depth. README.md names the sources and what is left out.

All take depth [m] in the colour image's pixels (0: nothing) and return uint16 [mm], 0 for invalid.
"""
import abc
from typing import Dict, NamedTuple, Tuple, Type, Union

import cv2
import numpy as np
from scipy.special import ndtri

from .camera import Intrinsics
from .renderer import Frame

FAR = 20.0  # [m] stands for nothing


class SensorModel(NamedTuple):
    """A triangulating sensor: focal length [px], baseline [m], smallest disparity step [px], range [m]."""

    focal: float
    baseline: float
    step: float
    nearest: float
    farthest: float


class DepthSensor(abc.ABC):
    """Base of the sensors. Keeps its random numbers and what stays the same from frame to frame."""

    name = ''
    intrinsics: Intrinsics

    def __init__(self, fx: float, seed: int) -> None:
        """fx: focal length of the images that are measured [px]."""
        self.fx, self.rng = fx, np.random.default_rng(seed)

    @abc.abstractmethod
    def measure(self, frame: Frame) -> np.ndarray:
        """Return (H, W) uint16 depth [mm]."""

    def smooth_noise(self, size: Tuple[int, int], sigma: float) -> np.ndarray:
        """Return a normal field with variance 1 whose values go together over about sigma pixels."""
        scale = max(int(sigma / 2), 1)
        small = self.rng.standard_normal([int(np.ceil(n / scale)) + 8 for n in size]).astype(np.float32)
        small = cv2.GaussianBlur(small, (0, 0), sigma / scale)
        small /= small.std()
        field = cv2.resize(small, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR) if scale > 1 else small
        top, left = self.rng.integers(0, 4, 2)
        return field[top:top + size[0], left:left + size[1]]


class KinectV2(DepthSensor):
    """Time of flight, registered to the colour image by nearest neighbour.

    Noise 1.5 mm + 1.8 mm (z / 2 m)^2, times cos(incidence)^-0.7; once per infrared pixel (f = 365 px).
    """

    name = 'kinect_v2'
    intrinsics = Intrinsics(960, 540, 540.686, 540.686, 479.75, 269.75)
    INFRARED_FOCAL = 365.0  # [px]
    BASELINE = 0.052  # [m] infrared to colour camera
    NEAREST, FARTHEST = 0.5, 8.0  # [m]
    DROPOUT = 0.15  # of hair and black material
    GRAZING, GRAZING_DROPOUT = 0.10, 0.6  # cosine of incidence
    STORAGE_STEP = 1.6  # largest step of stored depth [sigma]: adds at most 0.46 sigma, and halves the files

    @staticmethod
    def sigma(depth: np.ndarray, cosine: Union[np.ndarray, float] = 1.0) -> np.ndarray:  # a constant
        """Return the standard deviation of a measurement [m]."""
        return (1.5e-3 + 1.8e-3 * (depth / 2) ** 2) * np.minimum(1 / np.maximum(cosine, 0.25), 4) ** 0.7

    def measure(self, frame: Frame) -> np.ndarray:
        rng, depth = self.rng, frame.depth
        scale = self.INFRARED_FOCAL / self.fx
        rows, columns = ((np.arange(n) * scale).astype(int) for n in depth.shape)
        infrared = (rows[-1] + 1, columns[-1] + 1)

        def coarse(values: np.ndarray) -> np.ndarray:
            return values[rows[:, None], columns[None]]

        dice = [coarse(rng.random(infrared, np.float32)) for _ in range(4)]
        noise = coarse(rng.standard_normal(infrared, np.float32))
        measured = depth + self.sigma(depth, frame.cosine) * noise
        invalid = (frame.cosine < self.GRAZING) & (dice[0] < self.GRAZING_DROPOUT)
        filled = np.where(depth > 0, depth, FAR).astype(np.float32)
        edge = _edges(filled, 0.03, 0.025)
        wide = cv2.dilate(edge.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        edge |= wide & (dice[1] < 0.25)
        flying = edge & (dice[2] < 0.5)  # a mix of the near and far side
        near, far = (operation(filled, np.ones((5, 5), np.uint8)) for operation in (cv2.erode, cv2.dilate))
        share = rng.random(depth.shape, np.float32)
        measured = np.where(flying, share * near + (1 - share) * np.minimum(far, 9), measured)
        invalid |= (edge & ~flying) | (frame.dark & (dice[3] < self.DROPOUT))
        invalid |= _shadow(filled, self.fx * self.BASELINE, (3, 8))
        step = 2.0 ** np.floor(np.log2(np.maximum(self.STORAGE_STEP * 1e3 * self.sigma(depth), 1)))
        stored = _store(np.round(measured * 1000 / step) * step, invalid, self.NEAREST, self.FARTHEST)
        nearest = [np.clip(np.round((index + 0.5) / scale - 0.5), 0, n - 1).astype(int)
                   for index, n in zip((rows, columns), depth.shape)]
        return stored[nearest[0][:, None], nearest[1][None]]


class StructuredLight(DepthSensor):
    """A speckle pattern (Kinect v1, Xtion, Astra): noise of disparity, its steps of 1/8 px, shadow of the projector."""

    name = 'xtion'
    intrinsics = Intrinsics(640, 480, 540.0, 540.0, 319.5, 239.5)
    model = SensorModel(focal=580.0, baseline=0.075, step=1 / 8, nearest=0.5, farthest=7.0)
    LATERAL = 0.5  # [px of 640] standard deviation of the place that a pixel measures
    EDGE_DROPOUT, DARK_DROPOUT = 0.6, 0.25
    GRAZING = 0.17  # cosine of incidence below which most is lost

    @classmethod
    def sigma(cls, depth: np.ndarray) -> np.ndarray:
        """Return the axial standard deviation [m] before the steps of disparity."""
        return 0.0012 + 0.0019 * (depth - 0.4) ** 2

    def measure(self, frame: Frame) -> np.ndarray:
        rng, size, model = self.rng, frame.depth.shape, self.model
        lateral = self.LATERAL * self.fx / self.intrinsics.fx
        rows, columns = np.indices(size, np.float32)
        exact = np.where(frame.depth > 0, frame.depth, FAR).astype(np.float32)
        shifts = [rng.standard_normal(size, np.float32) * np.float32(lateral) for _ in range(2)]
        depth = cv2.remap(exact, columns + shifts[0], rows + shifts[1], cv2.INTER_NEAREST,
                          borderMode=cv2.BORDER_REPLICATE)
        product = model.focal * model.baseline
        noise = self.smooth_noise(size, 0.8) * self.sigma(depth) * product / depth ** 2
        disparity = np.round((product / depth + noise) / model.step) * model.step
        measured = product / np.maximum(disparity, model.step)
        edge = _edges(exact, 0.04, 0.03)
        dice = self.smooth_noise(size, 0.8)
        invalid = edge & (rng.random(size, np.float32) < self.EDGE_DROPOUT)
        invalid |= (frame.cosine < self.GRAZING) & (dice > -0.5)
        invalid |= frame.dark & (self.smooth_noise(size, 1.5) > ndtri(1 - self.DARK_DROPOUT))
        invalid |= dice > 3.2 - 0.25 * depth.clip(0, 8)  # single losses, more with the distance
        invalid |= _shadow(exact, self.fx * model.baseline, (0, 40))
        return _store(measured * 1000, invalid, model.nearest, model.farthest)


class Stereo(DepthSensor):
    """Active stereo (RealSense D4xx): wavy planes, lost borders beside near surfaces, holes where matching fails.

    A camera is drawn between two that were measured (`./run bench report sensors`): `raw` is 0 for a D435 whose depth
    is filtered, 1 for the raw depth of a D415 in a large bright room.
    """

    name = 'realsense'
    intrinsics = Intrinsics(848, 480, 610.0, 610.0, 423.6, 240.8)
    model = SensorModel(focal=424.0, baseline=0.050, step=1 / 32, nearest=0.3, farthest=8.0)
    SUBPIXEL = 0.08  # [px] standard deviation of disparity
    WAVES = ((0.7, 5.0, 0.5), (0.5, 16.0, 0.7))  # share, width [px], share of it that stays from frame to frame
    HOLES, DARK_HOLES = 0.02, 0.10  # share of the area where nothing is matched: of a raw camera, of hair and black
    FAR_HOLES, FAR_FROM, FAR_TO = 0.65, 2.0, 3.5  # what a raw camera loses more from and beyond these distances [m]
    # Width [px of the sensor] of the border that is lost on a far surface beside a near one, filtered and raw; step of
    # disparity [px] that has one.
    BORDERS, STEP = (2.0, 6.0), 1.0
    FATTENING = 5  # [px] width of the window that spreads near surfaces over their edges

    def __init__(self, fx: float, seed: int) -> None:
        super().__init__(fx, seed)
        self.raw = self.rng.uniform()
        self.still: Dict[float, np.ndarray] = {}

    @classmethod
    def sigma(cls, depth: np.ndarray) -> np.ndarray:
        """Return the standard deviation [m] of noise and waves together."""
        return depth ** 2 * cls.SUBPIXEL / (cls.model.focal * cls.model.baseline)

    def _waves(self, size: Tuple[int, int]) -> np.ndarray:
        """Return a field with variance 1: noise per pixel and waves, a part of which stays in its place."""
        field = self.smooth_noise(size, 1.0) * np.sqrt(1 - sum(share ** 2 for share, _, _ in self.WAVES))
        for share, width, still in self.WAVES:
            if width not in self.still:
                self.still[width] = self.smooth_noise(size, width)
            now = self.smooth_noise(size, width)
            field = field + share * (np.sqrt(still) * self.still[width] + np.sqrt(1 - still) * now)
        return field

    def measure(self, frame: Frame) -> np.ndarray:
        size, model = frame.depth.shape, self.model
        exact = np.where(frame.depth > 0, frame.depth, FAR).astype(np.float32)
        near = cv2.erode(exact, np.ones((self.FATTENING,) * 2, np.uint8))
        patches = self.smooth_noise(size, 2.0)
        depth = np.where((exact - near > 0.05 + 0.03 * near) & (patches > 0), near, exact)
        product = model.focal * model.baseline
        disparity = product / depth + self.SUBPIXEL * self._waves(size)
        disparity = np.round(disparity / model.step) * model.step
        measured = product / np.maximum(disparity, model.step)
        width = round(float(np.interp(self.raw, (0, 1), self.BORDERS)) * self.fx / model.focal)
        nearest = cv2.erode(exact, np.ones((2 * width + 1,) * 2, np.uint8))
        invalid = product / nearest - product / exact > self.STEP
        holes = self.smooth_noise(size, 6.0)
        far = self.FAR_HOLES * ((exact - self.FAR_FROM) / (self.FAR_TO - self.FAR_FROM)).clip(0, 1)
        share = self.raw * (far + self.HOLES) + np.where(frame.dark, self.DARK_HOLES, 0)
        invalid |= holes > ndtri(1 - share)  # what a standard normal value exceeds with this probability
        invalid |= (frame.cosine < 0.15) & (holes > 0)
        invalid |= _shadow(exact, self.fx * model.baseline, (0, 40))
        return _store(measured * 1000, invalid, model.nearest, model.farthest)


SENSORS: Dict[str, Type[DepthSensor]] = {sensor.name: sensor for sensor in (KinectV2, StructuredLight, Stereo)}


def _edges(depth: np.ndarray, least: float, per_metre: float) -> np.ndarray:
    """Return (H, W) bool: depth changes within 3x3 pixels by more than a slanted surface gives."""
    kernel = np.ones((3, 3), np.uint8)
    near = cv2.erode(depth, kernel)
    return (cv2.dilate(depth, kernel) - near) > least + per_metre * near


def _shadow(depth: np.ndarray, product: float, limits: Tuple[float, float]) -> np.ndarray:
    """Return (H, W) bool: what the second view, to the right, does not see beside the left edge of a near surface.

    product: focal length times baseline [px m]; limits of the width [px], the lower one for steps above 0.5 m.
    """
    left, right = depth[:, :-1], depth[:, 1:]
    rows, columns = np.nonzero((left - right) > 0.05 + 0.02 * right)
    far, near = left[rows, columns], right[rows, columns]
    width = product * (1 / near - 1 / np.minimum(far, FAR))
    width = np.clip(width, np.where(far - near > 0.5, limits[0], 0), limits[1]).round().astype(int)
    shadow = np.zeros(depth.shape, bool)
    for distance in range(int(width.max(initial=0))):
        reached = (width > distance) & (columns >= distance)
        v, u = rows[reached], columns[reached] - distance
        behind = depth[v, u] > near[reached] + 0.05
        shadow[v[behind], u[behind]] = True
    return shadow


def _store(millimetres: np.ndarray, invalid: np.ndarray, nearest: float, farthest: float) -> np.ndarray:
    millimetres = np.round(millimetres)
    lost = invalid | ~np.isfinite(millimetres) | (millimetres < nearest * 1000) | (millimetres > farthest * 1000)
    return np.where(lost, 0, millimetres).astype(np.uint16)
