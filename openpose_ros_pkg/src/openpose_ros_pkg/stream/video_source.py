"""Images from a webcam, a video file or a folder."""
import logging
from pathlib import Path
from typing import Callable, Iterator, Optional

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.stream.image_decoding import MOST_MEGAPIXELS, check_pixels, decode_image, read_file

_log = logging.getLogger(__name__)

IMAGE_SUFFIXES = ('.jpg', '.jpeg', '.png', '.bmp', '.tif', '.tiff', '.webp')
# Videos that state their number of frames; of others OpenCV only knows an estimate.
_COUNTED = ('.avi', '.mp4', '.m4v', '.mov')


def read_image(path: Path, flags: int = cv2.IMREAD_COLOR, most: float = MOST_MEGAPIXELS) -> np.ndarray:
    """Read an image file, by default as (H, W, 3) uint8 BGR, see `decode_image`; BadInputError: it can not be read."""
    return decode_image(read_file(path), str(path), flags, most)


class VideoSource:
    """A webcam (device number), a video file or a folder of images in the order of their names.

    Args:
        source: device number such as '0', path of a video file, or path of a folder.
        width, height: size to ask a webcam for [px]; 0: its default.
        most: `max_image_megapixels`.

    Attributes:
        live: True for a webcam: it paces itself, and ends only when unplugged.
        rate: frames per second that the source names itself, or None.
        count: number of images that it names; 0: not known.

    Raises:
        BadInputError: there is no such source, OpenCV can not open it, or its images are too large.
    """

    def __init__(self, source: str, width: int = 0, height: int = 0, most: float = MOST_MEGAPIXELS) -> None:
        self.live = source.isdigit()
        self.rate: Optional[float] = None
        self.count = 0
        self._source, self._most = source, most
        self._files = []
        if not self.live and Path(source).is_dir():
            self._files = sorted(p for p in Path(source).iterdir()
                                 if p.suffix.lower() in IMAGE_SUFFIXES and p.is_file())
            if not self._files:
                raise BadInputError(f'no images in {source}; expected files ending in {", ".join(IMAGE_SUFFIXES)}')
            return
        if not self.live and not Path(source).is_file():
            raise BadInputError(f'{source} is neither a device number nor an existing file or folder')
        capture = self._open()
        if self.live and width and height:
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, width)
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, height)
        self.rate = capture.get(cv2.CAP_PROP_FPS) or None
        self.count = max(int(capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
        self._capture = capture

    def frames(self, loop: bool = False, skip: Optional[Callable[[BadInputError], object]] = None
               ) -> Iterator[np.ndarray]:
        """Yield (H, W, 3) uint8 BGR images; with `loop`, again from the beginning.

        Args:
            skip: called with the error of each image of a folder that can not be read; None: it is raised.

        Raises:
            BadInputError: an image can not be read, the source has none, or a webcam gives no more.
        """
        while True:
            count = 0
            for image in self._frames_of_files(skip) if self._files else self._frames_of_capture():
                count += 1
                yield image
            if self.live:
                raise BadInputError(f'camera {self._source} gives no more images')
            if count == 0:
                raise BadInputError(f'not a single frame came from {self._source}')
            if not loop:
                return
            if not self._files:
                self._capture = self._open()

    def _open(self) -> cv2.VideoCapture:
        capture = cv2.VideoCapture(int(self._source) if self.live else self._source)
        if not capture.isOpened():
            kind = f'camera {self._source} (is /dev/video{self._source} there and readable?)' if self.live \
                else f'video file {self._source}'
            raise BadInputError(f'OpenCV can not open {kind}')
        check_pixels(self._source, int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)),
                     int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)), self._most)
        return capture

    def _frames_of_files(self, skip: Optional[Callable[[BadInputError], object]]) -> Iterator[np.ndarray]:
        for path in self._files:
            try:
                image = read_image(path, most=self._most)
            except BadInputError as error:
                if skip is None:
                    raise
                skip(error)
            else:
                yield image

    def _frames_of_capture(self) -> Iterator[np.ndarray]:
        count, stated = 0, int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
        while True:
            try:
                there, image = self._capture.read()
            except cv2.error as error:
                raise BadInputError(f'{self._source} has a frame that can not be decoded: {error}') from error
            if not there:
                break
            count += 1
            yield image
        self._capture.release()
        if count < stated and Path(self._source).suffix.lower() in _COUNTED:
            _log.warning('%s ended after %d of %d frames: it is cut off, or parts of it can not be read', self._source,
                         count, stated)
