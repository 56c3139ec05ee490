"""Files of depth and other images, written without loss; units of depth."""
import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.stream import image_decoding

# Units per metre of 16-bit depth images, as REP 118 defines them.
MILLIMETRES = 1000.0
# The greatest depth in 16 bits [units].
_MOST_UNITS = 65535


def decode_depth(content: bytes, source: str) -> np.ndarray:
    """Return a depth image file as it is stored, (H, W) uint16 or float32; errors as `image_decoding.decode_image`."""
    depth = image_decoding.decode_image(content, source, cv2.IMREAD_UNCHANGED)
    if depth.ndim != 2 or depth.dtype not in (np.uint16, np.float32):
        raise BadInputError(f'{source}: expected one channel of uint16 or float32, got {depth.dtype} of shape '
                            f'{depth.shape}')
    return depth


def encode_image(image: np.ndarray, suffix: str, source: str) -> bytes:
    """Return the content of an image file without loss, '.png', or '.tiff' of float32; BadInputError: none can be."""
    try:
        return cv2.imencode(suffix, image)[1].tobytes()
    except cv2.error as error:
        raise BadInputError(f'{source}: OpenCV can not write {suffix} of {image.dtype} {image.shape}: '
                            f'{error}') from error


def depth_to_metres(depth: np.ndarray, units_per_metre: float) -> np.ndarray:
    """Return integer depth as (H, W) float32 [m], NaN where it is 0."""
    metres = (depth.astype(np.float64) / units_per_metre).astype(np.float32)
    metres[depth == 0] = np.nan
    return metres


def depth_to_units(depth: np.ndarray, units_per_metre: float, source: str) -> np.ndarray:
    """Return depth (H, W) float [m] as rounded uint16; what is 0, negative or not finite is missing, 0.

    Raises:
        BadInputError: a depth is too great for 16 bits.
    """
    known = np.isfinite(depth) & (depth > 0)
    units = np.rint(np.where(known, depth, 0).astype(np.float64) * units_per_metre)
    if units.max(initial=0) > _MOST_UNITS:
        raise BadInputError(f'{source}: depth of {units.max() / units_per_metre:.3f} m does not fit 16 bits with '
                            f'{units_per_metre:g} units per metre, which reach {_MOST_UNITS / units_per_metre:.3f} m')
    return units.astype(np.uint16)
