"""Organized point clouds, read in place."""
from typing import Any, List, Mapping, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.camera import CameraModel, fitted_camera
from skeleton_extract_3d.points.point_grid import PointGrid, check_buffer

_FLOATS = {'float32': 'f4', 'float64': 'f8'}


class CloudLayout(NamedTuple):
    """Size, bytes from point to point and from row to row, offset [bytes] and datatype ('float32', 'uint8', ...) of
    each field, and byte order of an organized cloud.
    """

    width: int
    height: int
    point_step: int
    row_step: int
    fields: Mapping[str, Tuple[int, str]]
    is_bigendian: bool = False


class OrganizedCloud(PointGrid):
    """A point per pixel, as strided views of the three coordinates.

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
        super().__init__(z)
        if self.height < 2 or self.width < 2:
            raise BadInputError(f'cloud is not organized: width {self.width}, height {self.height}, expected one point '
                                'per pixel of the image; have the driver publish the organized (registered) cloud')
        self._axes = (x, y, z)
        self._fitted = False
        self._camera: Optional[CameraModel] = None

    @classmethod
    def without_points(cls, width: int, height: int) -> 'OrganizedCloud':
        """Return a cloud in which every point is missing."""
        return cls(*[np.broadcast_to(np.float32(np.nan), (height, width))] * 3)

    def turned(self, degrees: int) -> 'OrganizedCloud':
        """Return the cloud of a camera at the same place whose images are turned clockwise."""
        x, y, z = (np.rot90(axis, -degrees // 90) for axis in self._axes)
        for _ in range(degrees // 90):
            x, y = -y, x
        return OrganizedCloud(x, y, z)

    def camera_model(self) -> Optional[CameraModel]:
        """Return the pinhole camera that x / z and y / z of the points belong to; see `PointGrid.camera_model`."""
        if not self._fitted:
            self._camera, self._fitted = fitted_camera(*self._axes), True
        return self._camera

    def distances(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `PointGrid.distances`."""
        return np.abs(self._points(u, v)).max(axis=-1)

    def _points(self, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
        points = np.stack([axis[rows, columns].astype(np.float64) for axis in self._axes], axis=-1)
        points[~(np.isfinite(points).all(axis=-1) & (points != 0).any(axis=-1))] = np.nan
        return points


def coordinate_views(data: Any, layout: CloudLayout) -> List[np.ndarray]:
    """Return x, y and z in the bytes of a sensor_msgs/PointCloud2, (H, W) each [m].

    Raises:
        BadInputError: the cloud is empty, has no coordinates, or its layout contradicts itself.
    """
    check_buffer('cloud', data, (layout.width, layout.height), layout.point_step, layout.row_step)
    missing = [axis for axis in 'xyz' if axis not in layout.fields]
    if missing:
        raise BadInputError(f"cloud has no field {', '.join(missing)}; its fields are: "
                            f"{', '.join(layout.fields) or 'none'}")
    return [_axis_view(data, layout, axis) for axis in 'xyz']


def _axis_view(data: Any, layout: CloudLayout, name: str) -> np.ndarray:
    offset, datatype = layout.fields[name]
    if datatype not in _FLOATS:
        raise BadInputError(f"field '{name}' of the cloud is {datatype}, expected {' or '.join(_FLOATS)}")
    dtype = np.dtype(('>' if layout.is_bigendian else '<') + _FLOATS[datatype])
    if offset < 0 or offset + dtype.itemsize > layout.point_step:
        raise BadInputError(f"field '{name}' of the cloud takes bytes {offset} .. {offset + dtype.itemsize} of a "
                            f'point, but point_step is {layout.point_step}')
    return np.ndarray((layout.height, layout.width), dtype, data, offset, (layout.row_step, layout.point_step))
