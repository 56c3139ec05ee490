"""Depth images that are aligned to a camera: the camera's geometry, and points at the pixels that are asked for."""
from dataclasses import dataclass
from typing import Any, Dict, Optional, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.cloud import range_of, window_pixels

# Widths and heights count as one aspect ratio up to this relative difference: rounded sizes pass, cropped ones do not.
ASPECT_TOLERANCE = 0.01

# Lengths of D that each distortion model of sensor_msgs/CameraInfo may have; none or all zero always means undistorted.
_DISTORTION_LENGTHS: Dict[str, Tuple[int, ...]] = {
    '': (), 'none': (), 'plumb_bob': (4, 5), 'rational_polynomial': (8, 12, 14), 'equidistant': (4,), 'fisheye': (4,)}
_FISHEYE = ('equidistant', 'fisheye')

# Undistortion iterates; OpenCV's default of 5 rounds leaves pixels of error at the corners of wide lenses.
_UNDISTORT_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-7)
# A ray that does not project back to its pixel by this much [px] lies where the distortion can not be inverted.
_ROUND_TRIP_TOLERANCE = 0.5

# Rows and columns from one to the next of those that `valid_range` looks at.
_RANGE_STEP = 4

# Type of the pixels by encoding, as REP 118 has them; mono16 is what some drivers call 16UC1.
_ENCODINGS = {'16UC1': 'u2', 'mono16': 'u2', '32FC1': 'f4'}

# Layout of an XYZRGB cloud as PCL and the Kinect drivers write it; rgb holds 0x00RRGGBB in the bits of a float32 field.
XYZRGB = np.dtype({'names': ['x', 'y', 'z', 'rgb'], 'formats': ['<f4', '<f4', '<f4', '<u4'],
                   'offsets': [0, 4, 8, 16], 'itemsize': 32})


@dataclass(frozen=True, eq=False)
class CameraModel:
    """Pinhole camera with lens distortion, in the optical frame (x right, y down, z forward).

    Attributes:
        width, height: size of the picture that K belongs to [px].
        matrix: K, (3, 3) float64 [px]; integer coordinates are pixel centres.
        distortion_model: 'plumb_bob', 'rational_polynomial', 'equidistant' ('fisheye'), or 'none' (or empty).
        distortion: D, (N,) float64; empty or all zero: no distortion.

    Raises:
        BadInputError: the camera is not calibrated, or the distortion model is unknown or does not fit D.
    """

    width: int
    height: int
    matrix: np.ndarray
    distortion_model: str = ''
    distortion: np.ndarray = ()

    def __post_init__(self) -> None:
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
        if self.distortion_model not in _DISTORTION_LENGTHS:
            raise BadInputError(f"distortion model '{self.distortion_model}' is unknown; expected one of "
                                f"{', '.join(name for name in _DISTORTION_LENGTHS if name)}")
        lengths = _DISTORTION_LENGTHS[self.distortion_model]
        if distortion.any() and (distortion.size not in lengths or not np.isfinite(distortion).all()):
            raise BadInputError(f"D of distortion model '{self.distortion_model}': expected "
                                f"{' or '.join(map(str, lengths)) or 'no'} finite values, got {distortion.tolist()}")
        object.__setattr__(self, 'matrix', matrix.reshape(3, 3))
        object.__setattr__(self, 'distortion', distortion if distortion.any() else np.zeros(0))

    def scaled(self, width: int, height: int) -> 'CameraModel':
        """Return the same camera for a picture of another resolution.

        Raises:
            BadInputError: the other picture has another aspect ratio, so it does not show the same view.
        """
        if (width, height) == (self.width, self.height):
            return self
        check_same_aspect('picture', (width, height), 'camera', (self.width, self.height))
        ratio = np.array([width / self.width, height / self.height])
        matrix = self.matrix.copy()
        matrix[[0, 1], [0, 1]] *= ratio
        # the corner of the picture is at -0.5, since integers are centres
        matrix[:2, 2] = (self.matrix[:2, 2] + 0.5) * ratio - 0.5
        return CameraModel(width, height, matrix, self.distortion_model, self.distortion)

    def rays(self, uv: np.ndarray) -> np.ndarray:
        """Return where the lines of sight of pixels meet the plane z = 1.

        Args:
            uv: (N, 2) [px].

        Returns:
            (N, 3) float64, x, y, 1; NaN where the distortion can not be inverted.
        """
        uv = np.asarray(uv, np.float64).reshape(-1, 2)
        rays = np.ones((len(uv), 3))
        if not self.distortion.size:
            rays[:, :2] = (uv - self.matrix[:2, 2]) / self.matrix[[0, 1], [0, 1]]
        elif len(uv):
            pixels = uv.reshape(-1, 1, 2)
            if self.distortion_model in _FISHEYE:
                plane = cv2.fisheye.undistortPoints(pixels, self.matrix, self.distortion)
            else:
                plane = cv2.undistortPointsIter(pixels, self.matrix, self.distortion, None, None, _UNDISTORT_UNTIL)
            rays[:, :2] = plane.reshape(-1, 2)
            error = np.abs(self.project(rays) - uv).max(axis=1)
            rays[~(error < _ROUND_TRIP_TOLERANCE)] = np.nan
        return rays

    def project(self, xyz: np.ndarray) -> np.ndarray:
        """Return the pixels of points.

        Args:
            xyz: (N, 3) [m] in the optical frame.

        Returns:
            (N, 2) float64 [px], also outside the picture; NaN for points that are not finite or not in front.
        """
        xyz = np.asarray(xyz, np.float64).reshape(-1, 3)
        uv = np.full((len(xyz), 2), np.nan)
        seen = np.isfinite(xyz).all(axis=1) & (xyz[:, 2] > 0)
        if not self.distortion.size:
            uv[seen] = xyz[seen, :2] / xyz[seen, 2:] * self.matrix[[0, 1], [0, 1]] + self.matrix[:2, 2]
        elif seen.any():
            project = cv2.fisheye.projectPoints if self.distortion_model in _FISHEYE else cv2.projectPoints
            still = np.zeros(3)
            uv[seen] = project(xyz[seen].reshape(-1, 1, 3), still, still, self.matrix, self.distortion)[0][:, 0]
        return uv

    def ray_grid(self) -> np.ndarray:
        """Return the rays of all pixels, (height, width, 3) float64."""
        v, u = np.mgrid[:self.height, :self.width]
        return self.rays(np.stack([u.ravel(), v.ravel()], axis=-1)).reshape(self.height, self.width, 3)


class DepthImage:
    """A depth image aligned to the colour image, with the same access as `OrganizedCloud`.

    A value is the z of the surface along the optical axis, at that pixel.

    Args:
        depth: (H, W) uint16 [mm] with 0 = missing, or float32 [m] with 0, negative or not finite = missing.
        camera: of the picture it is aligned to; another resolution of the same view is scaled.

    Raises:
        BadInputError: other shape, type or aspect ratio.
    """

    def __init__(self, depth: np.ndarray, camera: CameraModel) -> None:
        if depth.ndim != 2 or depth.size == 0 or depth.dtype.kind + str(depth.dtype.itemsize) not in ('u2', 'f4'):
            raise BadInputError(f'depth image: expected (H, W) uint16 or float32, got {depth.shape} {depth.dtype}')
        self._depth = depth
        self._metres = 0.001 if depth.dtype.kind == 'u' else 1.0
        self.camera = camera.scaled(depth.shape[1], depth.shape[0])

    @classmethod
    def from_buffer(cls, data: Any, width: int, height: int, step: int, encoding: str, is_bigendian: bool,
                    camera: CameraModel) -> 'DepthImage':
        """View the data of a sensor_msgs/Image.

        Args:
            data: bytes-like.
            step: bytes from row to row.
            encoding: '16UC1' (or 'mono16') or '32FC1'.

        Raises:
            BadInputError: empty, truncated, wrong step, another encoding or another aspect ratio than the camera's.
        """
        if encoding not in _ENCODINGS:
            raise BadInputError(f"depth image has encoding '{encoding}', expected one of {', '.join(_ENCODINGS)}")
        if width == 0 or height == 0:
            raise BadInputError(f'empty depth image: {width} x {height}')
        dtype = np.dtype(('>' if is_bigendian else '<') + _ENCODINGS[encoding])
        if step < width * dtype.itemsize:
            raise BadInputError(f'depth image step is {step} bytes, expected at least {width * dtype.itemsize} for '
                                f'{width} columns of {encoding}')
        if len(data) < step * height:
            raise BadInputError(f'depth image data are truncated: {len(data)} bytes, expected {step * height} for '
                                f'{height} rows of {step} bytes')
        return cls(np.ndarray((height, width), dtype, data, 0, (step, dtype.itemsize)), camera)

    @property
    def width(self) -> int:
        """Pixels per row."""
        return self._depth.shape[1]

    @property
    def height(self) -> int:
        """Rows."""
        return self._depth.shape[0]

    def window(self, u: np.ndarray, v: np.ndarray, size: int) -> np.ndarray:
        """Return the points at the size x size pixels around pixels; see `OrganizedCloud.window`.

        Args:
            u, v: (M,) int, column and row of the middle of each window; may lie outside.
            size: odd.

        Returns:
            (M, size * size, 3) float64 [m]; NaN where the depth is missing or the pixel outside.
        """
        columns, rows, inside = window_pixels(u, v, size, self.width, self.height)
        z = depth_in_metres(self._depth[rows, columns], self._metres)
        z[~inside] = np.nan
        rays = self.camera.rays(np.stack([columns.ravel(), rows.ravel()], axis=-1))
        return rays.reshape(*z.shape, 3) * z[..., None]

    def valid_range(self) -> np.ndarray:
        """Return the least and the greatest x, y, z, (2, 3) [m]; NaN if there is no depth.

        Looks at every fourth row and column, since undistortion takes a microsecond per pixel: for reports.
        """
        rows, columns = (grid.ravel() for grid in np.mgrid[:self.height:_RANGE_STEP, :self.width:_RANGE_STEP])
        points = self.window(columns, rows, 1)[:, 0]
        return range_of(*points.T)


def depth_in_metres(depth: np.ndarray, unit: float = 1.0) -> np.ndarray:
    """Return depth as float64 [m], NaN where it is 0, negative or not finite.

    Args:
        depth: any shape, in units of `unit` [m].
    """
    z = depth.astype(np.float64) * unit
    z[~(np.isfinite(z) & (z > 0))] = np.nan
    return z


def check_same_aspect(name: str, size: Tuple[int, int], other_name: str, other_size: Tuple[int, int]) -> None:
    """Raise unless two (width, height) are one view at two resolutions.

    Raises:
        BadInputError: the aspect ratios differ; the text names both sizes.
    """
    (width, height), (other_width, other_height) = size, other_size
    if abs(width * other_height / (height * other_width) - 1) > ASPECT_TOLERANCE:
        raise BadInputError(f'{name} is {width} x {height} but {other_name} is {other_width} x {other_height}: the '
                            'aspect ratios differ, so they do not show the same view; register one to the other')


def cloud_from_depth(depth: np.ndarray, camera: CameraModel, bgr: np.ndarray, rays: Optional[np.ndarray] = None
                     ) -> np.ndarray:
    """Return the organized cloud of a depth image, as a Kinect driver publishes it.

    Args:
        depth: (H, W) float [m]; 0, negative or not finite where missing.
        camera: of the picture, (W, H).
        bgr: (H, W, 3) uint8.
        rays: `camera.ray_grid()`, to compute it once for many frames.

    Returns:
        (H, W) of dtype `XYZRGB`, 32 bytes per point; x = y = z = NaN where missing.

    Raises:
        BadInputError: the sizes differ.
    """
    expected = (camera.height, camera.width)
    if depth.shape != expected or bgr.shape != (*expected, 3):
        raise BadInputError(f'cloud of {camera.width} x {camera.height}: expected depth {expected} and colour '
                            f'{(*expected, 3)}, got {depth.shape} and {bgr.shape}')
    rays = camera.ray_grid() if rays is None else rays
    z = depth_in_metres(depth).astype(np.float32)
    cloud = np.zeros(expected, XYZRGB)
    for i, axis in enumerate('xyz'):
        np.multiply(rays[..., i], z, out=cloud[axis], casting='same_kind')
    # 0x00RRGGBB, little-endian: the bytes are blue, green, red
    offset = XYZRGB.fields['rgb'][1]
    cloud.view(np.uint8).reshape(*expected, XYZRGB.itemsize)[..., offset:offset + 3] = bgr
    return cloud
