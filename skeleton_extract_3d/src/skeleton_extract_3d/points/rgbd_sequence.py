"""The frames of RGB-D folders (`rgbd_folder`), one by one."""
import itertools
import logging
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Iterator, Optional

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.stream.video_source import read_image
from skeleton_extract_3d.points.camera import CameraModel, calibrated_camera, check_same_aspect
from skeleton_extract_3d.points.rgbd_folder import RgbdFolder, read_rgbd_folder
from skeleton_extract_3d.points.stamps import SECOND

_log = logging.getLogger(__name__)

# Frames of a sequence that names none: of the camera, and of the world that T_world_camera leads to.
DEFAULT_FRAME, WORLD_FRAME = 'camera_optical_frame', 'world'
# What may come after the last frame when a sequence is played.
PLAYBACKS = ('loop', 'pause', 'forth_and_back', 'once')
_UNITS_PER_METRE = 1000.0  # of the depth of frames


@dataclass(frozen=True)
class RgbdFrame:
    """Time since the first frame [s], bgr (H, W, 3) uint8, depth (H', W') uint16 [mm] of this view, 0 = missing."""

    time: float
    bgr: np.ndarray
    depth: np.ndarray


class RgbdSequence:
    """The frames of a folder that have a colour and a depth image, in their order; images are read when asked for.

    Args:
        folder: its images and what it says of them.
        camera: of the colour images.

    Attributes:
        fps: frames per second [Hz]; None: not known, times of numbered images are those of 1 Hz.
        frame_id: of the camera's optical frame; empty if it is not known.
        T_world_camera: (4, 4) from the optical frame to an upright world frame (z up) [m], or None.
    """

    def __init__(self, folder: RgbdFolder, camera: CameraModel) -> None:
        self.camera = camera
        self.fps, self.frame_id, self.T_world_camera = folder.fps, folder.frame_id, folder.T_world_camera
        self._scale = folder.depth_scale or _UNITS_PER_METRE
        colour, depth = ({file.stamp: file.path for file in folder.streams[stream]} for stream in ('colour', 'depth'))
        self._files = sorted((stamp, colour[stamp], depth[other]) for other, stamp in folder.colour_of.items())

    @classmethod
    def read(cls, folder: Path, camera: Optional[CameraModel] = None, rate: Optional[Fraction] = None
             ) -> 'RgbdSequence':
        """Open a folder.

        Args:
            camera: in place of that of the folder.
            rate: of numbered images, in place of that of the folder [Hz].

        Raises:
            BadInputError: a file is missing or not as expected.
        """
        folder = Path(folder).expanduser()
        found = read_rgbd_folder(folder, rate, default_rate=Fraction(1))
        if len(found.streams) < 2:
            raise BadInputError(f'sequence {folder} has {", ".join(found.streams)} images only, expected colour and '
                                'depth')
        if camera is None:
            if found.calibration is None:
                raise BadInputError(f'sequence {folder} has no calibration, expected camera.yaml or meta.json')
            camera = calibrated_camera(found.calibration)
        for remark in found.remarks:
            _log.warning('%s: %s', folder, remark)
        return cls(found, camera)

    def __len__(self) -> int:
        return len(self._files)

    def __iter__(self) -> Iterator[RgbdFrame]:
        return (self.frame(i) for i in range(len(self)))

    def frame(self, index: int) -> RgbdFrame:
        """Read one frame.

        Raises:
            BadInputError: a file can not be decoded, or has not the camera's size.
        """
        stamp, colour, path = self._files[index]
        bgr, depth = read_image(colour, cv2.IMREAD_COLOR), read_image(path, cv2.IMREAD_UNCHANGED)
        size = (bgr.shape[1], bgr.shape[0])
        if size != (self.camera.width, self.camera.height):
            raise BadInputError(f'{colour} is {size[0]} x {size[1]}, expected the size in the '
                                f'calibration, {self.camera.width} x {self.camera.height}')
        if depth.dtype not in (np.uint16, np.float32) or depth.ndim != 2:
            raise BadInputError(f'{path}: expected one channel of 16 bit or of float32 [m], got {depth.dtype} of '
                                f'shape {depth.shape}')
        check_same_aspect(str(path), (depth.shape[1], depth.shape[0]), 'the colour image', size)
        scale = self._scale if depth.dtype == np.uint16 else 1.0
        if scale != _UNITS_PER_METRE:
            known = np.nan_to_num(depth.astype(np.float64) * (_UNITS_PER_METRE / scale))
            depth = np.rint(np.clip(known, 0, np.iinfo(np.uint16).max)).astype(np.uint16)
        return RgbdFrame((stamp - self._files[0][0]) / SECOND, bgr, depth)


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
