"""Clouds and depth images that contradict themselves."""
from typing import Any

from faults.fault import Fault
from faults.injectors import Injector, altered, changed


def cut(frame: Any) -> None:
    frame.points.data = frame.points.data[:-1]


def field(of: str, **values: Any) -> Injector:
    """Return what sends a cloud one of whose fields has other values."""
    def change(frame: Any) -> None:
        for each in frame.points.fields:
            if each.name == of:
                for key, value in values.items():
                    setattr(each, key, value)
    return altered(change)


def filled(value: float) -> Injector:
    """Return what sends a cloud or depth image of which all numbers are this one."""
    def change(frame: Any) -> None:
        import numpy as np
        frame.points.data = np.full(len(frame.points.data) // 4, value, '<f4').tobytes()
    return altered(change)


def row_of_points(frame: Any) -> None:
    points = frame.points
    points.width, points.height, points.row_step = points.width * points.height, 1, len(points.data)


def square(frame: Any) -> None:
    points = frame.points
    points.width = points.height


def many_fields(frame: Any) -> None:
    frame.points.fields = frame.points.fields * 25000


MOST = 2**32 - 1
CLOUDS = [
    ('unorganized', altered(row_of_points), 'cloud is not organized'),
    ('last byte missing', altered(cut), 'cloud data are truncated: 4147199 bytes'),
    ('another aspect than the image', altered(square), 'aspect ratios differ'),
    ('no z', field('z', name='range'), 'cloud has no field z'),
    ('z of type int16', field('z', datatype=3), "field 'z' of the cloud is int16"),
    ('z at 4 GB', field('z', offset=MOST), "field 'z' of the cloud takes bytes"),
    ('points that overlap', changed('points', point_step=1), 'point_step is 1'),
    ('row_step a byte too short', changed('points', row_step=480 * 32 - 1), 'row_step of the cloud is 15359 bytes'),
    ('all points at 1e38', filled(1e38), 'not those of a pinhole camera'),
]
DEPTHS = [
    ('three channels', changed('points', encoding='rgb8'), "depth image has encoding 'rgb8'"),
    ('last byte missing', altered(cut), 'depth image data are truncated: 1036799 bytes'),
    ('2^32 - 1 for all sizes', changed('points', width=MOST, height=MOST, step=MOST), ''),
    ('step a byte too short', changed('points', step=1919), 'row_step of the depth image is 1919 bytes'),
    ('another aspect than the image', altered(square), 'aspect ratios differ'),
]
FAULTS = [
    *(Fault(f'cloud: {title}', inject, words=(words,) if words else ()) for title, inject, words in CLOUDS),
    Fault('cloud: 100 000 fields', altered(many_fields), event=''),
    Fault('cloud: count of z is 2^32 - 1', field('z', count=MOST), event=''),
    *(Fault(f'depth image: {title}', inject, 'depth/people', words=(words,) if words else ())
      for title, inject, words in DEPTHS),
]
