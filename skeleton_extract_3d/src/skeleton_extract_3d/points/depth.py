"""Depth images that are aligned to a camera: points at the pixels that are asked for."""
from typing import Any, NamedTuple, Optional

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.camera import CameraModel, check_same_aspect
from skeleton_extract_3d.points.point_grid import PointGrid, check_buffer, depth_in_metres
from skeleton_extract_3d.points.transform import Transform

# Type of the pixels by encoding, as REP 118 has them; mono16 is what some drivers call 16UC1.
_ENCODINGS = {'16UC1': 'u2', 'mono16': 'u2', '32FC1': 'f4'}

# Layout of an XYZRGB cloud as PCL and the Kinect drivers write it; rgb holds 0x00RRGGBB in the bits of a float32 field.
XYZRGB = np.dtype({'names': ['x', 'y', 'z', 'rgb'], 'formats': ['<f4', '<f4', '<f4', '<u4'],
                   'offsets': [0, 4, 8, 16], 'itemsize': 32})


class ImageLayout(NamedTuple):
    """Size, bytes from row to row, encoding ('16UC1', 'mono16' or '32FC1') and byte order of a depth image."""

    width: int
    height: int
    step: int
    encoding: str
    is_bigendian: bool


class DepthImage(PointGrid):
    """A depth image aligned to the colour image.

    A value is the z of the surface along the optical axis, at that pixel.

    Args:
        depth: (H, W) uint16 [mm] with 0 = missing, or float32 [m] with 0, negative or not finite = missing.
        camera: of the image it is aligned to; another resolution of the same view is scaled.

    Raises:
        BadInputError: other shape, type or aspect ratio, or less than 2 x 2 pixels.
    """

    _range_step = 4  # undistortion takes a microsecond per pixel

    def __init__(self, depth: np.ndarray, camera: CameraModel) -> None:
        if depth.ndim != 2 or depth.size == 0 or depth.dtype.kind + str(depth.dtype.itemsize) not in ('u2', 'f4'):
            raise BadInputError(f'depth image: expected (H, W) uint16 or float32, got {depth.shape} {depth.dtype}')
        if min(depth.shape) < 2:
            raise BadInputError(f'depth image is {depth.shape[1]} x {depth.shape[0]}, expected at least 2 x 2 pixels')
        super().__init__(depth, 0.001 if depth.dtype.kind == 'u' else 1.0)
        self.camera = camera.scaled(self.width, self.height)

    @classmethod
    def from_buffer(cls, data: Any, layout: ImageLayout, camera: CameraModel) -> 'DepthImage':
        """View the bytes of a sensor_msgs/Image that is aligned to a camera.

        Raises:
            BadInputError: empty, truncated, wrong step, another encoding or another aspect ratio than the camera's.
        """
        if layout.encoding not in _ENCODINGS:
            raise BadInputError(f"depth image has encoding '{layout.encoding}', expected one of "
                                f"{', '.join(_ENCODINGS)}")
        dtype = np.dtype(('>' if layout.is_bigendian else '<') + _ENCODINGS[layout.encoding])
        check_buffer('depth image', data, (layout.width, layout.height), dtype.itemsize, layout.step)
        return cls(np.ndarray((layout.height, layout.width), dtype, data, 0, (layout.step, dtype.itemsize)), camera)

    def camera_model(self) -> CameraModel:
        """Return the camera of the image."""
        return self.camera

    def coloured_cloud(self, bgr: np.ndarray, rays: Optional[np.ndarray] = None) -> np.ndarray:
        """Return the organized cloud of this view, see `cloud_from_depth`, with an image of it at any resolution."""
        size = (self.width, self.height)
        check_same_aspect('image', (bgr.shape[1], bgr.shape[0]), 'depth image', size)
        if bgr.shape[1::-1] != size:
            bgr = cv2.resize(bgr, size, interpolation=cv2.INTER_AREA)
        return cloud_from_depth(depth_in_metres(self._z, self._unit), self.camera, bgr, rays)

    def _points(self, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
        z = self.depths(columns, rows)
        rays = self.camera.rays(np.stack([columns.ravel(), rows.ravel()], axis=-1))
        return rays.reshape(*z.shape, 3) * z[..., None]


class NoDepth(DepthImage):
    """The pixels of a camera without depth: every point is missing.

    Args:
        camera: of the image.
    """

    def __init__(self, camera: CameraModel) -> None:
        super().__init__(np.broadcast_to(np.float32(np.nan), (camera.height, camera.width)), camera)


def registered(points: PointGrid, camera: CameraModel, pose: Transform) -> DepthImage:
    """Return the depth that a camera sees of the points of another one; of several in a pixel the nearest.

    It has the resolution of the points where that of the camera is higher, so that surfaces have no holes.

    Args:
        pose: from the frame of the points to that of the camera.

    Raises:
        BadInputError: the points are not those of a camera.
    """
    source, size = points.camera_model(), (camera.width, camera.height)
    if source is not None:
        scale = min(source.focal_in((source.width, source.height)) / camera.focal_in(size), 1)
        camera = camera.scaled(*(max(round(scale * side), 2) for side in size))
    v, u = np.mgrid[:points.height, :points.width]
    xyz = points.window(u.ravel(), v.ravel(), 1)[:, 0] @ pose[0].T + pose[1]
    xyz = xyz[np.argsort(-xyz[:, 2])]
    uv = np.floor(camera.project(xyz) + 0.5)
    inside = ((uv >= 0) & (uv < (camera.width, camera.height))).all(axis=1)
    columns, rows = uv[inside].astype(np.int64).T
    depth = np.zeros((camera.height, camera.width), np.float32)
    depth[rows, columns] = xyz[inside, 2]
    return DepthImage(depth, camera)


def cloud_from_depth(depth: np.ndarray, camera: CameraModel, bgr: np.ndarray, rays: Optional[np.ndarray] = None
                     ) -> np.ndarray:
    """Return the organized cloud of a depth image, as a Kinect driver publishes it, (H, W) `XYZRGB`; NaN where missing.

    Args:
        depth: (H, W) float [m]; 0, negative or not finite where missing.
        bgr: (H, W, 3) uint8.
        rays: `camera.ray_grid()`, to compute it once for many frames.

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
    offset = XYZRGB.fields['rgb'][1]  # type: ignore[index]
    cloud.view(np.uint8).reshape(*expected, XYZRGB.itemsize)[..., offset:offset + 3] = bgr
    return cloud
