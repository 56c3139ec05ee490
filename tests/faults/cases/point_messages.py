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


def one_point(frame: Any) -> None:
    points = frame.points
    points.width = points.height = 1
    points.row_step, points.data = points.point_step, points.data[:points.point_step]


def square(frame: Any) -> None:
    points = frame.points
    points.width = points.height


def no_fields(frame: Any) -> None:
    frame.points.fields = []


def fields_twice(frame: Any) -> None:
    frame.points.fields = frame.points.fields * 2


def many_fields(frame: Any) -> None:
    frame.points.fields = frame.points.fields * 25000


MOST = 2**32 - 1
CLOUDS = [
    ('unorganized', altered(row_of_points), 'cloud is not organized'),
    ('one point', altered(one_point), 'cloud is not organized'),
    ('no data', changed('points', data=b''), 'cloud data are truncated: 0 bytes'),
    ('last byte missing', altered(cut), 'cloud data are truncated: 4147199 bytes'),
    ('width 0', changed('points', width=0), 'empty cloud: 0 x 270 points'),
    ('height 0', changed('points', height=0), 'empty cloud: 480 x 0 points'),
    ('2^32 - 1 rows and columns', changed('points', width=MOST, height=MOST), ''),
    ('2^32 - 1 for all sizes', changed('points', width=MOST, height=MOST, row_step=MOST, point_step=MOST), ''),
    ('another aspect than the image', altered(square), 'aspect ratios differ'),
    ('no fields', altered(no_fields), 'cloud has no field x, y, z'),
    ('no z', field('z', name='range'), 'cloud has no field z'),
    ('z of type int16', field('z', datatype=3), "field 'z' of the cloud is int16"),
    ('z of an unknown type', field('z', datatype=99), "field 'z' of the cloud is unknown type 99"),
    ('float32 said to be float64', field('z', datatype=8), 'not those of a pinhole camera'),
    ('z beyond the end of a point', field('z', offset=30), 'takes bytes 30 .. 34'),
    ('z at 4 GB', field('z', offset=MOST), "field 'z' of the cloud takes bytes"),
    ('point_step 0', changed('points', point_step=0), 'point_step is 0'),
    ('points that overlap', changed('points', point_step=1), 'point_step is 1'),
    ('row_step 0', changed('points', row_step=0), 'row_step of the cloud is 0 bytes'),
    ('row_step a byte too short', changed('points', row_step=480 * 32 - 1), 'row_step of the cloud is 15359 bytes'),
    ('row_step a byte too long', changed('points', row_step=480 * 32 + 1), 'cloud data are truncated'),
    ('said to be big-endian', changed('points', is_bigendian=True), 'not those of a pinhole camera'),
    ('all points at 1e38', filled(1e38), 'not those of a pinhole camera'),
    ('all points at 1e-40', filled(1e-40), 'not those of a pinhole camera'),
    ('all points behind the camera', filled(-1.0), 'have a negative z'),
]
DEPTHS = [
    ('three channels', changed('points', encoding='rgb8'), "depth image has encoding 'rgb8'"),
    ('no encoding', changed('points', encoding=''), "depth image has encoding ''"),
    ('half of the data that 32FC1 has', changed('points', encoding='32FC1'), 'expected at least 3840'),
    ('no data', changed('points', data=b''), 'depth image data are truncated: 0 bytes'),
    ('last byte missing', altered(cut), 'depth image data are truncated: 1036799 bytes'),
    ('width 0', changed('points', width=0), 'empty depth image: 0 x 540 points'),
    ('height 0', changed('points', height=0), 'empty depth image: 960 x 0 points'),
    ('2^32 - 1 for all sizes', changed('points', width=MOST, height=MOST, step=MOST), ''),
    ('step 0', changed('points', step=0), 'row_step of the depth image is 0 bytes'),
    ('step a byte too short', changed('points', step=1919), 'row_step of the depth image is 1919 bytes'),
    ('step a byte too long', changed('points', step=1921), 'depth image data are truncated'),
    ('another aspect than the image', altered(square), 'aspect ratios differ'),
]
FAULTS = [
    *(Fault(f'cloud: {title}', inject, words=(words,) if words else ()) for title, inject, words in CLOUDS),
    Fault('cloud: each field twice', altered(fields_twice), event=''),
    Fault('cloud: 100 000 fields', altered(many_fields), event=''),
    Fault('cloud: count of z is 0', field('z', count=0), event=''),
    Fault('cloud: count of z is 2^32 - 1', field('z', count=MOST), event=''),
    *(Fault(f'depth image: {title}', inject, 'depth/people', words=(words,) if words else ())
      for title, inject, words in DEPTHS),
]
