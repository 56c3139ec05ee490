"""Compressed images, checked before they are decoded: a file of 100 kB can ask for gigabytes.

The sizes of JPEG and PNG come from their headers (ITU T.81, B.2; PNG specification, 11.2.2). OpenCV checks those of
other formats against `HARDEST_LIMIT`.
"""
import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Optional, Tuple

import cv2
import numpy as np

from openpose_ros_pkg import HARDEST_LIMIT
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import Parameters, parameter

PNG = b'\x89PNG\r\n\x1a\n'
_MAGIC = {b'\xff\xd8\xff': 'jpeg', PNG: 'png'}
# No file of an image is larger: 4 channels of 16 bits, not compressed.
_MOST_BYTES = 8 * HARDEST_LIMIT
_MARKER = re.compile(rb'\xff([\x01-\xfe])')
_END, _SCAN = 0xd9, 0xda
# Markers that are followed by nothing: TEM, RST0..7, SOI, EOI.
_ALONE = (0x01, *range(0xd0, 0xda))
# SOF0..15 but for DHT, JPG and DAC.
_FRAMES = tuple(code for code in range(0xc0, 0xd0) if code not in (0xc4, 0xc8, 0xcc))
# Longest side that libjpeg writes, for the annotated image.
_MOST_SIDE = 65500
_PNG_END = b'IEND\xaeB`\x82'


@dataclass(frozen=True)
class ImageLimitParams(Parameters):
    """Images that are refused."""

    max_image_megapixels: float = parameter(
        40.0, 'Images, depth images and clouds with more pixels or points (width x height) are dropped before memory '
              'is taken for them; of compressed ones the header tells. An image takes up to 8 bytes per pixel.',
        minimum=0.01, maximum=HARDEST_LIMIT / 1e6)


MOST_MEGAPIXELS = ImageLimitParams().max_image_megapixels


def check_pixels(name: str, width: int, height: int, most: float = MOST_MEGAPIXELS) -> None:
    """Raise BadInputError for more megapixels than `most`, `max_image_megapixels`, or too long a side."""
    if width * height > most * 1e6:
        raise BadInputError(f'{name} is {width} x {height}, that is {width * height / 1e6:.3g} megapixels, expected '
                            f'at most {most:g} (max_image_megapixels)')
    if max(width, height) > _MOST_SIDE:
        raise BadInputError(f'{name} is {width} x {height}, expected at most {_MOST_SIDE} on a side')


def image_kind(content: bytes) -> Optional[str]:
    """Return 'jpeg' or 'png', or None for another file, by its first bytes."""
    return next((kind for magic, kind in _MAGIC.items() if content.startswith(magic)), None)


def decode_image(content: bytes, name: str, flags: int = cv2.IMREAD_COLOR, most: float = MOST_MEGAPIXELS
                 ) -> np.ndarray:
    """Return the image in the content of a file of any format that OpenCV reads.

    Args:
        name: of the image, for the error.
        flags: of `cv2.imdecode`.
        most: `max_image_megapixels`; other formats than JPEG and PNG are decoded before it is checked.

    Returns:
        (H, W, 3) uint8 BGR, or as the flags say.

    Raises:
        BadInputError: too large, cut off, damaged, or no image.
    """
    kind = image_kind(content)
    if kind is not None:
        check_pixels(name, *(_jpeg_size if kind == 'jpeg' else _png_size)(content, name), most)
    try:
        image = cv2.imdecode(np.frombuffer(content, np.uint8), flags) if content else None
    except cv2.error as error:
        raise BadInputError(f'{name} is not an image that OpenCV can read: {error}') from error
    if image is None:
        raise BadInputError(f'{name} is not an image that OpenCV can read: {len(content)} bytes')
    check_pixels(name, image.shape[1], image.shape[0], most)
    return image


def read_file(path: Path) -> bytes:
    """Return the content of an image file.

    Raises:
        BadInputError: it can not be read, or is larger than any image.
    """
    try:
        with path.open('rb') as file:
            content = file.read(_MOST_BYTES + 1)
    except OSError as error:
        raise BadInputError(f'{path} can not be read: {error.strerror or error}') from error
    if len(content) > _MOST_BYTES:
        raise BadInputError(f'{path} has more than {_MOST_BYTES} bytes, as no image has')
    return content


def _jpeg_size(content: bytes, name: str) -> Tuple[int, int]:
    """Return width and height of a JPEG; raise BadInputError if it is cut off or damaged.

    Bytes after its end are ignored: drivers leave those of a longer image there, or zeros.
    """
    size, position = None, 0
    while True:
        marker = _MARKER.search(content, position)
        if marker is None:
            raise _cut_off(name, content)
        code, position = marker.group(1)[0], marker.end()
        if code == _SCAN:
            break
        if code in _ALONE:
            continue
        if code in _FRAMES and size is None and len(content) >= position + 7:
            height, width = struct.unpack_from('>HH', content, position + 3)
            size = width, height
        position += int.from_bytes(content[position:position + 2], 'big')
    # within a scan, 0xff is followed by 0
    if content.find(bytes((0xff, _END)), position) < 0:
        raise _cut_off(name, content)
    if size is None:
        raise BadInputError(f'{name} ({len(content)} bytes) is a damaged JPEG: expected its size')
    return size


def _png_size(content: bytes, name: str) -> Tuple[int, int]:
    """Return width and height of a PNG; raise BadInputError if it is cut off."""
    if _PNG_END not in content or len(content) < 24:
        raise _cut_off(name, content)
    width, height = struct.unpack_from('>II', content, 16)
    return width, height


def _cut_off(name: str, content: bytes) -> BadInputError:
    return BadInputError(f'{name} is cut off: {len(content)} bytes without the mark of its end')
