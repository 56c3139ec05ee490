"""RGB-D sequence folders: colour images, aligned depth images and the calibration of their camera.

Layout::

    rgb/ or color/   colour images (.jpg, .jpeg or .png)
    depth/           16-bit PNG, aligned to the colour images [mm], 0 = missing; the same names
    camera.yaml      calibration as camera_calibration writes it
    sequence.yaml    optional: fps [Hz], frame_id, T_world_camera (4 x 4, row by row), depth_scale (1000 per metre)
"""
import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional

import cv2
import numpy as np

from openpose_ros_pkg.calibration import read_calibration
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.stream.video_source import read_image
from openpose_ros_pkg.structured_text import file_values
from skeleton_extract_3d.points.camera import CameraModel, calibrated_camera, check_same_aspect

# Frames of a sequence that names none: of the camera, and of the world that T_world_camera leads to.
DEFAULT_FRAME, WORLD_FRAME = 'camera_optical_frame', 'world'
# What may come after the last frame when a sequence is played.
PLAYBACKS = ('loop', 'pause', 'forth_and_back', 'once')
_COLOUR_FOLDERS = ('rgb', 'color')
_COLOUR_SUFFIXES = ('.jpg', '.jpeg', '.png')
# A rotation matrix that was written with four digits still counts as one.
_ROTATION_TOLERANCE = 1e-3
# Depth in mm.
_UNITS_PER_METRE = 1000.0
_MOST_FPS, _MOST_UNITS = 1000, 1e6  # more than any file has: Hz, micrometres


@dataclass(frozen=True)
class RgbdFrame:
    """Time since the first frame [s], bgr (H, W, 3) uint8, depth (H', W') uint16 [mm] of this view, 0 = missing."""

    time: float
    bgr: np.ndarray
    depth: np.ndarray


class RgbdSequence:
    """The frames of a sequence folder, in the order of their names; images are read when asked for.

    Args:
        folder: holds rgb/ or color/, and depth/.
        camera: of the colour images.
        fps: frames per second [Hz]; None: not known, times are those of 1 Hz.
        frame_id: of the camera's optical frame; empty if it is not known.
        T_world_camera: (4, 4) from the optical frame to an upright world frame (z up) [m], or None.

    Raises:
        BadInputError: a folder is missing, or colour and depth images do not belong together.
    """

    def __init__(self, folder: Path, camera: CameraModel, fps: Optional[float] = None, frame_id: str = '',
                 T_world_camera: Optional[np.ndarray] = None) -> None:  # noqa: N803 (the field's notation)
        folder = Path(folder)
        self.camera = camera
        self.fps = fps
        self.frame_id = frame_id
        self.T_world_camera = T_world_camera
        colour = next((folder / name for name in _COLOUR_FOLDERS if (folder / name).is_dir()), None)
        if colour is None:
            raise BadInputError(f"sequence {folder} has no folder {' or '.join(_COLOUR_FOLDERS)} with colour images")
        if not (folder / 'depth').is_dir():
            raise BadInputError(f'sequence {folder} has no folder depth with aligned 16-bit PNG')
        self._colour, self._depth = _images(colour, _COLOUR_SUFFIXES), _images(folder / 'depth', ('.png',))
        _check_names(colour, self._colour, folder / 'depth', self._depth)

    @classmethod
    def read(cls, folder: Path) -> 'RgbdSequence':
        """Open a folder with a camera.yaml.

        Raises:
            BadInputError: a file is missing or not as expected.
        """
        folder = Path(folder).expanduser()
        if not folder.is_dir():
            raise BadInputError(f'sequence folder {folder} does not exist')
        values = read_sequence_values(folder)
        scale = values.pop('depth_scale')
        if scale not in (None, _UNITS_PER_METRE):
            raise BadInputError(f'{folder / "sequence.yaml"}: depth_scale = {scale:g}, expected {_UNITS_PER_METRE:g} '
                                '(mm); images_to_bag reads other ones')
        return cls(folder, calibrated_camera(read_calibration(folder / 'camera.yaml')), **values)

    def __len__(self) -> int:
        return len(self._colour)

    def __iter__(self) -> Iterator[RgbdFrame]:
        return (self.frame(i) for i in range(len(self)))

    def frame(self, index: int) -> RgbdFrame:
        """Read one frame.

        Raises:
            BadInputError: a file can not be decoded, or has not the camera's size.
        """
        bgr = read_image(self._colour[index], cv2.IMREAD_COLOR)
        depth = read_image(self._depth[index], cv2.IMREAD_UNCHANGED)
        size = (bgr.shape[1], bgr.shape[0])
        if size != (self.camera.width, self.camera.height):
            raise BadInputError(f'{self._colour[index]} is {size[0]} x {size[1]}, expected the size in the '
                                f'calibration, {self.camera.width} x {self.camera.height}')
        if depth.dtype != np.uint16 or depth.ndim != 2:
            raise BadInputError(f'{self._depth[index]}: expected one channel of 16 bit [mm], got {depth.dtype} of '
                                f'shape {depth.shape}')
        check_same_aspect(str(self._depth[index]), (depth.shape[1], depth.shape[0]), 'the colour image', size)
        return RgbdFrame(index / (self.fps or 1.0), bgr, depth)


def play_order(length: int, playback: str, pause: int = 0) -> Iterator[Optional[int]]:
    """Return the indices of frames in the order in which they are played, see PLAYBACKS; endless unless played once.

    With 'pause', `pause` black frames follow the last one, None each. Forth and back shows the first and the last frame
    once per turn, so that people do not stand still there.
    """
    if playback == 'once':
        return iter(range(length))
    back = range(length - 2, 0, -1) if playback == 'forth_and_back' else range(0)
    black = [None] * pause if playback == 'pause' else []
    return itertools.cycle([*range(length), *back, *black])


def read_sequence_values(folder: Path) -> Dict[str, Any]:
    """Return what the sequence.yaml of a folder says, None (frame_id: empty) for what it does not say.

    Raises:
        BadInputError: the file can not be read, has an unknown key or a wrong value.
    """
    path = folder / 'sequence.yaml'
    return sequence_values(path, file_values(path, str(path)) if path.is_file() else {})


def sequence_values(path: Path, values: Dict[str, Any]) -> Dict[str, Any]:
    """Return fps, frame_id, T_world_camera and depth_scale of the content of a file, checked; the path is for the
    errors.

    Raises:
        BadInputError: an unknown key or a wrong value.
    """
    known = ('fps', 'frame_id', 'T_world_camera', 'depth_scale')
    if not isinstance(values, dict):
        raise BadInputError(f'{path}: expected keys with values, got {type(values).__name__}')
    unknown = [str(key) for key in values if key not in known]  # YAML has keys of any type
    if unknown:
        raise BadInputError(f"{path} has unknown keys {', '.join(unknown)}; allowed: {', '.join(known)}")
    for name, most, unit in (('fps', _MOST_FPS, 'Hz'), ('depth_scale', _MOST_UNITS, 'units per metre')):
        value = values.get(name)
        if value is not None and not (isinstance(value, (int, float)) and 0 < value <= most):
            raise BadInputError(f'{path}: {name} = {value!r}, expected a number above 0, up to {most:g} [{unit}]')
    pose = values.get('T_world_camera')
    return {'fps': values.get('fps'), 'frame_id': frame_name(str(values.get('frame_id', ''))),
            'depth_scale': values.get('depth_scale'),
            'T_world_camera': None if pose is None else _rigid_transform(path, pose)}


def _rigid_transform(path: Path, values: Any) -> np.ndarray:
    try:
        matrix = np.array(values, np.float64).reshape(4, 4)
    except (TypeError, ValueError, OverflowError):
        raise BadInputError(f'{path}: T_world_camera = {values!r}, expected 4 x 4 numbers') from None
    rotation = matrix[:3, :3]
    upright = np.allclose(rotation @ rotation.T, np.eye(3), atol=_ROTATION_TOLERANCE) and np.linalg.det(rotation) > 0
    if not upright or not np.isfinite(matrix).all() or not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise BadInputError(f'{path}: T_world_camera is no rotation and translation: {matrix.tolist()}')
    return matrix


def _images(folder: Path, suffixes: tuple) -> List[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in suffixes and path.is_file())


def _check_names(colour_folder: Path, colour: List[Path], depth_folder: Path, depth: List[Path]) -> None:
    if not colour:
        raise BadInputError(f"{colour_folder} has no images ({', '.join(_COLOUR_SUFFIXES)})")
    stems, depth_stems = [path.stem for path in colour], [path.stem for path in depth]
    if stems != depth_stems:
        alone = sorted(set(stems) ^ set(depth_stems)) or ['one name twice']
        raise BadInputError(f'{colour_folder} has {len(stems)} images and {depth_folder} {len(depth_stems)}, expected '
                            f"the same names in both; without a partner: {', '.join(alone[:5])}"
                            f"{', ...' if len(alone) > 5 else ''}")
