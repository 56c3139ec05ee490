"""Cameras that other programs have calibrated: their files, and where the cameras are by these.

Sources of the formats:

    Pose2Sim    perfanalytics/pose2sim 003a7ad, common.py computeP: x_camera = Rodrigues(rotation) x + translation, [m]
    Qualisys    the same, calibration.py read_qca, and the Calib.toml that it makes of its demo's .qca.txt: x, y, z are
                the centre of the camera [mm], the rows r11 r12 r13 ... its axes right, up and back in the room;
                focal lengths and centres in 1/64 px of the sensor, all as of 1080 rows
                where video_resolution is another ("720p"). Pose2Sim divides the distortion by 64 as well; the
                same cameras, calibrated with a checkerboard (Calib_scene.toml), show that it has no unit
    Kalibr      ethz-asl/kalibr 0b8b9e8, wiki "yaml formats": x_camera = T_cn_cnm1 x_previous, [m];
                t_imu = t_camera + timeshift_cam_imu
    OpenCV      x_camera = R x + T of each camera, as of solvePnP
    ROS         sensor_msgs/CameraInfo: the rectification R, and P = K' [1 | t], of cameras that are rectified together
"""
import itertools
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Tuple
from xml.etree import ElementTree

import cv2
import numpy as np

from openpose_ros_pkg.calibration import Calibration, calibration_from_values, distortion_model, pinhole_calibration
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.structured_text import yaml_value
from skeleton_extract_3d.points.camera import calibrated_camera

# Rotation matrices of few digits differ from orthogonal by this.
_ROUNDED = 0.01
_QUALISYS_PIXEL, _QUALISYS_UNIT, _QUALISYS_ROWS = 1 / 64, 0.001, 1080
# Axes of Qualisys' cameras (right, up, back) in optical ones (right, down, forward).
_FROM_QUALISYS = np.diag([1.0, -1.0, -1.0])
# Sections of Calib.toml that are no cameras.
_OTHER_SECTIONS = ('metadata', 'capture_volume', 'charuco', 'checkerboard')
_EXPECTED = ('a Calib.toml of Pose2Sim, a .qca.txt of Qualisys, a camchain of Kalibr, or a YAML file of each camera '
             'with camera_matrix and either R and T, rvec and tvec, or P and R of cameras that are rectified together')


@dataclass(frozen=True, eq=False)
class KnownCamera:
    """A calibrated camera: x_camera = R x + t.

    Attributes:
        name: as the file has it.
        calibration: of its lens and image.
        rotation: R, (3, 3), rounded errors removed.
        translation: t, (3,), in the unit of the file.
        clock_offset: [s], is added to the stamps of this camera.

    Raises:
        BadInputError: R is no rotation, a number is not finite, or no lens has such values.
    """

    name: str
    calibration: Calibration
    rotation: np.ndarray
    translation: np.ndarray
    clock_offset: float = 0.0

    def __post_init__(self) -> None:
        calibrated_camera(self.calibration)
        rotation = np.array(self.rotation, np.float64)
        if rotation.size == 3:
            rotation = cv2.Rodrigues(rotation.reshape(3))[0]
        rotation = rotation.reshape(3, 3)
        translation = np.array(self.translation, np.float64).reshape(3)
        if not (np.isfinite(rotation).all() and np.isfinite(translation).all()) or np.linalg.det(rotation) < 0 or (
                abs(rotation @ rotation.T - np.eye(3)).max() > _ROUNDED):
            raise BadInputError(f"camera '{self.name}': {rotation.round(4).tolist()} is no rotation, or "
                                f'{translation.tolist()} no translation')
        left, _, right = np.linalg.svd(rotation)
        object.__setattr__(self, 'rotation', left @ right)
        object.__setattr__(self, 'translation', translation)


class KnownCameras(NamedTuple):
    """What a calibration has."""

    cameras: Tuple[KnownCamera, ...]
    is_room: bool  # whether the frame is that of a room, z up; else it is a camera's, x right, y down, z forward
    unit: float = 1.0  # of translations [m], if the file does not leave that to its author


def read_known_cameras(paths: Sequence[Path]) -> KnownCameras:
    """Read the files of a calibration.

    Raises:
        BadInputError: a file can not be read, or is of no format that is known; the text says which are.
    """
    try:
        texts = {path: path.read_text(encoding='utf-8-sig') for path in paths}
    except (OSError, UnicodeDecodeError) as error:
        raise BadInputError(f'{paths[0]} can not be read: {error}') from error
    first = texts[paths[0]]
    read = (_qualisys if first.lstrip().startswith('<') else _pose2sim if paths[0].suffix == '.toml' else
            _kalibr if re.search('^cam0:', first, re.MULTILINE) else None)
    if read and len(paths) > 1:
        raise BadInputError(f'{paths[0]} has all cameras of a calibration, expected no other file beside it')
    try:
        known = read(first) if read else _files_of_cameras({path: yaml_value(text) for path, text in texts.items()})
        if not known.cameras:
            raise ValueError('it has no cameras')
        return known
    except BadInputError:
        raise
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError,
            ElementTree.ParseError, np.linalg.LinAlgError, cv2.error) as error:
        raise BadInputError(f'{", ".join(map(str, paths))}: {error!r}; expected {_EXPECTED}') from error


def seen_from_a_level_camera(known: KnownCameras, tilt: float, height: float) -> KnownCameras:
    """Return cameras in the frame of a room, z up, whose x is where the frame of the file looks.

    Args:
        known: in a camera's frame.
        tilt: by which this camera looks down [deg]; it is not rolled.
        height: of it [m, in the unit of the file].
    """
    down, along = np.sin(np.radians(tilt)), np.cos(np.radians(tilt))
    from_room = np.array([[0, -1, 0], [-down, 0, -along], [along, 0, -down]])
    place = np.array([0, 0, height])
    return known._replace(is_room=True, cameras=tuple(
        replace(camera, rotation=camera.rotation @ from_room,
                translation=camera.translation - camera.rotation @ from_room @ place) for camera in known.cameras))


def _pose2sim(text: str) -> KnownCameras:
    try:
        from tomllib import loads
    except ImportError:  # before Python 3.11
        from toml import loads  # type: ignore[no-redef]
    cameras = []
    for section, values in loads(text).items():
        if section not in _OTHER_SECTIONS and isinstance(values, dict):
            calibration = _calibration(values['size'], values['matrix'], values['distortions'],
                                       'equidistant' if values.get('fisheye') else '')
            cameras.append(KnownCamera(str(values.get('name', section)), calibration, values['rotation'],
                                       values['translation']))
    return KnownCameras(tuple(cameras), True)


def _qualisys(text: str) -> KnownCameras:
    if '<!DOCTYPE' in text or '<!ENTITY' in text:  # entities of entities would take all memory
        raise BadInputError('a calibration of Qualisys has no document type')
    found = [camera for camera in ElementTree.fromstring(text.encode()).findall('cameras/camera')  # noqa: S314
             if camera.get('active') != '0']
    video = [camera for camera in found if re.search('video|none', camera.get('model', ''), re.IGNORECASE)]
    cameras = []
    for camera in video or found:
        lens, image, place = ({key: float(value) for key, value in camera.find(part).attrib.items()}  # type: ignore
                              for part in ('intrinsic', 'fov_video', 'transform'))
        fu, fv, cu, cv, skew = (_QUALISYS_PIXEL * lens[name] for name in (
            'focalLengthU', 'focalLengthV', 'centerPointU', 'centerPointV', 'skew'))
        matrix = np.array([[fu, skew, cu - image['left']], [0, fv, cv - image['top']], [0, 0, 1]])
        size = np.array([image['right'] - image['left'] + 1, image['bottom'] - image['top'] + 1])
        rows = re.fullmatch(r'(\d+)p', camera.get('video_resolution', ''))
        scale = 1.0 if rows is None else int(rows[1]) / _QUALISYS_ROWS
        matrix[:2], size = scale * matrix[:2], scale * size
        # OpenCV's order, with its third radial coefficient last; Qualisys writes tangental
        distortion = [lens[name] for name in ('radialDistortion1', 'radialDistortion2', 'tangentalDistortion1',
                                              'tangentalDistortion2', 'radialDistortion3')]
        rotation = _FROM_QUALISYS @ np.array([[place[f'r{i}{j}'] for j in (1, 2, 3)] for i in (1, 2, 3)])
        cameras.append(KnownCamera(camera.get('serial', ''), _calibration(size, matrix, distortion), rotation,
                                   -rotation @ [place[axis] for axis in 'xyz']))
    return KnownCameras(tuple(cameras), True, _QUALISYS_UNIT)


def _kalibr(text: str) -> KnownCameras:
    cameras: List[KnownCamera] = []
    pose, values = np.eye(4), yaml_value(text)
    for number in itertools.takewhile(lambda number: f'cam{number}' in values, itertools.count()):
        camera = values[f'cam{number}']
        if camera['camera_model'] != 'pinhole':
            raise BadInputError(f"cam{number} is of the model {camera['camera_model']}, which no CameraInfo can hold; "
                                'calibrate as pinhole')
        if number:
            pose = _numbers(camera['T_cn_cnm1'], (4, 4)) @ pose
        fu, fv, pu, pv = camera['intrinsics']
        calibration = _calibration(camera['resolution'], [[fu, 0, pu], [0, fv, pv], [0, 0, 1]],
                                   camera['distortion_coeffs'], distortion_model(camera['distortion_model']))
        shift = float(camera.get('timeshift_cam_imu', 0)) - float(values['cam0'].get('timeshift_cam_imu', 0))
        cameras.append(KnownCamera(f'cam{number}', calibration, pose[:3, :3], pose[:3, 3], shift))
    return KnownCameras(tuple(cameras), False)


def _files_of_cameras(files: Mapping[Path, Dict[str, Any]]) -> KnownCameras:
    """Return cameras with a file each: all with R and T, or all rectified together."""
    placed, rectified = [], []
    for path, values in files.items():
        calibration = calibration_from_values(values, str(path))
        name = calibration.name or path.stem
        keys = next((keys for keys in (('R', 'T'), ('rvec', 'tvec')) if set(keys) <= set(values)), None)
        if keys:
            rotation, translation = (_numbers(values[key]) for key in keys)
            placed.append(KnownCamera(name, calibration, rotation, translation))
        else:  # in the rectified frame of the cameras that it is rectified with
            back = np.reshape(calibration.rectification, (3, 3)).T
            projection = np.reshape(calibration.projection, (3, 4))
            shift = back @ np.linalg.inv(projection[:, :3]) @ projection[:, 3]
            rectified.append(KnownCamera(name, calibration, back, shift))
    if (placed and rectified) or not (placed or any(camera.translation.any() for camera in rectified)):
        raise BadInputError(f'{", ".join(map(str, files))} do not say where all cameras are; expected {_EXPECTED}')
    return KnownCameras(tuple(placed or rectified), bool(placed))


def _calibration(size: Any, matrix: Any, distortion: Any, model: str = '') -> Calibration:
    k = _numbers(matrix, (3, 3))
    if k[0, 1] != 0:
        raise BadInputError(f'the axes of the image have a skew of {k[0, 1]:g} px, which no CameraInfo can hold')
    return pinhole_calibration(round(float(size[0])), round(float(size[1])), (k[0, 0], k[1, 1]), (k[0, 2], k[1, 2]),
                               _numbers(distortion).tolist(), model)


def _numbers(values: Any, shape: Tuple[int, ...] = (-1,)) -> np.ndarray:
    """Return numbers of a list, of a list of rows, or of a matrix as OpenCV writes it."""
    found = np.array(values['data'] if isinstance(values, dict) else values, np.float64)
    return found.reshape(shape)
