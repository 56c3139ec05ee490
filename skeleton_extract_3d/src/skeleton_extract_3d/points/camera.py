"""Cameras: from pixels to rays and back."""
import functools
from dataclasses import InitVar, dataclass, field
from typing import Dict, Optional, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.calibration import Calibration, distortion_model
from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.constants import METHOD, MethodConstants

# Widths and heights count as one aspect ratio up to this relative difference: rounded sizes pass, cropped ones do not.
ASPECT_TOLERANCE = 0.01

# Lengths of D of each distortion model; none or all zero always means undistorted.
_OPENCV_LENGTHS = (4, 5, 8, 12, 14)
_DISTORTION_LENGTHS: Dict[str, Tuple[int, ...]] = {
    '': (), 'plumb_bob': _OPENCV_LENGTHS, 'rational_polynomial': _OPENCV_LENGTHS, 'equidistant': (4,)}
_FISHEYE = 'equidistant'

# Limits of focal lengths, in longer sides of the image: lines of sight of 157 degrees and of half a degree.
_FOCAL_LENGTHS = 0.1, 100.0
# Least share of the pixels at which the distortion can be inverted; fisheye lenses have corners where it can not.
_LEAST_RAYS = 0.15
# Undistortion iterates; OpenCV's default of 5 rounds leaves pixels of error at the corners of wide lenses.
_UNDISTORT_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-7)
# A ray that does not project back to its pixel by this much [px] lies where the distortion can not be inverted.
_ROUND_TRIP_TOLERANCE = 0.5


@dataclass(frozen=True, eq=False)
class CameraModel:
    """Pinhole camera with lens distortion, in the optical frame (x right, y down, z forward).

    Attributes:
        width, height: size of the image that K belongs to [px].
        matrix: K, (3, 3) float64 [px]; integer coordinates are pixel centres.
        distortion_model: a spelling that `calibration.distortion_model` knows; then its name in a CameraInfo.
        distortion: D, (N,) float64; empty or all zero: no distortion. Zeros beyond those of the
            model are cut off.
        checked: whether the values are those of a camera; False: of one that was made of a checked one, whose image may
            be a small part far from the centre.

    Raises:
        BadInputError: the camera is not calibrated, the distortion model is unknown or does not fit D, or no camera
            has such values.
    """

    width: int
    height: int
    matrix: np.ndarray
    distortion_model: str = ''
    distortion: np.ndarray = field(default_factory=lambda: np.zeros(0))
    checked: InitVar[bool] = True

    def __post_init__(self, checked: bool) -> None:
        if self.width < 1 or self.height < 1:
            raise BadInputError(f'camera has size {self.width} x {self.height}, expected at least 1 x 1')
        matrix = np.array(self.matrix, np.float64).reshape(-1)
        if matrix.size != 9 or not np.isfinite(matrix).all():
            raise BadInputError(f'camera matrix K: expected 9 finite numbers, got {matrix.tolist()}')
        fx, skew, _, below, fy, _, *last = matrix
        if fx <= 0 or fy <= 0:
            raise BadInputError(f'camera is not calibrated: focal lengths in K are {fx:g} and {fy:g} px')
        if skew != 0 or below != 0 or last != [0, 0, 1]:
            raise BadInputError(f'camera matrix K: expected [fx 0 cx; 0 fy cy; 0 0 1], got {matrix.tolist()}')
        distortion = np.array(self.distortion, np.float64).reshape(-1)
        model = distortion_model(self.distortion_model) if distortion.any() else ''
        lengths = _DISTORTION_LENGTHS[model]
        fitting = [length for length in lengths if length <= distortion.size and not distortion[length:].any()]
        if distortion.any() and not (fitting and np.isfinite(distortion).all()):
            raise BadInputError(f"D of distortion model '{self.distortion_model}': expected "
                                f"{' or '.join(map(str, lengths)) or 'no'} finite values, got {distortion.tolist()}")
        object.__setattr__(self, 'distortion_model', model)
        object.__setattr__(self, 'matrix', matrix.reshape(3, 3))
        object.__setattr__(self, 'distortion', distortion[:fitting[-1]] if distortion.any() else np.zeros(0))
        if checked:
            self._check_limits()

    def _check_limits(self) -> None:
        sizes = (self.width, self.height)
        least, most = (limit * max(sizes) for limit in _FOCAL_LENGTHS)
        for axis, size, (focal, centre) in zip('xy', sizes, self.matrix[[[0], [1]], [[0, 2], [1, 2]]].tolist()):
            if not least <= focal <= most:
                raise BadInputError(f'camera matrix K: f{axis} is {focal:g} px, expected {least:g} to {most:g} px for '
                                    f'{self.width} x {self.height} px')
            if abs(centre - size / 2) > size:
                raise BadInputError(f'camera matrix K: c{axis} is {centre:g} px, far outside of {self.width} x '
                                    f'{self.height} px; is K of another resolution?')
        if self.distortion.size:
            u, v = (np.linspace(0, size - 1, count) for size, count in zip(sizes, METHOD.camera_fit.grid))
            share = np.isfinite(self.rays(np.stack(np.meshgrid(u, v), axis=-1))).all(axis=1).mean()
            if share < _LEAST_RAYS:
                raise BadInputError(f'distortion D = {self.distortion.tolist()} folds the image: {share:.0%} of its '
                                    f'pixels have one line of sight, expected at least {_LEAST_RAYS:.0%}')

    def scaled(self, width: int, height: int) -> 'CameraModel':
        """Return the same camera for an image of another resolution.

        Raises:
            BadInputError: the other image has another aspect ratio, so it does not show the same view.
        """
        if (width, height) == (self.width, self.height):
            return self
        check_same_aspect('image', (width, height), 'camera', (self.width, self.height))
        ratio = np.array([width / self.width, height / self.height])
        matrix = self.matrix.copy()
        matrix[[0, 1], [0, 1]] *= ratio
        # the corner of the image is at -0.5, since integers are centres
        matrix[:2, 2] = (self.matrix[:2, 2] + 0.5) * ratio - 0.5
        return CameraModel(width, height, matrix, self.distortion_model, self.distortion, checked=False)

    def focal_in(self, image_size: Tuple[int, int]) -> float:
        """Return the focal length, mean of both axes, in the pixels of an image of the same view [px]."""
        (fx, _, _), (_, fy, _), _ = self.matrix.tolist()
        width, height = image_size
        return (fx * (width / self.width) + fy * (height / self.height)) / 2

    @np.errstate(all='ignore')  # where the distortion can not be inverted, anything comes out
    def rays(self, uv: np.ndarray) -> np.ndarray:
        """Return where the lines of sight of (N, 2) pixels meet the plane z = 1, (N, 3) float64; NaN if nowhere."""
        uv = np.asarray(uv, np.float64).reshape(-1, 2)
        rays = np.ones((len(uv), 3))
        if not self.distortion.size:
            rays[:, :2] = (uv - self.matrix[:2, 2]) / self.matrix[[0, 1], [0, 1]]
        elif len(uv):
            pixels = uv.reshape(-1, 1, 2)
            if self.distortion_model == _FISHEYE:
                plane = cv2.fisheye.undistortPoints(pixels, self.matrix, self.distortion)
            else:
                plane = cv2.undistortPointsIter(pixels, self.matrix, self.distortion, None, None, _UNDISTORT_UNTIL)
            rays[:, :2] = plane.reshape(-1, 2)
            error = np.abs(self.project(rays) - uv).max(axis=1)
            rays[~(error < _ROUND_TRIP_TOLERANCE) | self._is_beyond_fold(rays)] = np.nan
        return rays

    def _is_beyond_fold(self, rays: np.ndarray) -> np.ndarray:
        """Return whether rays, (N, 3), are beyond the angle where the image of a fisheye grows no more."""
        if self.distortion_model != _FISHEYE:
            return np.zeros(len(rays), bool)
        angles = np.arctan(np.hypot(rays[:, 0], rays[:, 1]))
        slope = 1 + angles[:, None] ** (2, 4, 6, 8) @ (self.distortion * (3, 5, 7, 9))
        return ~(slope > 0)

    @np.errstate(all='ignore')  # points next to the camera lie anywhere
    def project(self, xyz: np.ndarray) -> np.ndarray:
        """Return the pixels of (N, 3) points [m], (N, 2) float64, also outside the image; NaN if not in front."""
        xyz = np.asarray(xyz, np.float64).reshape(-1, 3)
        uv = np.full((len(xyz), 2), np.nan)
        seen = np.isfinite(xyz).all(axis=1) & (xyz[:, 2] > 0)
        if not self.distortion.size:
            uv[seen] = xyz[seen, :2] / xyz[seen, 2:] * self.matrix[[0, 1], [0, 1]] + self.matrix[:2, 2]
        elif seen.any():
            project = cv2.fisheye.projectPoints if self.distortion_model == _FISHEYE else cv2.projectPoints
            still = np.zeros(3)
            uv[seen] = project(xyz[seen].reshape(-1, 1, 3), still, still, self.matrix, self.distortion)[0][:, 0]
        return uv

    def ray_grid(self) -> np.ndarray:
        """Return the rays of all pixels, (height, width, 3) float64."""
        v, u = np.mgrid[:self.height, :self.width]
        return self.rays(np.stack([u.ravel(), v.ravel()], axis=-1)).reshape(self.height, self.width, 3)


def calibrated_camera(calibration: Calibration, rectified: bool = False) -> CameraModel:
    """Return the checked camera of the images: K is of the whole sensor, these may be a part of it, with binning.

    Args:
        rectified: the images are rectified: take the focal lengths and centre of P, and no distortion.

    Raises:
        BadInputError: not calibrated, an unknown distortion model, or a region of interest beyond the sensor.

    Source: image_geometry, PinholeCameraModel::fromCameraInfo.
    """
    size, (x, y, height, width, _) = (calibration.width, calibration.height), calibration.region
    if rectified:
        sensor = CameraModel(*size, np.reshape(calibration.projection, (3, 4))[:, :3])
    else:
        sensor = CameraModel(*size, np.array(calibration.matrix), calibration.distortion_model,
                             np.array(calibration.distortion))
    width, height = width or size[0], height or size[1]
    if x + width > size[0] or y + height > size[1]:
        raise BadInputError(f'region of interest of {width} x {height} px at ({x}, {y}) is not within the camera '
                            f'info, which is of {size[0]} x {size[1]} px')
    matrix = sensor.matrix.copy()
    matrix[:2, 2] -= x, y
    matrix[:2] /= np.maximum(calibration.binning, 1)[:, None]
    return CameraModel(*calibration.image_size, matrix, sensor.distortion_model, sensor.distortion, checked=False)


def check_same_aspect(name: str, size: Tuple[int, int], other_name: str, other_size: Tuple[int, int]) -> None:
    """Check that two (width, height) are one view at two resolutions.

    Raises:
        BadInputError: the aspect ratios differ; the text names both sizes.
    """
    (width, height), (other_width, other_height) = size, other_size
    if abs(width * other_height / (height * other_width) - 1) > ASPECT_TOLERANCE:
        raise BadInputError(f'{name} is {width} x {height} but {other_name} is {other_width} x {other_height}: the '
                            'aspect ratios differ, so they do not show the same view; register one to the other')


@np.errstate(all='ignore')  # points at the camera lie anywhere
def fitted_camera(x: np.ndarray, y: np.ndarray, z: np.ndarray, method: MethodConstants = METHOD
                  ) -> Optional[CameraModel]:
    """Return the pinhole camera of the points (H, W) [m] of an organized cloud; None if there are too few to tell.

    It is the least squares of u = fx x / z + cx and v = fy y / z + cy.

    Raises:
        BadInputError: no such camera explains the points: they are in another frame, or not registered.
    """
    constants, (height, width) = method.camera_fit, z.shape
    columns, rows = sample_pixels(width, height, constants.grid)
    points = np.array([axis[rows, columns].ravel() for axis in (x, y, z)], np.float64)
    seen = np.isfinite(points).all(axis=0) & (points[2] > 0)
    uv = np.array(np.broadcast_arrays(columns, rows), np.float64).reshape(2, -1)[:, seen]
    if seen.sum() < constants.least_points or (uv == uv[:, :1]).all(axis=1).any():
        behind = int((points[2] < 0).sum())
        if behind >= constants.least_points:
            raise _no_camera(f'{behind} of {points.shape[1]} points that were read have a negative z')
        return None
    (fx, cx, error), (fy, cy, other) = (_line(axis[seen] / points[2, seen], of_axis)
                                        for axis, of_axis in zip(points, uv))
    if not (fx > 0 and fy > 0):
        raise _no_camera(f'the focal lengths that fit best are {fx:.0f} and {fy:.0f} px, expected more than 0')
    error = max(error, other)
    if error > constants.tolerance:
        raise _no_camera(f'they miss their pixels by {error:.1f} px, expected up to {constants.tolerance:g}')
    return CameraModel(width, height, np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1]))


def _line(x: np.ndarray, y: np.ndarray) -> Tuple[float, float, float]:
    """Return slope and offset of y over x, (N,) each, by least squares, and the median distance."""
    def total(values: np.ndarray) -> float:
        return float(np.cumsum(values)[-1])  # one after another, on any processor alike

    x_mean, y_mean = total(x) / len(x), total(y) / len(y)
    slope = total((x - x_mean) * (y - y_mean)) / max(total((x - x_mean) * (x - x_mean)), 1e-12)
    errors = np.sort(np.abs(slope * (x - x_mean) - (y - y_mean)))
    return slope, y_mean - slope * x_mean, float(errors[len(errors) // 2])


def _no_camera(reason: str) -> BadInputError:
    return BadInputError('the points of the cloud are not those of a pinhole camera in its optical frame (x right, y '
                         f'down, z forward): {reason}; publish the registered cloud in the optical frame of the image')


@functools.lru_cache(maxsize=8)
def sample_pixels(width: int, height: int, grid: Tuple[int, int] = METHOD.camera_fit.grid
                  ) -> Tuple[np.ndarray, np.ndarray]:
    """Return columns (1, N) and rows (M, 1) of the pixels that stand for all of an image."""
    columns, rows = (np.linspace(0, size - 1, min(count, size)).astype(np.int64)
                     for size, count in zip((width, height), grid))
    return columns[None], rows[:, None]
