"""Image messages that contradict themselves."""
from faults.fault import Fault
from faults.injectors import altered, changed, edit

CASES = [
    ('no data', changed('image', data=b''), 'image data are truncated: 0 bytes'),
    ('width 0', changed('image', width=0), 'empty image: 0 x 540'),
    ('portrait, with landscape points', altered(lambda frame: edit(
        frame.image, width=frame.image.height, height=frame.image.width, step=frame.image.height * 3)),
     'aspect ratios differ'),
    ('rows of 4 GB', changed('image', step=2**32 - 1), 'image data are truncated'),
    ('step a byte too short', changed('image', step=2879), 'image step is 2879 bytes'),
    ('unknown encoding', changed('image', encoding='none_such'), "unknown image encoding 'none_such'"),
    ('encoding that would clear a terminal and begin a line', changed('image', encoding='\x1b[2J\nbgr8'),
     "image encoding '?[2J?bgr8'"),
    ('a depth image, 16UC1', changed('image', encoding='16UC1', step=2 * 960),
     "image encoding '16UC1' can not be turned into bgr8"),
    ('YUYV with an odd width', changed('image', encoding='yuv422_yuy2', width=959), 'expected an even number'),
]
FAULTS = [*(Fault(title, inject, 'two/extractor', words=(words,)) for title, inject, words in CASES),
          Fault('bytes behind the last row', changed('image', height=539), 'two/extractor', event='')]
