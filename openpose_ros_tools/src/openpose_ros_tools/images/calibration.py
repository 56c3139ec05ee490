"""Calibrations of cameras as they are stored: all that a CameraInfo holds, in the formats that people have."""
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Optional, Sequence, Tuple

import numpy as np
import yaml

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.camera import CameraModel

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_NO_REGION = (0, 0, 0, 0, False)
# Distortion model by the number of coefficients, where only these are given; OpenCV's models.
_MODELS = {0: 'plumb_bob', 4: 'plumb_bob', 5: 'plumb_bob', 8: 'rational_polynomial', 12: 'rational_polynomial',
           14: 'rational_polynomial'}


@dataclass(frozen=True)
class Calibration:
    """What a sensor_msgs/CameraInfo says of a camera, unchanged: also R and P, and a D of zeros.

    Attributes:
        width, height: size that the camera was calibrated at [px].
        distortion_model, distortion: of the lens, D.
        matrix: K, 9 numbers [px], row by row; all 0: not calibrated.
        rectification: R, 9 numbers.
        projection: P, 12 numbers.
        name: of the camera.
        binning: across, down; 0 means 1.
        region: x_offset, y_offset, height, width, do_rectify; all 0: the whole picture.

    Raises:
        BadInputError: a wrong number of values.
    """

    width: int
    height: int
    distortion_model: str
    distortion: Tuple[float, ...]
    matrix: Tuple[float, ...]
    rectification: Tuple[float, ...]
    projection: Tuple[float, ...]
    name: str = ''
    binning: Tuple[int, int] = (0, 0)
    region: Tuple[int, int, int, int, bool] = _NO_REGION

    def __post_init__(self) -> None:
        for key, count in (('matrix', 9), ('rectification', 9), ('projection', 12), ('distortion', None)):
            values = tuple(float(value) for value in getattr(self, key))
            if count is not None and len(values) != count:
                raise BadInputError(f'calibration: {key} has {len(values)} numbers, expected {count}')
            object.__setattr__(self, key, values)

    @property
    def is_calibrated(self) -> bool:
        """Say whether there are focal lengths at all."""
        return any(self.matrix)

    def camera(self) -> CameraModel:
        """Return the camera, checked; of the whole sensor, whatever binning and region of interest are.

        Raises:
            BadInputError: not calibrated, or an unknown distortion model.
        """
        return CameraModel(self.width, self.height, np.array(self.matrix), self.distortion_model,
                           np.array(self.distortion))

    @property
    def picture_size(self) -> Tuple[int, int]:
        """Return width and height of the pictures [px], after binning and the region of interest."""
        _, _, height, width, _ = self.region
        return ((width or self.width) // (self.binning[0] or 1), (height or self.height) // (self.binning[1] or 1))


def pinhole_calibration(width: int, height: int, focal: Sequence[float], centre: Sequence[float],
                        distortion: Sequence[float] = (), distortion_model: str = '') -> Calibration:
    """Return the calibration of a single camera.

    Args:
        focal, centre: fx, fy and cx, cy [px].
        distortion: coefficients; none: five zeros of plumb_bob, as drivers say "no distortion".
        distortion_model: empty: told by the number of coefficients.

    Raises:
        BadInputError: the number of coefficients tells no model.
    """
    if not distortion_model and len(distortion) not in _MODELS:
        raise BadInputError(f'{len(distortion)} distortion coefficients, expected 4 or 5 (plumb_bob), or 8, 12 or 14 '
                            '(rational_polynomial); name another model with --distortion-model')
    model = distortion_model or _MODELS[len(distortion)]
    (fx, fy), (cx, cy) = focal, centre
    return Calibration(width, height, model, tuple(distortion) or (0.0,) * 5, (fx, 0, cx, 0, fy, cy, 0, 0, 1),
                       _IDENTITY, (fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0))


def read_calibration(path: Path) -> Calibration:
    """Read a calibration: as camera_calibration writes it, a CameraInfo that `rostopic echo` printed, or JSON.

    JSON: with the keys of a CameraInfo, or Open3D's camera intrinsics (`intrinsic_matrix`, column by column).

    Raises:
        BadInputError: the file can not be read, or is none of these.
    """
    try:
        text = path.read_text()
        # rostopic echo ends each message with ---
        values = json.loads(text) if text.lstrip().startswith('{') else next(yaml.safe_load_all(text), None)
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise BadInputError(f'calibration {path} can not be read: {error}') from error
    return calibration_from_values(values, str(path))


def calibration_from_values(values: Any, source: str) -> Calibration:
    """Return the calibration of the content of a file; see `read_calibration`.

    Raises:
        BadInputError: a key is missing, or a value wrong; the text begins with `source`.
    """
    try:
        if 'camera_matrix' in values:
            return _of_camera_calibration(values)
        if 'K' in values:
            return _of_camera_info(values)
        if 'intrinsic_matrix' in values:
            return _of_open3d(values)
        raise KeyError('camera_matrix, K or intrinsic_matrix')
    except (KeyError, TypeError, ValueError, AttributeError, BadInputError) as error:
        raise BadInputError(f'{source} is no calibration as camera_calibration writes it (image_width, image_height, '
                            'camera_matrix, ...), no printed CameraInfo (width, height, D, K, ...) and no intrinsics '
                            f'of Open3D: {error if isinstance(error, BadInputError) else repr(error)}') from error


def calibration_text(calibration: Calibration) -> str:
    """Return the file as camera_calibration writes it, from which the very same calibration is read."""
    def matrix(rows: int, values: Sequence[float]) -> Dict[str, Any]:
        return {'rows': rows, 'cols': len(values) // rows, 'data': list(values)}

    values = {'image_width': calibration.width, 'image_height': calibration.height, 'camera_name': calibration.name,
              'camera_matrix': matrix(3, calibration.matrix), 'distortion_model': calibration.distortion_model,
              'distortion_coefficients': matrix(1, calibration.distortion),
              'rectification_matrix': matrix(3, calibration.rectification),
              'projection_matrix': matrix(3, calibration.projection)}
    # what the format does not know, other readers skip
    if calibration.binning != (0, 0):
        values['binning'] = list(calibration.binning)
    if calibration.region != _NO_REGION:
        values['roi'] = list(calibration.region)
    return yaml.safe_dump(values, default_flow_style=None, sort_keys=False)


def _of_camera_calibration(values: Dict[str, Any]) -> Calibration:
    matrix = values['camera_matrix']['data']
    return _calibration(
        values['image_width'], values['image_height'], matrix, values.get('distortion_model'),
        values.get('distortion_coefficients', {}).get('data', ()), values.get('rectification_matrix', {}).get('data'),
        values.get('projection_matrix', {}).get('data'), str(values.get('camera_name', '')),
        tuple(values.get('binning', (0, 0))), tuple(values.get('roi', _NO_REGION)))


def _of_camera_info(values: Dict[str, Any]) -> Calibration:
    region = values.get('roi') or {}
    return _calibration(
        values['width'], values['height'], values['K'], values.get('distortion_model'), values.get('D', ()),
        values.get('R'), values.get('P'), '', (int(values.get('binning_x', 0)), int(values.get('binning_y', 0))),
        (*(int(region.get(key, 0)) for key in ('x_offset', 'y_offset', 'height', 'width')),
         bool(region.get('do_rectify', False))))


def _of_open3d(values: Dict[str, Any]) -> Calibration:
    columns = np.array(values['intrinsic_matrix'], np.float64).reshape(3, 3)
    return _calibration(values['width'], values['height'], columns.T.ravel().tolist(), None, ())


def _calibration(width: Any, height: Any, matrix: Sequence[Any], model: Optional[str], distortion: Sequence[Any],
                 rectification: Optional[Sequence[Any]] = None, projection: Optional[Sequence[Any]] = None,
                 name: str = '', binning: Tuple[int, int] = (0, 0), region: Tuple[int, int, int, int, bool] = _NO_REGION
                 ) -> Calibration:
    """Return a calibration; what is None is that of a single camera without distortion."""
    matrix = [float(value) for value in matrix]
    if len(matrix) != 9:
        raise BadInputError(f'the camera matrix has {len(matrix)} numbers, expected 9')
    if model is None:
        model, distortion = _MODELS.get(len(distortion), ''), distortion or (0.0,) * 5
    if projection is None:
        projection = (*matrix[:3], 0, *matrix[3:6], 0, *matrix[6:], 0)
    return Calibration(int(width), int(height), model, tuple(distortion), tuple(matrix),
                       _IDENTITY if rectification is None else tuple(rectification), tuple(projection), name, binning,
                       region)
