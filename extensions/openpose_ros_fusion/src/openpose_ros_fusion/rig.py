"""Where the cameras of a room stand, in a file.

    fixed_frame: world
    cameras:
    - name: kitchen
      frame_id: kitchen_rgb_optical_frame
      rotation: [-0.5, 0.5, -0.5, 0.5]
      translation: [0.0, 0.0, 1.4]
      clock_offset: 0.07
"""
from dataclasses import dataclass
from pathlib import Path
from typing import Tuple

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.files import write_whole
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.structured_text import file_values
from skeleton_extract_3d.points.transform import Transform, quaternions

# Quaternions may differ from length 1 by this, as those do that were rounded to few digits.
_LENGTH_ERROR = 0.01
_SHAPES = {'rotation': (4,), 'translation': (3,), 'clock_offset': ()}
_EXPECTED = ('expected name and frame_id: texts, rotation: x, y, z, w of a unit quaternion, translation: x, y, z [m], '
             'and clock_offset: seconds, which may be left out')


@dataclass(frozen=True, eq=False)
class RigCamera:
    """A camera in the fixed frame: x_fixed = R x_camera + translation.

    Attributes:
        name: as the programs name it, its namespace.
        frame_id: optical frame of its images or points (x right, y down, z forward).
        rotation: (4,) unit quaternion x, y, z, w of R.
        translation: (3,) [m], centre of the camera.
        clock_offset: [s], is added to the stamps of this camera.

    Raises:
        ValueError: a value is of the wrong type, shape or range.
    """

    name: str
    frame_id: str
    rotation: np.ndarray
    translation: np.ndarray
    clock_offset: float = 0.0

    def __post_init__(self) -> None:
        try:
            values = {key: np.asarray(getattr(self, key), np.float64) for key in _SHAPES}
            length = float(np.linalg.norm(values['rotation']))
            right = (all(isinstance(text, str) and text for text in (self.name, self.frame_id))
                     and {key: value.shape for key, value in values.items()} == _SHAPES
                     and all(np.isfinite(value).all() for value in values.values())
                     and abs(length - 1) <= _LENGTH_ERROR)
        except (TypeError, ValueError, OverflowError):
            right = False
        if not right:
            raise ValueError(f'{self} is no camera of a rig; {_EXPECTED}')
        for key, value in (('rotation', values['rotation'] / length), ('frame_id', frame_name(self.frame_id)),
                           ('translation', values['translation']), ('clock_offset', float(values['clock_offset']))):
            object.__setattr__(self, key, value)

    @property
    def pose(self) -> Transform:
        """R (3, 3) and translation (3,) [m] from the optical frame to the fixed one."""
        # SciPy before 1.4 has no as_matrix; a rotation of the axes is the same everywhere
        return Rotation.from_quat(self.rotation).apply(np.eye(3)).T, self.translation


@dataclass(frozen=True, eq=False)
class Rig:
    """The cameras that stand in a frame: one at least, each name once.

    Raises:
        ValueError: there is no camera, a name is there twice, or a name is no text.
    """

    fixed_frame: str
    cameras: Tuple[RigCamera, ...]

    def __post_init__(self) -> None:
        if not isinstance(self.fixed_frame, str) or not self.fixed_frame:
            raise ValueError(f'fixed_frame is {self.fixed_frame!r}, expected a text')
        object.__setattr__(self, 'fixed_frame', frame_name(self.fixed_frame))
        names = [camera.name for camera in self.cameras]
        if not names:
            raise ValueError('it has no cameras')
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f'it has two cameras of the name {twice[0]!r}')

    def camera(self, name: str) -> RigCamera:
        """Return a camera by its name.

        Raises:
            BadInputError: there is none of this name; the text says which there are.
        """
        found = {camera.name: camera for camera in self.cameras}
        if name not in found:
            raise BadInputError(f"the rig has no camera '{name}', but {', '.join(found)}")
        return found[name]


def rig_camera(name: str, frame_id: str, pose: Transform, clock_offset: float = 0.0) -> RigCamera:
    """Return a camera by the rotation (3, 3) and translation (3,) [m] from its optical frame to the fixed one."""
    return RigCamera(name, frame_id, quaternions(np.asarray(pose[0])[np.newaxis])[0], np.asarray(pose[1]), clock_offset)


def read_rig(path: Path) -> Rig:
    """Read a rig.

    Raises:
        BadInputError: it can not be read or is none; the text names the file, the key and what is expected.
    """
    values = file_values(path, f'rig {path}')
    try:
        if not isinstance(values, dict) or set(values) != {'fixed_frame', 'cameras'} or not isinstance(
                values['cameras'], list):
            raise ValueError('expected fixed_frame: TEXT, cameras: a list, and no other key')
        return Rig(values['fixed_frame'], tuple(RigCamera(**camera) for camera in values['cameras']))
    except (TypeError, ValueError) as error:  # TypeError: keys that are no attributes
        what = f'; of each camera {_EXPECTED}' if isinstance(error, TypeError) else ''
        raise BadInputError(f'rig {path} can not be read: {error}{what}') from error


def write_rig(path: Path, rig: Rig) -> None:
    """Write a rig, whole or not at all; reading it gives an equal one. OSError: it can not be written."""
    write_whole(path, rig_text(rig).encode())


def rig_text(rig: Rig) -> str:
    """Return the file."""
    cameras = [{'name': camera.name, 'frame_id': camera.frame_id, 'rotation': camera.rotation.tolist(),
                'translation': camera.translation.tolist(), 'clock_offset': camera.clock_offset}
               for camera in rig.cameras]
    return str(yaml.safe_dump({'fixed_frame': rig.fixed_frame, 'cameras': cameras}, default_flow_style=None,
                              sort_keys=False))
