"""Images from a webcam, a video file or a folder, one after the other."""
from pathlib import Path
from typing import Iterator, Optional

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.stream.image_decoding import MOST_MEGAPIXELS, check_pixels, decode_image, read_file

IMAGE_SUFFIXES = ('.jpg', '.jpeg', '.png', '.bmp', '.tif', '.tiff', '.webp')


def read_image(path: Path, flags: int = cv2.IMREAD_COLOR, most: float = MOST_MEGAPIXELS) -> np.ndarray:
    """Read an image file, by default as (H, W, 3) uint8 BGR; see `decode_image`.

    Raises:
        BadInputError: it can not be read or decoded.
    """
    return decode_image(read_file(path), str(path), flags, most)


class VideoSource:
    """A webcam (device number), a video file or a folder of images in the order of their names.

    Attributes:
        live: True for a webcam: it paces itself, and ends only when unplugged.
        rate: frames per second that the source names itself, or None.

    Raises:
        BadInputError: there is no such source, OpenCV can not open it, or its images are too large.
    """

    def __init__(self, source: str, width: int = 0, height: int = 0, most: float = MOST_MEGAPIXELS) -> None:
        """Open the source.

        Args:
            source: device number such as '0', path of a video file, or path of a folder.
            width, height: size to ask a webcam for [px]; 0: its default.
            most: `max_image_megapixels`.
        """
        self.live = source.isdigit()
        self.rate: Optional[float] = None
        self._source, self._most = source, most
        self._files = []
        if not self.live and Path(source).is_dir():
            self._files = sorted(p for p in Path(source).iterdir() if p.suffix.lower() in IMAGE_SUFFIXES)
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
        self._capture = capture

    def frames(self, loop: bool = False) -> Iterator[np.ndarray]:
        """Yield (H, W, 3) uint8 BGR images; from the beginning again at the end if `loop`.

        Raises:
            BadInputError: an image of a folder can not be read, or a file has not a single frame.
        """
        while True:
            yield from self._frames_of_files() if self._files else self._frames_of_capture()
            if not loop or self.live:
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

    def _frames_of_files(self) -> Iterator[np.ndarray]:
        return (read_image(path, most=self._most) for path in self._files)

    def _frames_of_capture(self) -> Iterator[np.ndarray]:
        count = 0
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
        if count == 0:
            raise BadInputError(f'not a single frame came from {self._source}')
