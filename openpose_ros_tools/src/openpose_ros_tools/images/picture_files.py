"""Picture files, pixel for pixel: read as they are stored, written without loss."""
from typing import Optional, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError

COLOUR_SUFFIXES = ('.jpg', '.jpeg', '.png', '.bmp', '.tif', '.tiff', '.webp', '.ppm', '.pgm')
DEPTH_SUFFIXES = ('.png', '.tif', '.tiff', '.pgm')
# Depth images with integers count so many units per metre: mm, as REP 118 has them.
MILLIMETRES = 1000.0
# How these files begin.
_MAGIC = {b'\xff\xd8\xff': 'jpeg', b'\x89PNG\r\n\x1a\n': 'png'}
# Encoding of sensor_msgs/Image by type and number of channels.
_ENCODINGS = {('uint8', 1): 'mono8', ('uint8', 3): 'bgr8', ('uint8', 4): 'bgra8', ('uint16', 1): 'mono16',
              ('uint16', 3): 'bgr16', ('uint16', 4): 'bgra16'}
# The greatest depth that 16 bits hold [units], and float32 rounding of it.
_MOST_UNITS = 65535


def picture_kind(content: bytes) -> Optional[str]:
    """Return 'jpeg' or 'png', or None for another file, by how the file begins."""
    return next((kind for magic, kind in _MAGIC.items() if content.startswith(magic)), None)


def decode_picture(content: bytes, source: str) -> np.ndarray:
    """Return the picture of a file's content with the channels and the type that it is stored with.

    Returns:
        (H, W) or (H, W, 3 or 4) uint8 or uint16, BGR(A); a JPEG is turned as its EXIF orientation says.

    Raises:
        BadInputError: it can not be decoded, or is of another type.
    """
    # OpenCV's reader of unchanged pictures does not turn them; only a JPEG of a camera needs that
    flags = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH if picture_kind(content) == 'jpeg' else cv2.IMREAD_UNCHANGED
    picture = cv2.imdecode(np.frombuffer(content, np.uint8), flags) if content else None
    if picture is None:
        raise BadInputError(f'{source} can not be decoded as an image')
    encoding_of(picture, source)
    return picture


def decode_depth(content: bytes, source: str) -> np.ndarray:
    """Return the depth image of a file's content, (H, W) uint16 or float32, as it is stored.

    Raises:
        BadInputError: it can not be decoded, or is of another type.
    """
    depth = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) if content else None
    if depth is None:
        raise BadInputError(f'{source} can not be decoded as an image')
    if depth.ndim != 2 or depth.dtype not in (np.uint16, np.float32):
        raise BadInputError(f'{source}: expected one channel of uint16 or float32, got {depth.dtype} of shape '
                            f'{depth.shape}')
    return depth


def encoding_of(picture: np.ndarray, source: str) -> str:
    """Return the encoding of a sensor_msgs/Image that holds a picture.

    Raises:
        BadInputError: there is none.
    """
    channels = 1 if picture.ndim == 2 else picture.shape[2]
    encoding = _ENCODINGS.get((str(picture.dtype), channels))
    if encoding is None:
        raise BadInputError(f'{source}: expected 1, 3 or 4 channels of uint8 or uint16, got {picture.dtype} of shape '
                            f'{picture.shape}')
    return encoding


def to_bgr8(picture: np.ndarray) -> np.ndarray:
    """Return (H, W, 3) uint8 BGR, as colours of a cloud."""
    if picture.dtype == np.uint16:
        picture = (picture >> 8).astype(np.uint8)
    if picture.ndim == 2:
        return cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)
    return picture[..., :3]


def encode_png(picture: np.ndarray, source: str) -> bytes:
    """Return a PNG file of a picture, lossless.

    Raises:
        BadInputError: OpenCV can not write it.
    """
    return _encode('.png', picture, source)


def encode_tiff(depth: np.ndarray, source: str) -> bytes:
    """Return a TIFF file of a (H, W) float32 depth image, lossless to the last bit.

    Raises:
        BadInputError: OpenCV can not write it.
    """
    return _encode('.tiff', depth, source)


def encode_jpeg(picture: np.ndarray, quality: int, source: str) -> bytes:
    """Return a JPEG file of a picture.

    Raises:
        BadInputError: OpenCV can not write it.
    """
    return _encode('.jpg', picture, source, (cv2.IMWRITE_JPEG_QUALITY, quality))


def depth_to_metres(depth: np.ndarray, units_per_metre: float) -> np.ndarray:
    """Return integer depth as (H, W) float32 [m], NaN where it is 0."""
    metres = (depth.astype(np.float64) / units_per_metre).astype(np.float32)
    metres[depth == 0] = np.nan
    return metres


def depth_to_units(depth: np.ndarray, units_per_metre: float, source: str) -> Tuple[np.ndarray, float]:
    """Return depth as integers.

    Args:
        depth: (H, W) float [m]; 0, negative or not finite where missing.

    Returns:
        (H, W) uint16, 0 = missing, and the greatest difference that rounding made to the given depth [m].

    Raises:
        BadInputError: something is too far away for 16 bits.
    """
    there = np.isfinite(depth) & (depth > 0)
    units = np.where(there, depth, 0).astype(np.float64) * units_per_metre
    rounded = np.rint(units)
    if rounded.max(initial=0) > _MOST_UNITS:
        raise BadInputError(f'{source}: depth of {units.max() / units_per_metre:.3f} m does not fit 16 bits with '
                            f'{units_per_metre:g} units per metre, which reach {_MOST_UNITS / units_per_metre:.3f} m')
    # what float32 can not tell apart is no loss
    lost = np.abs(depth_to_metres(rounded, units_per_metre) - depth)[there]
    return rounded.astype(np.uint16), float(lost.max(initial=0))


def _encode(suffix: str, picture: np.ndarray, source: str, parameters: Tuple[int, ...] = ()) -> bytes:
    try:
        done, content = cv2.imencode(suffix, picture, list(parameters))
    except cv2.error as error:
        raise BadInputError(f'{source}: OpenCV can not write {suffix} of {picture.dtype} {picture.shape}: '
                            f'{error}') from error
    if not done:
        raise BadInputError(f'{source}: OpenCV can not write {suffix} of {picture.dtype} {picture.shape}')
    return content.tobytes()
