"""Image messages that contradict themselves."""
from typing import Any

from faults.fault import Fault
from faults.injectors import altered, changed


def cut(frame: Any) -> None:
    frame.image.data = frame.image.data[:-1]


FAULTS = [
    Fault('image without data', changed('image', data=b''), words=('image data are truncated: 0 bytes',)),
    Fault('last byte of the image missing', altered(cut), words=('image data are truncated',)),
    Fault('image of width 0', changed('image', width=0), words=('empty image: 0 x 540',)),
    Fault('unknown encoding', changed('image', encoding='none_such'), words=("unknown image encoding 'none_such'",)),
]
