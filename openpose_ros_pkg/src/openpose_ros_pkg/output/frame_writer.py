"""Write all files of a frame that the parameters ask for, under OpenPose's names."""
import logging
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Callable, List, Optional, Union

import cv2
import numpy as np

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.output.files import frame_name, writable_folder, write_whole
from openpose_ros_pkg.output.joint_order import in_joint_set
from openpose_ros_pkg.output.keypoint_file import FORMATS, keypoint_suffix, write_keypoint
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams, scale_keypoints
from openpose_ros_pkg.output.openpose_json import JSON_SUFFIX, write_json
from openpose_ros_pkg.output.video_file import VideoFile
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SKELETONS

_log = logging.getLogger(__name__)

# Frame rate of a video whose source names none, as of a folder of images [Hz].
DEFAULT_RATE = 10.0


@dataclass(frozen=True)
class SaveParams(Parameters):
    """What is saved of every frame. The names are OpenPose's."""

    write_json: str = parameter(
        '', "Folder for the keypoints in OpenPose's JSON layout, one file per frame; empty: none.")
    write_images: str = parameter('', 'Folder for the annotated images, one file per frame; empty: none.')
    write_images_format: str = parameter('png', 'Format of these images.', choices=('png', 'jpg'))
    write_video: str = parameter('', 'File for the annotated video, .mp4 or .avi; empty: none.')
    write_video_fps: float = parameter(
        -1.0, 'Frame rate of that video; -1: that of the source, or 10 where it has none (images, ROS topics).',
        unit='Hz', minimum=-1.0, maximum=1000.0)
    write_keypoint: str = parameter(
        '', 'Folder for the keypoints as a matrix in a file of OpenCV (cv::FileStorage), one per frame; empty: none.')
    write_keypoint_format: str = parameter('yml', 'Format of these files.', choices=FORMATS)
    write_joint_set: str = parameter(
        '', 'Joints and their order in JSON and keypoint files; empty: those of the network.',
        choices=('', *SKELETONS))

    def __post_init__(self) -> None:
        super().__post_init__()
        if -1 < self.write_video_fps <= 0:
            raise ParameterError(f"parameter 'write_video_fps' = {self.write_video_fps:g} is not allowed: above 0, or "
                                 '-1 for that of the source')

    @property
    def active(self) -> bool:
        """Whether anything is to be saved."""
        return bool(self.write_json or self.write_images or self.write_video or self.write_keypoint)


class FrameWriter:
    """Writes the files of each frame where it is called; `Recorder` does so in a thread of its own.

    What can not be written is logged and counted, and the other files are written. Each file but the video is whole
    whenever it is read; the video is complete after `close`.

    Args:
        draw: how people are drawn into images and video.
        scale: units of the keypoints in JSON and keypoint files.
        source_rate: of the frames [Hz], for the video; None: unknown.

    Attributes:
        written: number of files and video frames that were written.
        failed: number of those that could not be written.

    Raises:
        ParameterError: a folder can not be made or written to, or the name of the video does not tell its format.
    """

    def __init__(self, params: SaveParams, draw: Optional[DrawParams] = None,
                 scale: Optional[KeypointScaleParams] = None, source_rate: Optional[float] = None) -> None:
        self.written = 0
        self.failed = 0
        self._params = params
        self._draw = draw or DrawParams()
        self._scale = scale or KeypointScaleParams()
        self._joint_set = SKELETONS.get(params.write_joint_set)
        self._json = _folder('write_json', params.write_json)
        self._images = _folder('write_images', params.write_images)
        self._keypoint = _folder('write_keypoint', params.write_keypoint)
        self._video: Optional[VideoFile] = None
        if params.write_video:
            rate = params.write_video_fps if params.write_video_fps > 0 else source_rate or DEFAULT_RATE
            self._video = VideoFile(Path(params.write_video).expanduser(), rate)
            writable_folder('write_video', self._video.path.parent)

    @property
    def needs_image(self) -> bool:
        """Whether `write` needs the image, and not the people alone."""
        return self._images is not None or self._video is not None or self._scale.keypoint_scale != 0

    def reconfigure(self, draw: DrawParams) -> None:
        """Use other drawing parameters from the next frame on."""
        self._draw = draw

    def files(self, frame: Union[str, int]) -> List[Path]:
        """Return the files that `write` writes for a frame, without the video."""
        name = _name(frame)
        named = ((self._json, JSON_SUFFIX), (self._images, f'_rendered.{self._params.write_images_format}'),
                 (self._keypoint, keypoint_suffix(self._params.write_keypoint_format)))
        return [folder / (name + suffix) for folder, suffix in named if folder is not None]

    def write(self, frame: Union[str, int], bgr: Optional[np.ndarray], people: People2D) -> None:
        """Write all files of a frame.

        Args:
            frame: name of the files, as `frame_name` makes it for a video or camera; or a number.
            bgr: (H, W, 3) uint8 BGR, not modified; None where `needs_image` is False.
            people: in pixels of the image.

        Raises:
            ValueError: the name is a path, or the image is needed but None.
        """
        name = _name(frame)
        if bgr is None and self.needs_image:
            raise ValueError(f'frame {name}: what is to be saved needs the image, got None')
        saved = self._as_saved(bgr, people)
        if self._json is not None:
            self._attempt(partial(write_json, self._json / (name + JSON_SUFFIX), saved))
        if self._keypoint is not None:
            suffix = keypoint_suffix(self._params.write_keypoint_format)
            self._attempt(partial(write_keypoint, self._keypoint / (name + suffix), saved))
        if bgr is None or (self._images is None and self._video is None):
            return
        drawn = draw_people(bgr, people, self._draw)
        if self._images is not None:
            path = self._images / f'{name}_rendered.{self._params.write_images_format}'
            self._attempt(lambda: write_whole(path, cv2.imencode(path.suffix, drawn)[1].tobytes()))
        if self._video is not None:
            self._attempt(partial(self._video.write, drawn))

    def close(self) -> None:
        """Complete the video."""
        if self._video is not None:
            self._attempt(self._video.close, counts=False)

    def _as_saved(self, bgr: Optional[np.ndarray], people: People2D) -> People2D:
        """Return the people in the units and joint set of the files."""
        if self._scale.keypoint_scale != 0 and bgr is not None:
            size = (bgr.shape[1], bgr.shape[0])
            people = replace(people, keypoints=scale_keypoints(people.keypoints, size, self._scale))
        return people if self._joint_set is None else in_joint_set(people, self._joint_set)

    def _attempt(self, write: Callable[[], None], counts: bool = True) -> None:
        try:
            write()
            self.written += counts
        except (OSError, cv2.error) as error:
            self.failed += 1
            if is_power_of_two(self.failed):
                _log.error('file not written (number %d): %s', self.failed, error)


def is_power_of_two(count: int) -> bool:
    """Return whether the n-th of many equal faults is logged: 1, 2, 4, 8 ..."""
    return count & (count - 1) == 0


def _folder(key: str, folder: str) -> Optional[Path]:
    return writable_folder(key, Path(folder).expanduser()) if folder else None


def _name(frame: Union[str, int]) -> str:
    name = frame_name('', frame) if isinstance(frame, int) else frame
    if not name or Path(name).name != name:
        raise ValueError(f"name of a frame: expected a file name without folders, got '{name}'")
    return name
