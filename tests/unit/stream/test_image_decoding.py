"""Compressed images: what is refused before it is decoded, by size, by a missing end, by its kind."""
import os
import resource
import subprocess
import sys
import zlib

import cv2
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.stream.image_decoding import decode_image

IMAGE = np.random.default_rng(3).integers(0, 255, (60, 80, 3), np.uint8)


def encoded(suffix, image=IMAGE, *options):
    return cv2.imencode(suffix, image, options)[1].tobytes()


def png_of(width, height):
    """A whole PNG of grey pixels whose header says the size; its data do not fit."""
    def chunk(kind, data):
        return len(data).to_bytes(4, 'big') + kind + data + zlib.crc32(kind + data).to_bytes(4, 'big')
    header = width.to_bytes(4, 'big') + height.to_bytes(4, 'big') + bytes((8, 0, 0, 0, 0))
    data = zlib.compress(bytes(1000))
    return b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', header) + chunk(b'IDAT', data) + chunk(b'IEND', b'')


def jpeg_of(width, height):
    """A JPEG whose header says the size; its data do not fit."""
    content = bytearray(encoded('.jpg'))
    frame = content.index(b'\xff\xc0')
    content[frame + 5:frame + 9] = height.to_bytes(2, 'big') + width.to_bytes(2, 'big')
    return bytes(content)


@pytest.mark.parametrize('suffix, share', [('.jpg', 0.01), ('.jpg', 0.99), ('.png', 0.01), ('.png', 0.5)])
def test_a_cut_image_is_refused(suffix, share):
    content = encoded(suffix)
    with pytest.raises(BadInputError, match=rf'it is cut off: {int(share * len(content))} bytes'):
        decode_image(content[:int(share * len(content))], 'it')


@pytest.mark.parametrize('suffix, padding', [('.jpg', bytes(5000)), ('.jpg', b'\xff' * 9), ('.png', bytes(range(256)))])
def test_what_drivers_leave_behind_the_end_is_tolerated(suffix, padding):
    content = encoded(suffix)
    np.testing.assert_array_equal(decode_image(content + padding, 'it'), decode_image(content, 'it'))


def test_a_jpeg_that_is_cut_behind_its_thumbnail_is_refused():
    thumbnail = encoded('.jpg', IMAGE[:8, :8])
    whole = encoded('.jpg')
    segment = b'\xff\xe1' + (len(thumbnail) + 2).to_bytes(2, 'big') + thumbnail
    content = whole[:2] + segment + whole[2:]
    assert decode_image(content, 'it').shape == IMAGE.shape
    with pytest.raises(BadInputError, match='cut off'):
        decode_image(content[:-100], 'it')


@pytest.mark.parametrize('content, size', [
    (png_of(30000, 30000), '30000 x 30000'), (png_of(2 ** 31 - 1, 2 ** 31 - 1), '2147483647 x 2147483647'),
    (png_of(40001, 1000), '40001 x 1000'), (jpeg_of(65500, 65500), '65500 x 65500')])
def test_too_large_images_are_refused_by_their_header(content, size):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(BadInputError, match=rf'it is {size}.* expected at most 40 \(max_image_megapixels\)'):
        decode_image(content, 'it')
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000


def test_the_limit_is_the_last_size_that_is_taken():
    content = encoded('.jpg', np.zeros((100, 200, 3), np.uint8))
    assert decode_image(content, 'it', most=0.02).shape == (100, 200, 3)
    with pytest.raises(BadInputError, match=r'200 x 100, that is 0\.02 megapixels, expected at most 0\.01'):
        decode_image(content, 'it', most=0.01)
    with pytest.raises(BadInputError, match='it is 80 x 60'):  # of a format without a known header
        decode_image(encoded('.bmp'), 'it', most=0.004)
    with pytest.raises(BadInputError, match='it is 65501 x 2, expected at most 65500 on a side'):
        decode_image(png_of(65501, 2), 'it')


def test_opencv_itself_decodes_no_monster_of_any_format():
    """The package tells OpenCV so before OpenCV is loaded, hence in a process of its own."""
    program = ('from openpose_ros_pkg.stream.image_decoding import decode_image\n'
               'import struct\n'
               "content = b'BM' + struct.pack('<IIIIiiHHIIIIII', 0, 0, 54, 40, 30000, 30000, 1, 24, 0, 0, 0, 0, 0, 0)\n"
               "decode_image(content, 'it')")
    done = subprocess.run([sys.executable, '-c', program], env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
                          stderr=subprocess.PIPE, text=True, check=False)
    assert 'BadInputError' in done.stderr
    assert 'CV_IO_MAX_IMAGE_PIXELS' in done.stderr
