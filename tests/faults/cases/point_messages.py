"""Clouds and depth images that contradict themselves."""
from typing import Any

import numpy as np

from faults.fault import Fault
from faults.injectors import Injector, altered, changed, edit


def field(of: str, **values: Any) -> Injector:
    """Return what sends a cloud one of whose fields has other values."""
    return altered(lambda frame: edit([each for each in frame.points.fields if each.name == of], **values))


def row_of_points(frame: Any) -> None:
    points = frame.points
    edit(points, width=points.width * points.height, height=1, row_step=len(points.data))


CUT = changed('points', data=lambda data: data[:-1])
SQUARE = altered(lambda frame: edit(frame.points, width=frame.points.height))
MOST = 2**32 - 1
CLOUDS = [
    ('unorganized', altered(row_of_points), 'cloud is not organized'),
    ('last byte missing', CUT, 'cloud data are truncated: 4147199 bytes'),
    ('another aspect than the image', SQUARE, 'aspect ratios differ'),
    ('no z', field('z', name='range'), 'cloud has no field z'),
    ('z of type int16', field('z', datatype=3), "field 'z' of the cloud is int16"),
    ('z at 4 GB', field('z', offset=MOST), "field 'z' of the cloud takes bytes"),
    ('points that overlap', changed('points', point_step=1), 'point_step is 1'),
    ('row_step a byte too short', changed('points', row_step=480 * 32 - 1), 'row_step of the cloud is 15359 bytes'),
    ('all points at 1e38', changed('points', data=lambda data: np.full(len(data) // 4, 1e38, '<f4').tobytes()),
     'not those of a pinhole camera'),
]
DEPTHS = [
    ('three channels', changed('points', encoding='rgb8'), "depth image has encoding 'rgb8'"),
    ('last byte missing', CUT, 'depth image data are truncated: 1036799 bytes'),
    ('2^32 - 1 for all sizes', changed('points', width=MOST, height=MOST, step=MOST), ''),
    ('step a byte too short', changed('points', step=1919), 'row_step of the depth image is 1919 bytes'),
    ('another aspect than the image', SQUARE, 'aspect ratios differ'),
]
FAULTS = [
    *(Fault(f'cloud: {title}', inject, words=(words,) if words else ()) for title, inject, words in CLOUDS),
    Fault('cloud: 100 000 fields', changed('points', fields=lambda fields: fields * 25000), event=''),
    Fault('cloud: count of z is 2^32 - 1', field('z', count=MOST), event=''),
    *(Fault(f'depth image: {title}', inject, 'depth/people', words=(words,) if words else ())
      for title, inject, words in DEPTHS),
]
