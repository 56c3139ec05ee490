"""Calibrations of cameras: the content of a CameraInfo, in the usual file formats."""
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Dict, Sequence, Tuple

import numpy as np
import yaml

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.structured_text import file_values

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_NO_DISTORTION = (0.0,) * 5
_NO_BINNING, _NO_REGION = (0, 0), (0, 0, 0, 0, False)
# Keys of a file of camera_calibration, in its order; matrices are mappings of rows, cols and data. Binning and region
# are an extension that other readers skip.
_FILE_KEYS = {'width': 'image_width', 'height': 'image_height', 'name': 'camera_name', 'matrix': 'camera_matrix',
              'distortion_model': 'distortion_model', 'distortion': 'distortion_coefficients',
              'rectification': 'rectification_matrix', 'projection': 'projection_matrix', 'binning': 'binning',
              'region': 'roi'}
_ROWS = {'matrix': 3, 'distortion': 1, 'rectification': 3, 'projection': 3}
# Spellings of distortion models, and what they are in a CameraInfo.
_SPELLINGS = {'': '', 'none': '', 'pinhole': '', 'plumb_bob': 'plumb_bob', 'rational_polynomial': 'rational_polynomial',
              'equidistant': 'equidistant', 'rational': 'rational_polynomial',
              **dict.fromkeys(('radtan', 'radial_tangential', 'brown_conrady'), 'plumb_bob'),
              **dict.fromkeys(('equi', 'fisheye', 'kannala_brandt', 'kannala_brandt4'), 'equidistant')}
# Keys by which files name the distortion model; the first one does not matter without any.
_MODEL_KEYS = ('distortion_model', 'camera_model')


@dataclass(frozen=True)
class Calibration:
    """The content of a sensor_msgs/CameraInfo, unchanged: also R and P, and a D of zeros.

    Raises:
        BadInputError: a wrong number of values.
        ValueError, TypeError: a value is no number.
    """

    width: int  # image size at calibration [px]
    height: int
    distortion_model: str  # of the lens, D
    distortion: Tuple[float, ...]
    matrix: Tuple[float, ...]  # K, 9 numbers [px], row by row; all 0: not calibrated
    rectification: Tuple[float, ...]  # R, 9 numbers
    projection: Tuple[float, ...]  # P, 12 numbers
    name: str = ''  # of the camera
    binning: Tuple[int, int] = _NO_BINNING  # across, down; 0 means 1
    # x_offset, y_offset, height, width, do_rectify; all 0: the whole image
    region: Tuple[int, int, int, int, bool] = _NO_REGION

    def __post_init__(self) -> None:
        for key, count in (('matrix', 9), ('rectification', 9), ('projection', 12), ('distortion', None)):
            values = tuple(float(value) for value in getattr(self, key))
            if count is not None and len(values) != count:
                raise BadInputError(f'calibration: {key} has {len(values)} numbers, expected {count}')
            object.__setattr__(self, key, values)
        for key, convert in (('width', int), ('height', int), ('name', str), ('binning', tuple), ('region', tuple)):
            object.__setattr__(self, key, convert(getattr(self, key)))

    @property
    def is_calibrated(self) -> bool:
        """Whether the camera matrix is known."""
        return any(self.matrix)

    @property
    def image_size(self) -> Tuple[int, int]:
        """Width and height of the images [px], after binning and the region of interest."""
        _, _, height, width, _ = self.region
        return ((width or self.width) // (self.binning[0] or 1), (height or self.height) // (self.binning[1] or 1))


def distortion_model(name: str) -> str:
    """Return the name of a distortion model in a CameraInfo; empty: no distortion; BadInputError: it is unknown."""
    plain = re.sub(r'[\s-]+', '_', name.strip().lower())
    if plain not in _SPELLINGS:
        raise BadInputError(f"distortion model '{name}' is unknown; expected one of none, plumb_bob, "
                            'rational_polynomial, equidistant')
    return _SPELLINGS[plain]


def turned(calibration: Calibration, degrees: int) -> Calibration:
    """Return the calibration of images turned clockwise by 0 to 270 degrees; BadInputError: a tilted sensor."""
    for _ in range(degrees // 90 if calibration.is_calibrated else 0):
        # a quarter takes u, v to h - 1 - v, u, and x, y to -y, x
        wide, high = calibration.width, calibration.height
        last = high - max(calibration.binning[1], 1)  # a binned pixel is where its first one is
        x, y, height, width, rectified = calibration.region
        fx, _, cx, _, fy, cy, *_ = calibration.matrix
        px, skew, pcx, tx, below, py, pcy, ty, *row = calibration.projection
        quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
        rectification = quarter @ np.reshape(calibration.rectification, (3, 3)) @ quarter.T
        distortion = list(calibration.distortion)
        if any(distortion[12:]):
            raise BadInputError(f'images of a camera whose sensor is tilted, D {distortion}, can not be turned')
        if any(distortion) and distortion_model(calibration.distortion_model) != 'equidistant':
            distortion[2:4] = [distortion[3], -distortion[2]] if len(distortion) > 3 else distortion[2:4]
            distortion[8:12] = [-each for each in distortion[10:12]] + distortion[8:10]
        calibration = replace(
            calibration, width=high, height=wide, distortion=tuple(distortion), binning=calibration.binning[::-1],
            region=(high - y - height, x, width, height, rectified) if height else calibration.region,
            rectification=tuple(rectification.ravel()), matrix=(fy, 0, last - cy, 0, fx, cx, 0, 0, 1),
            projection=(py, below, last - pcy, -ty, skew, px, pcx, tx, *row))
    return calibration


def pinhole_calibration(width: int, height: int, focal: Sequence[float], centre: Sequence[float],
                        distortion: Sequence[float] = (), distortion_model: str = '') -> Calibration:
    """Return the calibration of a single camera.

    Args:
        focal, centre: fx, fy and cx, cy [px].
        distortion: coefficients; none: five zeros of plumb_bob, the drivers' "no distortion".
        distortion_model: empty: OpenCV's.
    """
    (fx, fy), (cx, cy) = focal, centre
    return _completed({'width': width, 'height': height, 'matrix': (fx, 0, cx, 0, fy, cy, 0, 0, 1),
                       'distortion': distortion or _NO_DISTORTION, 'distortion_model': distortion_model or None})


def read_calibration(path: Path) -> Calibration:
    """Read a calibration: as camera_calibration writes it, a CameraInfo that `rostopic echo` printed, or JSON.

    JSON: with the keys of a CameraInfo, or Open3D's camera intrinsics (`intrinsic_matrix`, column by column).

    Raises:
        BadInputError: the file can not be read, or is none of these.
    """
    return calibration_from_values(file_values(path, f'calibration {path}'), str(path))


def calibration_from_values(values: Any, source: str) -> Calibration:
    """Return the calibration in the content of a file; see `read_calibration`.

    Raises:
        BadInputError: a key is missing, or a value is wrong; the text begins with `source`.
    """
    try:
        for key, read in (('camera_matrix', _of_camera_calibration), ('K', _of_camera_info), ('k', _of_camera_info),
                          ('intrinsic_matrix', _of_open3d)):
            if key in values:
                return _completed(_with_model(read(values), values))
        raise KeyError('camera_matrix, K or intrinsic_matrix')
    except (AttributeError, KeyError, OverflowError, TypeError, ValueError, BadInputError) as error:
        raise BadInputError(f'{source} is no calibration as camera_calibration writes it (image_width, image_height, '
                            'camera_matrix, ...), no printed CameraInfo (width, height, D, K, ...) and no intrinsics '
                            f'of Open3D: {error if isinstance(error, BadInputError) else repr(error)}') from error


def calibration_text(calibration: Calibration) -> str:
    """Return the file as camera_calibration writes it; reading it gives an equal calibration."""
    values: Dict[str, Any] = {}
    for field, key in _FILE_KEYS.items():
        value = getattr(calibration, field)
        if field in _ROWS:
            values[key] = {'rows': _ROWS[field], 'cols': len(value) // _ROWS[field], 'data': list(value)}
        elif value not in (_NO_BINNING, _NO_REGION):
            values[key] = list(value) if isinstance(value, tuple) else value
    return yaml.safe_dump(values, default_flow_style=None, sort_keys=False)


def _of_camera_calibration(values: Dict[str, Any]) -> Dict[str, Any]:
    found = {field: values[key] for field, key in _FILE_KEYS.items() if key in values or field in ('width', 'height')}
    return {field: value.get('data') if field in _ROWS else value for field, value in found.items()}


def _of_camera_info(values: Dict[str, Any]) -> Dict[str, Any]:
    values = {key.upper() if key in ('d', 'k', 'r', 'p') else key: value for key, value in values.items()}  # ROS 2
    region = values.get('roi') or {}
    return {'width': values['width'], 'height': values['height'], 'matrix': values['K'],
            'distortion_model': values.get('distortion_model'), 'distortion': values.get('D', ()),
            'rectification': values.get('R'), 'projection': values.get('P'),
            'binning': (int(values.get('binning_x', 0)), int(values.get('binning_y', 0))),
            'region': (*(int(region.get(key, 0)) for key in ('x_offset', 'y_offset', 'height', 'width')),
                       bool(region.get('do_rectify', False)))}


def _of_open3d(values: Dict[str, Any]) -> Dict[str, Any]:
    columns = np.array(values['intrinsic_matrix'], np.float64).reshape(3, 3)
    return {'width': values['width'], 'height': values['height'], 'matrix': columns.T.ravel().tolist()}


def _with_model(read: Dict[str, Any], values: Dict[str, Any]) -> Dict[str, Any]:
    """Return what was read, with the distortion model that a file names by any key."""
    distortion = read.get('distortion') or ()
    names = [str(values[key]) for key in _MODEL_KEYS[not any(distortion):] if values.get(key)]
    if 'fisheye_model' in values:  # of OpenCV's calibration
        names.append('fisheye' if values['fisheye_model'] else 'plumb_bob')
    models = sorted({*map(distortion_model, names)} - {''})
    if len(models) > 1:
        raise BadInputError(f'it names several distortion models: {", ".join(models)}')
    if not models and len(distortion) == 4 and any(distortion):
        raise BadInputError('it names no distortion model, and lenses of several have 4 coefficients; add '
                            'distortion_model: plumb_bob, or equidistant for a fisheye lens')
    return {**read, 'distortion_model': models[0]} if models else read


def _completed(values: Dict[str, Any]) -> Calibration:
    """Return a calibration; missing values and None are those of a single camera without distortion."""
    matrix, distortion = values['matrix'], values.get('distortion') or ()
    if values.get('distortion_model') is None:
        # OpenCV names none
        values = {**values, 'distortion_model': 'plumb_bob' if len(distortion) <= 5 else 'rational_polynomial'}
        distortion = distortion or _NO_DISTORTION
    defaults = {'rectification': _IDENTITY, 'projection': (*matrix[:3], 0, *matrix[3:6], 0, *matrix[6:], 0)}
    given = {key: value for key, value in values.items() if value is not None}
    return Calibration(**{**defaults, **given, 'distortion': distortion})
