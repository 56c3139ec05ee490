"""Image files of any bytes: an image of a size that is allowed, or BadInputError before memory is taken."""
import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fuzzing import mutated, survives
from openpose_ros_pkg.stream import image_decoding
from openpose_ros_tools.images import image_files

BGR = np.random.default_rng(0).integers(0, 256, (24, 32, 3), dtype=np.uint8)
DEPTH = np.arange(24 * 32, dtype=np.uint16).reshape(24, 32)
# Of an image of 40 megapixels with three channels of 16 bits, decoded and converted.
MEMORY = 40_000_000 * 3 * 2 * 3


def encoded(suffix, image, *options):
    return cv2.imencode(suffix, image, list(options))[1].tobytes()


COLOUR_FILES = [encoded(suffix, BGR) for suffix in ('.jpg', '.png', '.bmp', '.tiff', '.webp', '.ppm')]
COLOUR_FILES.append(encoded('.jpg', BGR, cv2.IMWRITE_JPEG_PROGRESSIVE, 1))
DEPTH_FILES = [encoded('.png', DEPTH), encoded('.tiff', DEPTH.astype(np.float32)), encoded('.pgm', DEPTH)]


@given(st.one_of(mutated(*COLOUR_FILES), *(mutated(content) for content in COLOUR_FILES)))
def test_image(content):
    image = survives(image_decoding.decode_image, content, 'an image', size=len(content), memory=MEMORY)
    assert image is None or (image.dtype == np.uint8 and image.ndim == 3 and image.shape[0] * image.shape[1] <= 40e6)


@given(mutated(*COLOUR_FILES, *DEPTH_FILES))
def test_depth_images(content):
    depth = survives(image_files.decode_depth, content, 'depth', size=len(content), memory=MEMORY)
    assert depth is None or (depth.ndim == 2 and depth.dtype in (np.uint16, np.float32))
