"""Images that ask for too much memory, and compressed images that are not whole; nothing is decoded of them."""
from typing import Any

import cv2
import numpy as np

from faults.fault import Fault
from faults.injectors import altered, changed, request_refused

_NODE = 'compressed/people'
_LIMIT = 'expected at most 40 (max_image_megapixels)'
_HUGE = {'width': 2 ** 32 - 1, 'height': 2 ** 32 - 1}


def encoded(suffix: str) -> bytes:
    return bytes(cv2.imencode(suffix, np.zeros((64, 64), np.uint8))[1].tobytes())


JPEG, PNG, BMP = (encoded(suffix) for suffix in ('.jpg', '.png', '.bmp'))
# a whole file whose header says 30000 x 30000
LARGER_PNG = PNG[:16] + 2 * (30000).to_bytes(4, 'big') + PNG[24:]


def cut_jpeg(frame: Any) -> None:
    """Send the good image as a JPEG whose lower half is missing: OpenCV fills it with grey."""
    bgr = cv2.imdecode(np.frombuffer(frame.image.data, np.uint8), cv2.IMREAD_COLOR)
    content = cv2.imencode('.jpg', bgr)[1].tobytes()
    frame.image.data = content[:len(content) // 2]


FAULTS = [
    Fault('half a JPEG', altered(cut_jpeg), _NODE, words=('is cut off', 'without the mark of its end')),
    Fault('PNG of 30000 x 30000', changed('image', data=LARGER_PNG), _NODE, words=('is 30000 x 30000', _LIMIT)),
    Fault('compressed image that is a BMP', changed('image', data=BMP), _NODE, words=('expected JPEG or PNG',)),
    Fault('compressed depth image of 30000 x 30000', changed('points', data=bytes(12) + LARGER_PNG), _NODE,
          words=('compressed depth image is 30000 x 30000', _LIMIT)),
    Fault('image of 2^32 - 1 pixels on each side', changed('image', **_HUGE),
          words=('image is 4294967295 x 4294967295', _LIMIT)),
    Fault('request with an image of 2^32 - 1 pixels on each side', request_refused(_LIMIT, **_HUGE), 'two/service',
          'bad image', ('image is 4294967295 x 4294967295', _LIMIT)),
    Fault('image of a row of 518400 columns', changed('image', width=540 * 960, height=1, step=3 * 540 * 960),
          words=('expected at most 65500 on a side',)),
    Fault('cloud of 2^32 - 1 points on each side', changed('points', **_HUGE), words=('row_step',)),
    Fault('depth image of 2^32 - 1 pixels on each side', changed('points', **_HUGE), 'depth/people',
          words=('depth image',)),
]
