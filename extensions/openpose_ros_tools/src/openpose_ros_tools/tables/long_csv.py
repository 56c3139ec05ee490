"""Hands, faces and signals as CSV, in the long form: a row per frame and point, or gesture. See docs/recordings.md."""
import csv
from typing import Iterable, Iterator, List, Optional, Sequence, TextIO, Union

import numpy as np

from openpose_ros_pkg.landmarks.records import FACE_POINTS, HAND_POINT_NAMES
from openpose_ros_signals.records import Facing, PersonSignals, Pointing, Ray
from openpose_ros_tools.tables.keypoint_table import FIELDS

# What has points, and their names.
POINTS = {'hands': HAND_POINT_NAMES, 'faces': tuple(map(str, range(FACE_POINTS)))}
_HEAD = ('time', 'frame', 'frame_id', 'person_ID')
_ORIENTATION = ('orientation_x', 'orientation_y', 'orientation_z', 'orientation_w', 'orientation_sigma')
_RAY = ('origin_x', 'origin_y', 'origin_z', 'direction_x', 'direction_y', 'direction_z', 'sigma')
SIGNAL_COLUMNS = (
    *_HEAD, 'x', 'y', 'z', 'posture', 'posture_since', 'posture_confidence', 'body_x', 'body_y', 'body_z', 'body_sigma',
    'head_x', 'head_y', 'head_z', 'head_sigma', 'moving', 'speed', 'fallen', 'fall_stamp', 'gesture', 'arm', 'since',
    'confidence', *_RAY, 'target', 'hit_x', 'hit_y', 'hit_z', 'target_probability',
    *(f'{ray}_{name}' for ray in ('eye', 'arm') for name in _RAY))
_NOWHERE = (np.nan, np.nan, np.nan)


def landmark_columns(part: str, dimensions: int) -> List[str]:
    """Return the names of the columns of 'hands' or 'faces', in space (3) or in the image (2)."""
    values = ('x', 'y', 'confidence', 'status') if dimensions == 2 else FIELDS[3]
    return [*_HEAD, *['side'] * (part == 'hands'), 'point', *values,
            *(_ORIENTATION if part == 'faces' and dimensions == 3 else ())]


class LongCsvWriter:
    """Writes rows, numbered by frame, in the order of the recording; the names of the columns at once."""

    def __init__(self, handle: TextIO, columns: Sequence[str]) -> None:
        self._rows = csv.writer(handle, lineterminator='\n')
        self._rows.writerow(columns)
        self._frame, self._time = -1, -1

    def write(self, time: int, rows: Iterable[Sequence[object]]) -> int:
        """Add what follows time [ns] and frame in the rows of a frame; return their number."""
        self._frame, self._time = self._frame + (time != self._time), time
        lines = [[time, self._frame, *row] for row in rows]
        self._rows.writerows(lines)
        return len(lines)


def signal_rows(frame_id: str, persons: Sequence[PersonSignals]) -> Iterator[List[object]]:
    """Yield a row for each gesture of each person, and one for a person without a gesture."""
    for person in persons:
        posture, walk, fall = person.posture, person.walk, person.fall
        head = [frame_id, person.id, *_short(person.place), posture.name, _nanoseconds(posture.since),
                *_short([posture.confidence]), *_facing(person.body), *_facing(person.head),
                '' if walk is None else str(walk.moving).lower(), *_short([np.nan if walk is None else walk.speed]),
                str(fall is not None).lower(), '' if fall is None else _nanoseconds(fall.stamp)]
        for each in person.gestures:
            yield [*head, each.name, each.arm, _nanoseconds(each.since), *_short([each.confidence]),
                   *_pointing(each.pointing)]
        if not person.gestures:
            yield [*head, '', '', '', np.nan, *_pointing(None)]


def _pointing(ray: Optional[Pointing]) -> List[object]:
    if ray is None:
        return [*_ray(None), '', *_NOWHERE, np.nan, *_ray(None), *_ray(None)]
    return [*_ray(ray), ray.hit.name if ray.hit else '', *_short(ray.hit.position if ray.hit else _NOWHERE),
            *_short([ray.targets[0].probability if ray.targets else np.nan]), *_ray(ray.eye_ray), *_ray(ray.arm_ray)]


def _ray(ray: Optional[Ray]) -> List[float]:
    return _short(np.full(7, np.nan) if ray is None else [*ray.origin, *ray.direction, ray.sigma])


def _facing(facing: Optional[Facing]) -> List[float]:
    return _short(np.full(4, np.nan) if facing is None else [*facing.direction, facing.sigma])


def _short(values: Union[Sequence[float], np.ndarray]) -> List[float]:
    return [round(float(value), 4) for value in values]


def _nanoseconds(stamp: float) -> object:
    """Return a stamp [s] in ns; empty where it is NaN."""
    return '' if np.isnan(stamp) else round(stamp * 1e9)
