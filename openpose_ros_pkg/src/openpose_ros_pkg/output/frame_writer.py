"""Write the files of a frame under OpenPose's names."""
import errno
import os
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Dict, Optional, Tuple, Union

import cv2
import numpy as np

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.output.files import numbered_name, writable_folder, write_image
from openpose_ros_pkg.output.joint_order import in_joint_set
from openpose_ros_pkg.output.keypoint_file import FORMATS, write_keypoint
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams, scale_keypoints
from openpose_ros_pkg.output.openpose_json import JSON_SUFFIX, landmark_fields, write_json
from openpose_ros_pkg.output.video_file import VideoFile
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SKELETONS

# Existing files are replaced; stay; stay and count as a fault.
REPLACE, SKIP, REFUSE = 'replace', 'skip', 'refuse'
# Frame rate of a video whose source has none, as a folder of images [Hz].
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
    """Writes the files of each frame; `Recorder` does so in a thread of its own.

    A file that can not be written is reported and counted, and the others are written. Every file but the video is
    whole whenever it is read; the video is complete after `close`.

    Args:
        draw: how people are drawn into images and video.
        scale: units of the keypoints in JSON and keypoint files.
        source_rate: of the frames [Hz], for the video; None: unknown.
        existing: REPLACE, SKIP or REFUSE. A video beside one that stays gets a number: NAME_2.mp4.

    Raises:
        ParameterError: a folder can not be made or written to, or the video's suffix is not supported.
    """

    def __init__(self, params: SaveParams, draw: Optional[DrawParams] = None,
                 scale: Optional[KeypointScaleParams] = None, source_rate: Optional[float] = None,
                 existing: str = REPLACE) -> None:
        self._written = self._failed = 0
        self._failing: Dict[str, Tuple[int, str]] = {}  # frames in a row, and the latest error, by output
        self._draw, self._existing = draw or DrawParams(), existing
        self._scale = scale or KeypointScaleParams()
        self._joint_set = SKELETONS.get(params.write_joint_set)
        folders = {'write_json': params.write_json, 'write_images': params.write_images,
                   'write_keypoint': params.write_keypoint}
        self._folders = {key: writable_folder(key, Path(folder).expanduser())
                         for key, folder in folders.items() if folder}
        self._suffixes = {'write_json': JSON_SUFFIX, 'write_images': f'_rendered.{params.write_images_format}',
                          'write_keypoint': f'_pose.{params.write_keypoint_format}'}
        self._video: Optional[VideoFile] = None
        if params.write_video:
            rate = params.write_video_fps if params.write_video_fps > 0 else source_rate or DEFAULT_RATE
            path = Path(params.write_video).expanduser()
            self._video = VideoFile(path, rate, keep=existing != REPLACE)
            writable_folder('write_video', path.parent)

    @property
    def written(self) -> int:
        """Number of files written, and of frames in the video."""
        return self._written + (0 if self._video is None else self._video.frames)

    @property
    def failed(self) -> int:
        """Number of files and video frames that were not written, or lost with the video."""
        return self._failed + (0 if self._video is None else self._video.lost)

    def fault(self, least: int = 1) -> str:
        """Return what has not been saved for at least this number of frames in a row, and why; empty: nothing."""
        return '; '.join(f'{error} ({count} frames in a row)' for count, error in list(self._failing.values())
                         if count >= least)

    def next_number(self) -> int:
        """Return the number after the greatest one of existing files of frames; 0: there are none."""
        found = [re.match(r'\d{12}', path.name) for key, folder in self._folders.items() for path in folder.iterdir()
                 if path.name.endswith(self._suffixes[key])]
        return max((int(match[0]) + 1 for match in found if match), default=0)

    def reconfigure(self, draw: DrawParams) -> None:
        """Use other drawing parameters from the next frame on."""
        self._draw = draw

    def files(self, frame: Union[str, int]) -> Dict[str, Path]:
        """Return the files of a frame, without the video, by parameter.

        Args:
            frame: name of the files, as `numbered_name` makes it; or a number.

        Raises:
            ValueError: the name is a path.
        """
        name = numbered_name('', frame) if isinstance(frame, int) else frame
        if not name or Path(name).name != name:
            raise ValueError(f"name of a frame: expected a file name without folders, got '{name}'")
        return {key: folder / (name + self._suffixes[key]) for key, folder in self._folders.items()}

    def write(self, frame: Union[str, int], bgr: np.ndarray, people: People2D,
              landmarks: Optional[Landmarks2D] = None) -> str:
        """Write all files of a frame; see `files`.

        Args:
            bgr: (H, W, 3) uint8 BGR, not modified.
            people: in pixels of the image.
            landmarks: their hands and faces, for JSON files, images and video; None: none.

        Returns:
            What could not be written, and why; empty: everything was.
        """
        files = self.files(frame)
        saved = self._as_saved(bgr, people)
        errors = []
        if 'write_json' in files:
            fields = None if landmarks is None else landmark_fields(self._scaled(bgr, landmarks))
            errors.append(self._attempt('write_json', write_json, files['write_json'], saved, fields))
        if 'write_keypoint' in files:
            errors.append(self._attempt('write_keypoint', write_keypoint, files['write_keypoint'], saved))
        if 'write_images' in files or self._video is not None:
            drawn = draw_people(bgr, people, self._draw, landmarks=landmarks)
            if 'write_images' in files:
                errors.append(self._attempt('write_images', write_image, files['write_images'], drawn))
            if self._video is not None:
                errors.append(self._attempt('write_video', self._video.write, drawn))
        return '; '.join(filter(None, errors))

    def close(self) -> str:
        """Complete and verify the video; return its fault, or ''."""
        return '' if self._video is None else _told(self._video.close)

    def _as_saved(self, bgr: np.ndarray, people: People2D) -> People2D:
        """Return the people in the units and joint set of the files."""
        if self._scale.keypoint_scale != 0:
            size = (bgr.shape[1], bgr.shape[0])
            people = replace(people, keypoints=scale_keypoints(people.keypoints, size, self._scale))
        return people if self._joint_set is None else in_joint_set(people, self._joint_set)

    def _scaled(self, bgr: np.ndarray, landmarks: Landmarks2D) -> Landmarks2D:
        """Return hands and faces in the units of the files."""
        size = (bgr.shape[1], bgr.shape[0])
        hands, faces = landmarks.hands, landmarks.faces
        return Landmarks2D(replace(hands, keypoints=scale_keypoints(hands.keypoints, size, self._scale)),
                           replace(faces, keypoints=scale_keypoints(faces.keypoints, size, self._scale)))

    def _attempt(self, key: str, write: Callable[..., None], *values: Any) -> str:
        """Write one output; return why it failed; empty: it is written or skipped."""
        if key != 'write_video' and self._existing != REPLACE and os.path.lexists(str(values[0])):
            if self._existing == SKIP:
                return ''
            write = _refuse
        if error := _told(write, *values):
            self._failed += 1
            self._failing[key] = (self._failing.get(key, (0, ''))[0] + 1, error)
            return error
        self._failing.pop(key, None)
        self._written += key != 'write_video'
        return ''


def _refuse(path: Path, *_: Any) -> None:
    raise FileExistsError(errno.EEXIST, 'is there already', str(path))


def _told(write: Callable[..., None], *values: Any) -> str:
    """Return the file and the reason of an error in writing; empty: none."""
    try:
        write(*values)
    except OSError as error:
        return f'{error.filename}: {error.strerror}' if error.filename else str(error)
    except cv2.error as error:
        return str(error)
    return ''
