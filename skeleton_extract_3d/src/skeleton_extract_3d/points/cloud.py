"""Organized point clouds, read in place."""
from typing import Any, Mapping, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.camera import CameraModel, fitted_camera

_FLOATS = {'float32': 'f4', 'float64': 'f8'}


class CloudLayout(NamedTuple):
    """How the bytes of an organized cloud lie.

    Attributes:
        width, height: points per row, rows.
        point_step, row_step: bytes from point to point and from row to row.
        fields: of each field its offset [bytes] and datatype ('float32', 'float64', 'uint8', ...).
        is_bigendian: byte order of the coordinates.
    """

    width: int
    height: int
    point_step: int
    row_step: int
    fields: Mapping[str, Tuple[int, str]]
    is_bigendian: bool = False


class OrganizedCloud:
    """A point per pixel, as strided views of the three coordinates; nothing is copied or converted as a whole.

    A point is missing where a coordinate is NaN or infinite, or where all three are 0 (as some drivers write it).

    Args:
        x, y, z: (H, W) float32 or float64 [m], any strides and byte order.

    Raises:
        BadInputError: the three differ in shape or are no image of points.
    """

    def __init__(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> None:
        if x.ndim != 2 or not x.shape == y.shape == z.shape:
            raise BadInputError(f'x, y and z of a cloud: expected three equal (H, W), got {x.shape}, {y.shape} '
                                f'and {z.shape}')
        height, width = x.shape
        if height < 2 or width < 2:
            raise BadInputError(f'cloud is not organized: width {width}, height {height}, expected one point per '
                                'pixel of the image; have the driver publish the organized (registered) cloud')
        self._axes = (x, y, z)

    @classmethod
    def from_buffer(cls, data: Any, layout: CloudLayout) -> 'OrganizedCloud':
        """View the data of a sensor_msgs/PointCloud2.

        Args:
            data: bytes-like, row after row.

        Raises:
            BadInputError: the cloud is empty or unorganized, has no coordinates, or its layout contradicts itself.
        """
        width, height, point_step, row_step, fields, _ = layout
        if width == 0 or height == 0:
            raise BadInputError(f'empty cloud: {width} x {height} points')
        missing = [axis for axis in 'xyz' if axis not in fields]
        if missing:
            raise BadInputError(f"cloud has no field {', '.join(missing)}; its fields are: "
                                f"{', '.join(fields) or 'none'}")
        if row_step < width * point_step:
            raise BadInputError(f'row_step of the cloud is {row_step} bytes, expected at least {width * point_step} '
                                f'for {width} points of {point_step} bytes')
        if len(data) < row_step * height:
            raise BadInputError(f'cloud data are truncated: {len(data)} bytes, expected {row_step * height} for '
                                f'{height} rows of {row_step} bytes')
        return cls(*(_axis_view(data, layout, axis) for axis in 'xyz'))

    @property
    def width(self) -> int:
        """Points per row."""
        return self._axes[0].shape[1]

    @property
    def height(self) -> int:
        """Rows."""
        return self._axes[0].shape[0]

    def window(self, u: np.ndarray, v: np.ndarray, size: int) -> np.ndarray:
        """Read the size x size points around pixels, and no others.

        Args:
            u, v: (M,) int, column and row of the middle of each window; may lie outside.
            size: odd.

        Returns:
            (M, size * size, 3) float64 [m]; NaN where a point is missing or outside.
        """
        columns, rows, inside = window_pixels(u, v, size, self.width, self.height)
        points = np.stack([axis[rows, columns].astype(np.float64) for axis in self._axes], axis=-1)
        points[~(inside & _valid(points))] = np.nan
        return points

    def depths(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return z at pixels inside the cloud, the shape of u and v, float64 [m]; NaN where the point is missing."""
        return depth_in_metres(self._axes[2][v, u])

    def camera_model(self) -> Optional[CameraModel]:
        """Return the pinhole camera that x / z and y / z of the points belong to; None with too few points to tell.

        Raises:
            BadInputError: the points are not those of a pinhole camera in its optical frame.
        """
        return fitted_camera(*self._axes)

    def valid_range(self) -> np.ndarray:
        """Return the least and the greatest x, y, z of all valid points, (2, 3) [m]; NaN if there is none.

        Reads the whole cloud, some ten milliseconds for 960 x 540: for reports, not for every frame.
        """
        return range_of(*self._axes)


def window_pixels(u: np.ndarray, v: np.ndarray, size: int, width: int, height: int
                  ) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return columns and rows of the size x size windows around pixels, clamped to the image, and which lie inside.

    Args:
        u, v: (M,) int.

    Returns:
        columns, rows: (M, size * size) int; inside: the same shape, bool.
    """
    offsets = np.arange(size) - size // 2
    dv, du = (grid.ravel() for grid in np.meshgrid(offsets, offsets, indexing='ij'))
    columns, rows = np.asarray(u)[:, None] + du, np.asarray(v)[:, None] + dv
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    return np.clip(columns, 0, width - 1), np.clip(rows, 0, height - 1), inside


def range_of(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return least and greatest x, y, z of the valid points of three equal arrays, (2, 3); NaN if there is none."""
    valid = np.isfinite(x) & np.isfinite(y) & np.isfinite(z) & ((x != 0) | (y != 0) | (z != 0))
    if not valid.any():
        return np.full((2, 3), np.nan)
    kept = [axis[valid] for axis in (x, y, z)]
    return np.array([[axis.min() for axis in kept], [axis.max() for axis in kept]], np.float64)


def depth_in_metres(depth: np.ndarray, unit: float = 1.0) -> np.ndarray:
    """Return depth as float64 [m], NaN where it is 0, negative or not finite.

    Args:
        depth: any shape, in units of `unit` [m].
    """
    z = depth.astype(np.float64) * unit
    return np.where((z > 0) & (z < np.inf), z, np.nan)


def _valid(points: np.ndarray) -> np.ndarray:
    """Return which (..., 3) points are finite and not the origin."""
    return np.isfinite(points).all(axis=-1) & (points != 0).any(axis=-1)


def _axis_view(data: Any, layout: CloudLayout, name: str) -> np.ndarray:
    offset, datatype = layout.fields[name]
    if datatype not in _FLOATS:
        raise BadInputError(f"field '{name}' of the cloud is {datatype}, expected {' or '.join(_FLOATS)}")
    dtype = np.dtype(('>' if layout.is_bigendian else '<') + _FLOATS[datatype])
    if offset < 0 or offset + dtype.itemsize > layout.point_step:
        raise BadInputError(f"field '{name}' of the cloud takes bytes {offset} .. {offset + dtype.itemsize} of a "
                            f'point, but point_step is {layout.point_step}')
    return np.ndarray((layout.height, layout.width), dtype, data, offset, (layout.row_step, layout.point_step))
