"""Image messages that contradict themselves."""
from typing import Any

from faults.fault import Fault
from faults.injectors import Injector, altered, changed

MOST = 2**32 - 1


def turned(frame: Any) -> None:
    image = frame.image
    image.width, image.height, image.step = image.height, image.width, image.height * 3


def encoded(encoding: str, **fields: Any) -> Injector:
    return changed('image', encoding=encoding, **fields)


CASES = [
    ('no data', changed('image', data=b''), 'image data are truncated: 0 bytes'),
    ('width 0', changed('image', width=0), 'empty image: 0 x 540'),
    ('portrait, with landscape points', altered(turned), 'aspect ratios differ'),
    ('rows of 4 GB', changed('image', step=MOST), 'image data are truncated'),
    ('step a byte too short', changed('image', step=2879), 'image step is 2879 bytes'),
    ('unknown encoding', encoded('none_such'), "unknown image encoding 'none_such'"),
    ('encoding that would clear a terminal and begin a line', encoded('\x1b[2J\nbgr8'), "image encoding '?[2J?bgr8'"),
    ('a depth image, 16UC1', encoded('16UC1', step=2 * 960), "image encoding '16UC1' can not be turned into bgr8"),
    ('YUYV with an odd width', encoded('yuv422_yuy2', width=959), 'expected an even number'),
]
FAULTS = [*(Fault(title, inject, 'two/extractor', words=(words,) if words else ())
            for title, inject, words in CASES),
          Fault('bytes behind the last row', changed('image', height=539), 'two/extractor', event='')]
