"""Save the files of frames under OpenPose's names, in a thread of its own: detection does not wait for the disk."""
import errno
import logging
import os
import re
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Deque, Dict, Optional, Tuple, Union

import cv2
import numpy as np

from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.output.files import numbered_name, writable_folder, write_image, write_whole
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams, scale_keypoints
from openpose_ros_pkg.output.openpose_json import JSON_SUFFIX, landmark_fields, people_to_json
from openpose_ros_pkg.output.video_file import VideoFile
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import SKELETONS
from openpose_ros_pkg.stream.worker import Worker
from openpose_ros_pkg.throttle import Throttle

_log = logging.getLogger(__name__)

# Existing files are replaced; stay; stay and count as a fault.
REPLACE, SKIP, REFUSE = 'replace', 'skip', 'refuse'
# Frame rate of a video whose source has none, as a folder of images [Hz].
DEFAULT_RATE = 10.0
# Frames that may wait to be written; each holds its image in memory.
_QUEUE_SIZE = 8

_Frame = Tuple[Union[str, int], np.ndarray, People2D, Optional[Landmarks2D]]


@dataclass(frozen=True)
class SaveParams(Parameters):
    """What is saved of every frame. The names are OpenPose's."""

    retired = ('write_keypoint', 'write_keypoint_format', 'write_images_format', 'write_video_fps')

    write_json: str = parameter(
        '', "Folder for the keypoints in OpenPose's JSON layout, one file per frame; empty: none.")
    write_images: str = parameter('', 'Folder for the annotated images (PNG), one file per frame; empty: none.')
    write_video: str = parameter(
        '', 'File for the annotated video, .mp4 or .avi, at the rate of the source, or 10 Hz where that has none '
            '(images, ROS topics); empty: none.')
    write_joint_set: str = parameter(
        '', 'Joints and their order in JSON files; empty: those of the network.',
        choices=('', *SKELETONS))

    @property
    def active(self) -> bool:
        """Whether anything is to be saved."""
        return bool(self.write_json or self.write_images or self.write_video)


class Recorder:
    """Writes the files of each frame in a thread of its own, through a queue of bounded length; thread-safe.

    A file that can not be written is reported and counted, and the others are written. Every file but the video is
    whole whenever it is read; the video is complete after `close`.

    Args:
        draw: how people are drawn into images and video.
        scale: units of the keypoints in JSON files.
        source_rate: of the frames [Hz], for the video; None: unknown.
        existing: what happens to existing files: REPLACE, SKIP or, of live images, REFUSE. A video beside one that
            stays gets a number: NAME_2.mp4. While the queue is full, `submit` waits, or drops live images.

    Attributes:
        on_fault: called in any thread with why a frame, or a part of it, is not saved; at first it is logged.

    Raises:
        ParameterError: a folder can not be made or written to, or the video's suffix is not supported.
    """

    def __init__(self, params: SaveParams, draw: Optional[DrawParams] = None,
                 scale: Optional[KeypointScaleParams] = None, source_rate: Optional[float] = None,
                 existing: str = REPLACE) -> None:
        self._draw, self._existing = draw or DrawParams(), existing
        self._scale = scale or KeypointScaleParams()
        self._joint_set = SKELETONS.get(params.write_joint_set)
        folders = {'write_json': (params.write_json, JSON_SUFFIX),
                   'write_images': (params.write_images, '_rendered.png')}
        self._folders = {key: (writable_folder(key, Path(folder).expanduser()), suffix)
                         for key, (folder, suffix) in folders.items() if folder}
        self._video: Optional[VideoFile] = None
        if params.write_video:
            path = Path(params.write_video).expanduser()
            self._video = VideoFile(path, source_rate or DEFAULT_RATE, keep=existing != REPLACE)
            writable_folder('write_video', path.parent)
        self._throttle = Throttle()
        self.on_fault: Callable[[str], None] = self._log_fault
        self._wait_when_full = existing != REFUSE
        self._queue: Deque[_Frame] = deque()
        self._written = self._failed = self._dropped = 0
        self._failing: Dict[str, str] = {}  # latest error, by output, until it is written again
        self._worker = Worker('recorder', self._write_next, self._count_broken)
        self._changed = self._worker.condition
        self._worker.start()

    def __enter__(self) -> 'Recorder':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def counters(self) -> Dict[str, int]:
        """Numbers of files and video frames that were written and that failed, of frames dropped and waiting."""
        with self._changed:
            video = (0, 0) if self._video is None else (self._video.frames, self._video.lost)
            return {'written': self._written + video[0], 'failed': self._failed + video[1],
                    'dropped': self._dropped, 'waiting': len(self._queue)}

    def fault(self) -> str:
        """Return what was not saved of the newest frame, and why; empty: nothing."""
        return '; '.join(list(self._failing.values()))

    def next_number(self) -> int:
        """Return the number after the greatest one of existing files of frames; 0: there are none."""
        found = [re.match(r'\d{12}', path.name) for folder, suffix in self._folders.values()
                 for path in folder.iterdir() if path.name.endswith(suffix)]
        return max((int(match[0]) + 1 for match in found if match), default=0)

    def reconfigure(self, draw: DrawParams) -> None:
        """Use other drawing parameters from the next frame on."""
        self._draw = draw

    def files(self, frame: Union[str, int]) -> Dict[str, Path]:
        """Return the files of a frame, without the video, by parameter; see `submit`."""
        name = numbered_name('', frame) if isinstance(frame, int) else frame
        return {key: folder / (name + suffix) for key, (folder, suffix) in self._folders.items()}

    def submit(self, frame: Union[str, int], bgr: np.ndarray, people: People2D,
               landmarks: Optional[Landmarks2D] = None) -> bool:
        """Queue a frame to be saved.

        Args:
            frame: name of the files, as `numbered_name` makes it; or a number.
            bgr: (H, W, 3) uint8 BGR; not to be modified any more.
            people: in pixels of the image.
            landmarks: their hands and faces, for JSON files, images and video; None: none.

        Returns:
            False if the frame was dropped: the queue is full, or the recorder is closed.
        """
        with self._changed:
            if self._wait_when_full:
                self._changed.wait_for(lambda: self._worker.stopped or len(self._queue) < _QUEUE_SIZE)
            closed = self._worker.stopped
            if not closed and len(self._queue) < _QUEUE_SIZE:
                self._queue.append((frame, bgr, people, landmarks))
                self._changed.notify_all()
                return True
            self._dropped += 1
        if not closed:
            self.on_fault(f'saving is slower than the frames: {_QUEUE_SIZE} are waiting')
        return False

    def close(self) -> None:
        """Write all frames that wait, end the thread, complete and verify the video."""
        self._worker.stop()
        error = '' if self._video is None else _error_of(self._video.close)
        if error:
            _log.error('%s', error)

    def _write_next(self) -> bool:
        with self._changed:
            self._changed.wait_for(lambda: self._worker.stopped or self._queue)
            if not self._queue:
                return False
            item = self._queue.popleft()
            self._changed.notify_all()
        self._write(*item)
        return True

    def _write(self, frame: Union[str, int], bgr: np.ndarray, people: People2D, landmarks: Optional[Landmarks2D]
               ) -> None:
        files, size = self.files(frame), (bgr.shape[1], bgr.shape[0])
        if 'write_json' in files:
            self._attempt('write_json', files, lambda path: write_whole(
                path, self._json_of(size, people, landmarks).encode()))
        if 'write_images' in files or self._video is not None:
            drawn = draw_people(bgr, people, self._draw, landmarks=landmarks)
            self._attempt('write_images', files, lambda path: write_image(path, drawn))
            if self._video is not None:
                self._note('write_video', _error_of(self._video.write, drawn))

    def _json_of(self, size: Tuple[int, int], people: People2D, landmarks: Optional[Landmarks2D]) -> str:
        """Return the people of an image of this size in the units and the joint set of the files."""
        def scaled(keypoints: np.ndarray) -> np.ndarray:
            return scale_keypoints(keypoints, size, self._scale)

        joint_set = self._joint_set or people.skeleton
        saved = replace(people, skeleton=joint_set,
                        keypoints=keypoints_in(scaled(people.keypoints), people.skeleton, joint_set))
        return people_to_json(saved, more=None if landmarks is None else landmark_fields(Landmarks2D(
            replace(landmarks.hands, keypoints=scaled(landmarks.hands.keypoints)),
            replace(landmarks.faces, keypoints=scaled(landmarks.faces.keypoints)))))

    def _attempt(self, key: str, files: Dict[str, Path], write: Callable[[Path], None]) -> None:
        """Write one file of a frame, if it is wanted and not there."""
        if key not in files:
            return
        there = self._existing != REPLACE and os.path.lexists(str(files[key]))
        if there and self._existing == SKIP:
            return
        error = _error_of(_refuse if there else write, files[key])
        self._written += not error
        self._note(key, error)

    def _note(self, key: str, error: str) -> None:
        """Note whether an output of a frame was written."""
        if not error:
            self._failing.pop(key, None)
            return
        self._failed += 1
        self._failing[key] = error
        self.on_fault(error)

    def _count_broken(self, error: Exception) -> None:
        """Count a frame whose writing raised another error than those of files, and report it."""
        self._failed += 1
        self.on_fault(repr(error))

    def _log_fault(self, fault: str) -> None:
        if self._throttle.is_due(''):
            counters = self.counters
            _log.error('not saved: %s (%d files and frames so far)', fault, counters['failed'] + counters['dropped'])


def _refuse(path: Path) -> None:
    raise FileExistsError(errno.EEXIST, 'is there already', str(path))


def _error_of(write: Callable[..., None], *values: Any) -> str:
    """Return the file and the reason of an error in writing; empty: none."""
    try:
        write(*values)
    except OSError as error:
        return f'{error.filename}: {error.strerror}' if error.filename else str(error)
    except cv2.error as error:
        return str(error)
    return ''
