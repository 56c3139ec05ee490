"""Image messages that contradict themselves."""
from typing import Any

from faults.fault import Fault
from faults.injectors import Injector, altered, changed

MOST = 2**32 - 1


def cut(frame: Any) -> None:
    frame.image.data = frame.image.data[:-1]


def one_pixel(frame: Any) -> None:
    image = frame.image
    image.width, image.height, image.step, image.data = 1, 1, 3, image.data[:3]


def turned(frame: Any) -> None:
    image = frame.image
    image.width, image.height, image.step = image.height, image.width, image.height * 3


def encoded(encoding: str, **fields: Any) -> Injector:
    return changed('image', encoding=encoding, **fields)


CASES = [
    ('no data', changed('image', data=b''), 'image data are truncated: 0 bytes'),
    ('last byte missing', altered(cut), 'image data are truncated: 1555199 bytes'),
    ('width 0', changed('image', width=0), 'empty image: 0 x 540'),
    ('height 0', changed('image', height=0), 'empty image: 960 x 0'),
    ('1 x 1', altered(one_pixel), 'aspect ratios differ'),
    ('portrait, with landscape points', altered(turned), 'aspect ratios differ'),
    ('2^32 - 1 rows and columns', changed('image', width=MOST, height=MOST), ''),
    ('2^32 - 1 rows, columns and bytes in a row', changed('image', width=MOST, height=MOST, step=MOST), ''),
    ('2^30 rows of one pixel', changed('image', width=1, height=2**30, step=3), ''),
    ('rows of 4 GB', changed('image', step=MOST), 'image data are truncated'),
    ('step 0', changed('image', step=0), 'image step is 0 bytes'),
    ('step a byte too short', changed('image', step=2879), 'image step is 2879 bytes'),
    ('step a byte too long', changed('image', step=2881), 'image data are truncated'),
    ('unknown encoding', encoded('none_such'), "unknown image encoding 'none_such'"),
    ('empty encoding', encoded(''), "unknown image encoding ''"),
    ('encoding of 100 000 characters', encoded('x' * 100_000), "unknown image encoding 'xxx"),
    ('encoding that would clear a terminal and begin a line', encoded('\x1b[2J\nbgr8'), "image encoding '?[2J?bgr8'"),
    ('two channels without meaning', encoded('8UC2'), "image encoding '8UC2' can not be turned into bgr8"),
    ('no channels', encoded('8UC0'), "image encoding '8UC0' can not be turned into bgr8"),
    ('10^10 channels', encoded('8UC9999999999'), ''),
    ('a depth image, 16UC1', encoded('16UC1', step=2 * 960), "image encoding '16UC1' can not be turned into bgr8"),
    ('float32', encoded('32FC1', width=720), "image encoding '32FC1' can not be turned into bgr8"),
    ('YUYV with an odd width', encoded('yuv422_yuy2', width=959), 'expected an even number'),
]
FAULTS = [*(Fault(title, inject, 'two/extractor', words=(words,) if words else ())
            for title, inject, words in CASES),
          Fault('bytes behind the last row', changed('image', height=539), 'two/extractor', event=''),
          Fault('bgr8, said to be big-endian', changed('image', is_bigendian=1), 'two/extractor', event=''),
          Fault('mosaic of colours that is none', encoded('bayer_rggb8'), 'two/extractor', event='')]
